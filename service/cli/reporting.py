"""The command that writes a report: of a grasp log, or of a material of a running service."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.connection import connected
from service.cli.inputs import read_log, refuse_inputs
from service.cli.inspection import with_forces_by
from service.cli.options import DEFAULT_URL, DETECTOR_HELP, FrameRate, GelFile, Key, Mapping, Rest, Scale, Url

if TYPE_CHECKING:
    from service.report.page import Report


class PictureFormat(StrEnum):
    """Of pictures beside a report."""

    png = "png"
    svg = "svg"


def report(
    what: Annotated[str, typer.Argument(metavar="LOG|MATERIAL", help="A file of a grasp log, or a material's name.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="The HTML file to write; everything is inside of it.")],
    pictures: Annotated[
        PictureFormat | None, typer.Option(help="Write its pictures as files of this kind beside it, too.")
    ] = None,
    method: Annotated[str | None, typer.Option(help=DETECTOR_HELP)] = None,
    scale: Scale = None,
    frame_rate: FrameRate = None,
    mapping: Mapping = None,
    rest: Rest = None,
    gel: GelFile = None,
    url: Url = DEFAULT_URL,
    key: Key = None,
) -> None:
    """Write a report of a grasp log, or of a material of a service: one HTML file, to be read anywhere."""
    from service.report.page import write_report

    path = Path(what)
    refuse_inputs(output, path, mapping)
    if path.exists():
        made = _of_log(path, method, scale, frame_rate, mapping, rest, gel)
    elif len(path.parts) > 1:
        raise typer.BadParameter(f"there is no file {what}; allowed: a grasp log, or the name of a material")
    else:
        made = _of_material(what, url, key)
    if pictures is not None:
        _write_pictures(made, output, pictures.value)
    typer.echo(f"{write_report(made, output)}")


def _of_log(
    path: Path,
    method: str | None,
    scale: float | None,
    frame_rate: float | None,
    mapping: Path | None,
    rest: str | None,
    gel: Path | None,
) -> "Report":
    from service.domain.logs.grasp_report import report_of_log

    log, reconstruction = with_forces_by(gel, read_log(path, mapping, scale, frame_rate, rest))
    return report_of_log(log, path.name, method, reconstruction)


def _of_material(name: str, url: str, key: str | None) -> "Report":
    from service.report.material import material_report
    from service.report.wording import NEWEST_LOGS

    with connected(url, key) as client:
        material = client.material(name)
        logs = client.grasp_logs(material.name, NEWEST_LOGS)
        probe = client.next_grasp(material.name) if material.recommended else None
    return material_report(material, logs, probe)


def _write_pictures(made: "Report", beside: Path, kind: str) -> None:
    from service.report.pictures import save

    for number, picture in enumerate(made.pictures, 1):
        typer.echo(f"{save(picture.figure, beside.with_name(f'{beside.stem}-{number}.{kind}'))}")
