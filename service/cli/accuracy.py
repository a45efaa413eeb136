"""The command that draws what accuracy costs: of a scene, of logs, or of a material of a service."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli.connection import connected
from service.cli.exit_codes import INTERRUPTED
from service.cli.inputs import read_log, refuse_inputs
from service.cli.options import DEFAULT_URL, FrameRate, Json, Key, Mapping, Picture, Rest, Scale, Url
from service.cli.output import print_json, print_table
from service.cli.progress import counted, shown_progress
from service.formatting import number
from service.whole_files import check_place

if TYPE_CHECKING:
    from service.report.work_precision import Setting, WorkPrecision
    from slipcore import GraspLog


def accuracy(
    what: Annotated[
        list[str],
        typer.Argument(
            metavar="SCENE|LOG...|MATERIAL",
            help="A scene file (TOML) or a scene of the library; files of grasp logs of one material; or the name of a "
            "material of a service.",
        ),
    ],
    seconds: Annotated[float, typer.Option(help="To spend on the grids of a scene, about.")] = 20.0,
    seed: Annotated[int, typer.Option(min=0, help="Seed of a scene's random fields and noise.")] = 0,
    scale: Scale = None,
    frame_rate: FrameRate = None,
    mapping: Mapping = None,
    rest: Rest = None,
    picture: Picture = None,
    url: Url = DEFAULT_URL,
    key: Key = None,
    json: Json = False,
) -> None:
    """Draw what accuracy costs in seconds, and say what to ask for: simulating a scene, detecting slip, fitting."""
    from slipcore.contact.tiers.choice import check_request

    check_request(seconds=seconds)
    paths = [Path(each) for each in what]
    if picture is not None:
        for path in paths:
            refuse_inputs(picture, path)
        check_place(picture)
    interrupted = False
    if len(paths) == 1 and _is_scene(what[0]):
        scene, interrupted = _of_scene(what[0], seconds, seed)
        found = [scene]
    elif all(path.exists() for path in paths):
        logs = [read_log(path, mapping, scale, frame_rate, rest) for path in paths]
        found = _of_logs(paths[0].name, logs)
    elif len(paths) == 1 and len(paths[0].parts) == 1:
        found = [_of_material(what[0], url, key)]
    else:
        missing = next(str(path) for path in paths if not path.exists())
        raise typer.BadParameter(f"there is no file {missing}; allowed: one scene, grasp logs, or a material's name")
    _tell(found, picture, json)
    if interrupted:
        raise typer.Exit(INTERRUPTED)


def _is_scene(text: str) -> bool:
    from slipcore.contact import library

    return text.endswith(".toml") or text in library()


def _of_scene(name: str, seconds: float, seed: int) -> "tuple[WorkPrecision, bool]":
    """What a scene costs, and whether Ctrl-C ended it: it is then what was found until then."""
    from service.report import work_precision
    from slipcore.contact import Scene

    scene = Scene.from_toml(name)
    with shown_progress(f"simulating {scene.name} ever more finely") as tell:
        try:
            return work_precision.of_scene(scene, seconds, seed, tell), False
        except work_precision.Unfinished as stopped:
            return stopped.found, True


def _of_logs(first: str, logs: "list[GraspLog]") -> "list[WorkPrecision]":
    """Of detection in the first log, by its name, and of a fit to all of them where they have slip enough."""
    from estimators import TooFewSamples
    from service.report import work_precision
    from slipcore import InvalidInput, collect_samples, detect_slip, recommended_method

    with shown_progress(f"detecting slip in {first} by every method") as tell:
        found = [work_precision.of_detection(logs[0], first, tell)]
    try:
        each = counted(logs, len(logs), "logs looked at")
        grasps = [collect_samples(log, detect_slip(log, recommended_method(log))) for log in each]
        with shown_progress("fitting by every method") as tell:
            fits = work_precision.of_fits(grasps, f"friction of {len(logs)} grasp(s)", tell)
    except (TooFewSamples, InvalidInput) as none:
        typer.echo(f"no fit: {none}", err=True)
        return found
    return [*found, fits]


def _of_material(name: str, url: str, key: str | None) -> "WorkPrecision":
    from service.report import work_precision

    with _likely_scene(name), connected(url, key) as client:
        methods = sorted(client.material(name).models)
        return work_precision.of_models(name, [client.model(name, method) for method in methods])


@contextmanager
def _likely_scene(name: str) -> Iterator[None]:
    """Say of a material that is not found, or asked of no service, which scenes are called much like it."""
    from slipcore.contact import library
    from stiction_client.errors import StictionError

    try:
        yield
    except StictionError as error:
        near = get_close_matches(name, library())
        if near:
            error.add_note(f"or was a scene meant: {' or '.join(near)}?")
        raise


def _tell(found: "list[WorkPrecision]", picture: Path | None, json: bool) -> None:
    if picture is not None:
        from service.report import work_precision
        from service.report.pictures import save

        save(work_precision.draw(found), picture)
    if json:
        print_json({"subjects": [_record(each) for each in found]})
        return
    for each in found:
        rows = [
            ("*" if is_worth else "", setting.ask, number(setting.seconds), _error(setting), setting.told)
            for setting, is_worth in zip(each.settings, each.worth_asking(), strict=True)
        ]
        print_table(f"{each.subject}; error: {each.measure}", ("worth it", "ask for", "seconds", "error", ""), rows)


def _error(setting: "Setting") -> str:
    return "–" if math.isnan(setting.error) else number(setting.error)


def _record(found: "WorkPrecision") -> dict[str, Any]:
    worth = found.worth_asking()
    settings = [asdict(each) | {"worth_asking": is_worth} for each, is_worth in zip(found.settings, worth, strict=True)]
    return {"subject": found.subject, "error": found.measure, "settings": settings}
