"""Commands on the grasp logs of a running service: list, show, withdraw."""

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.connection import connected
from service.cli.options import DEFAULT_URL, Json, Key, Limit, Url
from service.cli.output import print_json, print_lines, print_table, when
from service.formatting import number, size

if TYPE_CHECKING:
    from stiction_client import Detection, GraspLogReceipt, Withdrawal

app = typer.Typer(help="Look at the grasp logs of a service, and withdraw them.", no_args_is_help=True)
LogId = Annotated[str, typer.Argument(metavar="ID", help="The log's id, as `upload` and `list` show it.")]


@app.command("list")
def list_logs(
    material: Annotated[str | None, typer.Option(help="Only those of this material.")] = None,
    limit: Limit = 20,
    url: Url = DEFAULT_URL,
    key: Key = None,
    json: Json = False,
) -> None:
    """List the newest grasp logs, with what became of them."""
    with connected(url, key) as client:
        found = client.grasp_logs(material, limit)
    if json:
        print_json({"grasp_logs": [asdict(log) for log in found]})
    else:
        columns = ("id", "material", "sensor", "frames", "status", "reason", "uploaded")
        print_table("Grasp logs", columns, [_row(log) for log in found])


@app.command()
def show(log: LogId, url: Url = DEFAULT_URL, key: Key = None, json: Json = False) -> None:
    """Show a grasp log: what it holds, what was seen in it, and what makes it doubtful."""
    with connected(url, key) as client:
        found = client.grasp_log(log)
    if json:
        print_json(asdict(found))
    else:
        print_lines(found.id, _lines(found))


@app.command()
def withdraw(
    log: LogId,
    reason: Annotated[str, typer.Option(help="Why nobody should learn from it; kept with the log.")],
    url: Url = DEFAULT_URL,
    key: Key = None,
) -> None:
    """Take a log out of its material's fits, which are made again without it; the log is kept."""
    with connected(url, key) as client:
        withdrawn = client.withdraw(log, reason)
    typer.echo(f"{withdrawn.id} is withdrawn")
    if withdrawn.counts_instead is not None:
        typer.echo(f"A merge had left it behind: {withdrawn.counts_instead}, of the same content, still counts")


def _row(log: "GraspLogReceipt") -> list[str | None]:
    made = when(log.created_at)
    return [log.id, log.material, log.sensor, str(log.frames), log.job.status, log.job.reason, made]


def _lines(log: "GraspLogReceipt") -> list[tuple[str, str | None]]:
    rows, columns = log.grid
    held = f"{log.frames} frames of {rows} × {columns} in {number(log.duration)} s"
    lines: list[tuple[str, str | None]] = [
        ("material", log.material or "none"),
        ("sensor", log.sensor or None),
        ("holds", f"{held}, {size(log.bytes)} of {log.format}"),
        ("uploaded", when(log.created_at)),
        ("job", f"{log.job.status}{f': {log.job.reason}' if log.job.reason else ''}"),
        ("withdrawn", None if log.withdrawal is None else _withdrawal(log.withdrawal)),
    ]
    return lines if log.detection is None else lines + _detection_lines(log.detection)


def _withdrawal(withdrawal: "Withdrawal") -> str:
    by = "" if withdrawal.by is None else f" by key {withdrawal.by}"
    return f"{when(withdrawal.at)}{by}: {withdrawal.reason}"


def _detection_lines(seen: "Detection") -> list[tuple[str, str | None]]:
    touched = seen.stick_ratio_min is not None
    slipping = f"{seen.macro_slip_frames} of {seen.contact_frames} frames in contact slip as a whole"
    found = [(finding.name, f"{finding.evidence}; {finding.remedy}") for finding in seen.findings or ()]
    return [
        ("detected by", seen.method),
        ("macro slip", slipping),
        ("stick ratio", f"{number(seen.stick_ratio_min)} at its smallest" if touched else None),
        ("samples", str(seen.samples)),
        *found,
    ]
