"""The command on scenes of physics engines."""

import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.options import Json
from service.cli.output import print_json, print_table, printable
from service.formatting import number

if TYPE_CHECKING:
    from stiction_client.mujoco_scene import PairCheck, SceneCheck

COLUMNS = ("geoms", "written μ", "by", "holds μ", "at 95 % it", "pressed with", "bears now", "creeps now")

LEAST_SHOWN = 1e-6
"""N, or mm/s, below which a table of a scene shows 0."""


def check_scene(
    model: Annotated[Path, typer.Argument(help="A MuJoCo scene (MJCF) in which something is gripped.")],
    keyframe: Annotated[str | None, typer.Option(help="Begin at this keyframe, with its controls.")] = None,
    seconds: Annotated[float, typer.Option(help="Simulate so long before the contacts are looked at, s.")] = 1.0,
    friction: Annotated[float | None, typer.Option(help="What it is to be, such as `stiction lookup` answers.")] = None,
    json: Json = False,
) -> None:
    """Measure in MuJoCo at which load each contact of a scene really slips, and say which settings to change."""
    check = _checked(model, keyframe, seconds, friction)
    if json:
        print_json({"scene": model.name, **asdict(check)})
        return
    count = len(check.pairs)
    touch = "1 pair of geoms touches" if count == 1 else f"{count} pairs of geoms touch"
    title = f"{model.name} after {check.seconds:g} s: {touch}"
    print_table(title, COLUMNS, [_row(pair) for pair in check.pairs])
    for pair in check.pairs:
        typer.echo(printable(f"{_named(pair)}: {pair.explanation}"))
        for line in pair.advice:
            typer.echo(printable(f"  {line}"))
    for reason in check.left_out:
        typer.echo(printable(f"not measured: {reason}"))


def _checked(model: Path, keyframe: str | None, seconds: float, friction: float | None) -> "SceneCheck":
    from stiction_client.errors import InvalidArgument

    try:
        from stiction_client import mujoco_scene
    except ModuleNotFoundError as error:
        raise InvalidArgument("mujoco", "not installed", "mujoco-core, by the extra stiction-client[mujoco]") from error
    return mujoco_scene.check_scene(model, keyframe=keyframe, seconds=seconds, friction=friction)


def _row(pair: "PairCheck") -> list[str]:
    from stiction_client.mujoco_scene.advice import speed

    holds = number(pair.held.friction) if math.isfinite(pair.held.friction) else "all that was tried"
    forces = [f"{_noiseless(force)} N" for force in (pair.normal_force, pair.tangential_force)]
    now = f"{_noiseless(1e3 * pair.speed)} mm/s"
    return [_named(pair), number(pair.friction), pair.rule, holds, speed(pair.held), *forces, now]


def _noiseless(value: float) -> str:
    """A force, N, or speed, mm/s, without the digits that a solver's rounding leaves of nothing."""
    return number(value if abs(value) >= LEAST_SHOWN else 0.0)


def _named(pair: "PairCheck") -> str:
    return " – ".join(pair.geoms)
