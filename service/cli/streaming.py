"""The command that replays a grasp log to a service as if it happened now."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from math import inf, isfinite
from pathlib import Path
from tempfile import NamedTemporaryFile
from time import perf_counter, sleep
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli.connection import reached
from service.cli.inputs import read_log
from service.cli.options import DEFAULT_URL, DETECTOR_HELP, FrameRate, Json, Key, Mapping, Rest, Scale, Url
from service.cli.output import print_json, print_lines
from service.formatting import number

if TYPE_CHECKING:
    from slipcore import GraspLog
    from stiction_client.stream import SlipStream

STANDARD_INPUT = Path("-")


def stream(
    log: Annotated[
        Path, typer.Argument(metavar="LOG|-", help="A grasp log in any format of docs/formats.md; -: standard input.")
    ],
    material: Annotated[str | None, typer.Option(help="Material that is held.")] = None,
    store: Annotated[bool, typer.Option("--store", help="At the end, store the frames as a grasp log.")] = False,
    speed: Annotated[float, typer.Option(min=1e-3, help="How many times as fast as it was recorded.")] = 1.0,
    method: Annotated[str | None, typer.Option(help=DETECTOR_HELP)] = None,
    scale: Scale = None,
    frame_rate: FrameRate = None,
    mapping: Mapping = None,
    rest: Rest = None,
    url: Url = DEFAULT_URL,
    key: Key = None,
    json: Json = False,
) -> None:
    """Replay a grasp log to a service in real time, as a live stream that can be watched in the dashboard."""
    from slipcore.errors import InvalidInput
    from slipcore.method_choice import recommended_method
    from stiction_client.stream import SlipStream

    if not isfinite(speed):
        raise typer.BadParameter(f"--speed is {speed}; allowed: a number, such as 2")
    with _file(log) as path:
        grasp = read_log(path, mapping, scale, frame_rate, rest)
    if grasp.displacement is None:
        raise InvalidInput("displacement", "missing", "a log with displacements: a live stream needs them")
    detector = method or recommended_method(grasp)
    options: dict[str, Any] = {"sensor": grasp.sensor, "material": material, "keep": store, "detector": detector}
    with reached(url), SlipStream(url, grasp.position, grasp.element_area, key=key, **options) as live:
        page = f"{url.rstrip('/')}/live/{live.session}"
        typer.echo(f"to be watched at {page}", err=True)
        try:
            answers = list(_replay(live, grasp, speed))
        except KeyboardInterrupt:
            live.finish()
            raise
        stored = live.finish(store)
    summary = _summary(answers) | {"page": page, "grasp_log": None if stored is None else stored["id"]}
    if json:
        print_json(summary)
    else:
        print_lines(f"{log.name}: replayed to {url}", _lines(summary))


@contextmanager
def _file(log: Path) -> Iterator[Path]:
    """The log as a file, with what comes on standard input written to one for a while."""
    if log != STANDARD_INPUT:
        yield log
        return
    with NamedTemporaryFile() as copy:
        copy.write(sys.stdin.buffer.read())
        copy.flush()
        yield Path(copy.name)


def _replay(live: "SlipStream", log: "GraspLog", speed: float) -> Iterator[dict[str, Any]]:
    """Each frame when it is due, and its answer."""
    began, first = perf_counter(), float(log.time[0])
    arrays = (log.displacement, log.force, log.object_pose, log.normal)
    gripper, deviation = log.gripper_force, log.gripper_force_deviation
    for k, time in enumerate(log.time.tolist()):
        sleep(max(began + (time - first) / speed - perf_counter(), 0.0))
        report = {} if gripper is None else {"gripper_force": gripper[k], "gripper_force_deviation": deviation}
        yield live.step(time, *(None if array is None else array[k] for array in arrays), **report)  # type: ignore[arg-type]


def _summary(answers: list[dict[str, Any]]) -> dict[str, Any]:
    states = [answer for answer in answers if answer["type"] == "state"]
    ratios = [state["stick_ratio"] for state in states if state["stick_ratio"] is not None]
    return {
        "frames": len(states),
        "refused_frames": len(answers) - len(states),
        "stick_ratio_min": min(ratios, default=None),
        "macro_slip_frames": sum(state["macro_slip"] for state in states),
        "friction": states[-1]["friction"] if states else None,
        "findings": states[-1].get("findings", []) if states else [],
        "forces": _forces([state["force"] for state in states if state.get("force")]),
    }


def _forces(told: list[dict[str, Any]]) -> dict[str, Any] | None:
    """Where forces of frames that had none are from, by what each state told of them."""
    if not told:
        return None
    waiting = sum(each.get("wait_for") is not None for each in told)
    return {"source": told[-1]["source"], "reason": told[-1].get("reason"), "waiting_frames": waiting}


def _lines(summary: dict[str, Any]) -> list[tuple[str, str | None]]:
    refused, friction, forces = summary["refused_frames"], summary["friction"], summary["forces"]
    return [
        ("frames", f"{summary['frames']}{f', and {refused} refused' if refused else ''}"),
        ("least stick ratio", number(summary["stick_ratio_min"])),
        ("gross slip", f"in {summary['macro_slip_frames']} frames"),
        ("forces", _told_forces(forces)),
        ("friction", _friction(friction) if friction else _why_none(summary["findings"], forces)),
        ("grasp log", summary["grasp_log"]),
    ]


def _told_forces(forces: dict[str, Any] | None) -> str | None:
    if forces is None:
        return None
    if forces["source"] == "none":
        return f"none: {forces['reason']}"
    waiting = forces["waiting_frames"]
    return "reconstructed from displacement" + (f", not yet known in {waiting} frames" if waiting else "")


def _why_none(findings: list[dict[str, str]], forces: dict[str, Any] | None) -> str:
    reasons = [f"{finding['evidence']}; {finding['remedy']}" for finding in findings]
    are_found = forces is not None and forces["source"] != "none"
    why = "elements' forces are too unsure" if are_found else "there are no forces"
    return f"no samples: {'; '.join(reasons) or f'nothing slipped, or {why}'}"


def _friction(found: dict[str, Any]) -> str:
    error = found["standard_errors"][0]
    deviation = f" ± {number(error)}" if (inf if error is None else error) < inf else ""
    return f"β₀ = {number(found['coefficients'][0])}{deviation} (standard error), from {found['samples']} samples"
