"""Commands on sensors: list, describe, calibrate, calibrate-gel."""

from collections.abc import Mapping, Sequence
from json import dumps, loads
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli import sources
from service.cli.connection import connected
from service.cli.inputs import read_log, refuse_inputs, rest_of
from service.cli.options import DEFAULT_URL, FrameRate, Json, Key, Rest, Scale, Url
from service.cli.options import Mapping as MappingFile
from service.cli.output import print_json, print_table
from service.formatting import interval, number
from service.whole_files import write_whole

if TYPE_CHECKING:
    from slipcore import GraspLog

app = typer.Typer(help="Show sensors, describe their gels, and learn their faults.", no_args_is_help=True)

StoredSensor = Annotated[
    str | None, typer.Option("--sensor", help="With --store: name of the sensor, where its logs do not give it.")
]

THICKEST = 1.0
"""m; what is thicker the service takes for a half-space."""


@app.command("list")
def list_sensors(url: Url = DEFAULT_URL, key: Key = None, json: Json = False) -> None:
    """List all sensors with the mechanics of their gels, where they are described."""
    with connected(url, key) as client:
        found = client.sensors()
    if json:
        print_json({"sensors": found})
    else:
        columns = ("sensor", "Young's modulus [Pa]", "Poisson's ratio", "thickness [m]", "marker depth [m]")
        print_table("Sensors", columns, [[each["name"], *_cells(each["gel"])] for each in found])


def _cells(gel: Mapping[str, Any] | None) -> list[str]:
    """The mechanics of a gel; a thickness of None is that of a half-space, and of a map the least and the most."""
    if gel is None:
        return []
    thickness, uneven = gel["thickness"], gel.get("relative_thickness")
    own, depth = (number(gel[name]) for name in ("young_modulus", "poisson_ratio")), number(gel["marker_depth"])
    if uneven:
        thinnest, thickest = (thickness * of(map(of, uneven)) for of in (min, max))
        return [*own, f"{number(thinnest)} … {number(thickest)}", depth]
    return [*own, "thick" if thickness is None else number(thickness), depth]


@app.command()
def describe(
    sensor: Annotated[str, typer.Argument(help="Name of the sensor, as its logs give it.")],
    young_modulus: Annotated[float, typer.Option(help="Young's modulus of the gel, Pa.")],
    poisson_ratio: Annotated[float, typer.Option(help="Poisson's ratio of the gel.")],
    thickness: Annotated[
        float | None,
        typer.Option(
            help="Surface to rigid base, m, at least a tenth of the markers' distance; without it, or inf: thick "
            "against any contact."
        ),
    ] = None,
    marker_depth: Annotated[float, typer.Option(help="Of the markers below the surface, m.")] = 0.0,
    relative_thickness: Annotated[
        Path | None,
        typer.Option(help="Of a gel not alike thick everywhere: a JSON file of rows, at each marker over --thickness."),
    ] = None,
    url: Url = DEFAULT_URL,
    key: Key = None,
) -> None:
    """Describe a sensor's gel, so that forces of its logs are reconstructed where they have none."""
    uneven = None if relative_thickness is None else _rows_of(relative_thickness)
    with connected(url, key) as client:
        client.describe_sensor(sensor, young_modulus, poisson_ratio, thickness, marker_depth, uneven)
    typer.echo(f"{sensor} is described: logs of it without forces get reconstructed ones from now on")


def _rows_of(path: Path) -> list[list[float]]:
    """Numbers of a JSON file, row by row; which they may be the service says."""
    try:
        return [[float(value) for value in row] for row in loads(path.read_bytes())]
    except (OSError, TypeError, ValueError) as error:
        raise typer.BadParameter(f"--relative-thickness of {path}: {error}; allowed: [[1.0, 0.9, …], …]") from error


@app.command()
def calibrate(
    logs: Annotated[list[Path], typer.Argument(help="Logs of a body pressed straight down on the sensor, and lifted.")],
    known_force: Annotated[
        list[float] | None,
        typer.Option(
            help="Normal force with which the body pressed, N: one of all logs, or given once for each; "
            "else what their grippers report."
        ),
    ] = None,
    scale: Scale = None,
    frame_rate: FrameRate = None,
    mapping: MappingFile = None,
    rest: Rest = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Write the sensor model to this JSON.")] = None,
    store: Annotated[
        bool,
        typer.Option("--store", help="Send the logs to a service, which corrects the sensor's later logs by them."),
    ] = False,
    sensor: StoredSensor = None,
    url: Url = DEFAULT_URL,
    key: Key = None,
    json: Json = False,
) -> None:
    """Learn a sensor's faults from pure presses: zero, drift, crosstalk, smoothing, noise and gain."""
    if store and output is not None:
        raise typer.BadParameter("--store with --output; allowed: one of them")
    if output is not None:
        refuse_inputs(output, *logs, mapping)
    if store:
        found = sources.found(logs, mapping, scale=scale, frame_rate=frame_rate, rest=rest_of(rest))
        calibration = _stored(found, _known_forces(known_force, len(found)), sensor, url, key)
    else:
        forces = _known_forces(known_force, len(logs))
        calibration = _learnt([read_log(path, mapping, scale, frame_rate, rest) for path in logs], forces)
    if output is not None:
        write_whole(output, lambda beside: beside.write_text(dumps(calibration), encoding="utf-8"))
    if json:
        print_json(calibration)
    else:
        rows = [_estimate_cells(each) for each in calibration["estimates"]]
        version = f", version {calibration['version']}" if store else ""
        print_table(f"Calibration by {len(logs)} logs{version}", ("", "estimate", "95 % interval", ""), rows)


@app.command("calibrate-gel")
def calibrate_gel(
    logs: Annotated[list[Path], typer.Argument(help="Logs of a round body pressed straight down on the sensor.")],
    known_force: Annotated[
        list[float] | None,
        typer.Option(
            help="Normal force of the press where it is held, N: one of all logs, or given once for each; "
            "else what their grippers report."
        ),
    ] = None,
    young_modulus: Annotated[float | None, typer.Option(help="Young's modulus, Pa, where it is known.")] = None,
    poisson_ratio: Annotated[float | None, typer.Option(help="Poisson's ratio, where it is known.")] = None,
    thickness: Annotated[
        float | None, typer.Option(help="Surface to rigid base, m, where it is known; inf: thick against any contact.")
    ] = None,
    marker_depth: Annotated[float, typer.Option(help="Of the markers below the surface, m.")] = 0.0,
    noise: Annotated[
        float | None, typer.Option(help="Standard deviation of a marker's coordinate, m; else by the logs.")
    ] = None,
    relative_thickness: Annotated[
        Path | None,
        typer.Option(
            help="Of a gel not alike thick everywhere: a JSON file of rows, at each marker over its thickness."
        ),
    ] = None,
    scale: Scale = None,
    frame_rate: FrameRate = None,
    mapping: MappingFile = None,
    rest: Rest = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Write the gel to this JSON, for --gel.")
    ] = None,
    store: Annotated[bool, typer.Option("--store", help="Describe the sensor's gel in a service so.")] = False,
    sensor: StoredSensor = None,
    url: Url = DEFAULT_URL,
    key: Key = None,
    json: Json = False,
) -> None:
    """Learn a gel's stiffness, Poisson's ratio and thickness from presses with known forces."""
    from service.cli.progress import shown_progress
    from slipcore.forces import calibrate_gel as calibrated

    if output is not None:
        refuse_inputs(output, *logs, mapping, relative_thickness)
    uneven = None if relative_thickness is None else _rows_of(relative_thickness)
    forces = _known_forces(known_force, len(logs))
    presses = [read_log(path, mapping, scale, frame_rate, rest) for path in logs]
    name = _sensor_name(sensor, presses[0].sensor) if store else ""
    with shown_progress("learning the gel"):
        found = calibrated(presses, forces, young_modulus, poisson_ratio, thickness, marker_depth, noise, uneven)
    calibration = found.to_json()
    if output is not None:
        write_whole(output, lambda beside: beside.write_text(dumps(calibration["gel"]), encoding="utf-8"))
    if store:
        deep = found.gel.thickness if found.gel.thickness <= THICKEST else None
        with connected(url, key) as client:
            client.describe_sensor(name, found.gel.young_modulus, found.gel.poisson_ratio, deep, marker_depth, uneven)
    if json:
        print_json(calibration)
    else:
        rows = [_gel_cells(each) for each in calibration["estimates"]]
        stored = f", by which {name} is described" if store else ""
        print_table(f"Gel by {len(logs)} logs{stored}", ("", "estimate", "95 % interval", "by the presses", ""), rows)


def _sensor_name(given: str | None, logged: str) -> str:
    from slipcore.frames import UNNAMED

    name = given or logged
    if name == UNNAMED:
        raise typer.BadParameter("--store for logs that name no sensor; needed: --sensor")
    return name


def _gel_cells(estimate: Mapping[str, Any]) -> tuple[str, str, str, str, str]:
    low, high = estimate["low"], estimate["high"]
    known = f"at least {number(low, 4)}" if high is None else interval((low, high), 4)
    value = "thick" if estimate["value"] is None else number(estimate["value"], 4)
    named = f"{estimate['name']} [{estimate['unit']}]"
    if low == high:
        return named, value, "", "", estimate["note"]
    return named, value, known, f"{estimate['information']:.1%}", estimate["note"]


def _learnt(logs: "list[GraspLog]", forces: list[float] | None) -> dict[str, Any]:
    """The sensor model of presses on this machine, as JSON has it."""
    from slipcore import calibrate_sensor

    return calibrate_sensor(logs, forces).to_json()


def _stored(
    logs: list[sources.Source], forces: list[float] | None, sensor: str | None, url: str, key: str | None
) -> dict[str, Any]:
    """The calibration that a service makes of these logs, as it answers."""
    with connected(url, key) as client:
        sent = (source.log() for source in logs)
        receipts = [client.upload(log, sensor=sensor, **options) for log, options in sent]
        known: Sequence[float | None] = forces or [None] * len(receipts)
        return client.calibrate_sensor(
            receipts[0].sensor, {receipt.id: force for receipt, force in zip(receipts, known, strict=True)}
        )


def _known_forces(given: list[float] | None, logs: int) -> list[float] | None:
    """One force a log."""
    if given is None or len(given) == logs:
        return given
    if len(given) == 1:
        return given * logs
    raise typer.BadParameter(f"{len(given)} known forces for {logs} logs; allowed: one, or one for each log")


def _estimate_cells(estimate: Mapping[str, Any]) -> tuple[str, str, str, str]:
    named = f"{estimate['name']} [{estimate['unit']}]"
    if estimate["not_identified"] is not None:
        return named, "not identified", "", estimate["not_identified"]
    return named, number(estimate["value"]), interval((estimate["low"], estimate["high"])), ""
