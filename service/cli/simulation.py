"""The commands that simulate grasps."""

import os
from collections.abc import Iterable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli.exit_codes import INPUT_REFUSED, INTERRUPTED
from service.cli.inputs import refuse_inputs
from service.cli.options import Json, Picture
from service.cli.output import print_json, print_lines, print_table
from service.cli.progress import resumable, shown_progress
from service.formatting import number
from service.whole_files import check_place, write_whole

if TYPE_CHECKING:
    from service.jobs.campaign import Outcome, RequestedAccuracy
    from slipcore import GraspLog
    from slipcore.contact import Scene

Accuracy = Annotated[
    float | None, typer.Option(help="Largest error of stick ratio (absolute), displacement and force (relative).")
]
Seconds = Annotated[float | None, typer.Option(help="Time to spend on a log, s.")]
Tier = Annotated[
    str | None, typer.Option(help='"closed form", "beams" or "boundary elements", in place of the cheapest.')
]


def simulate(
    scene: Annotated[str, typer.Argument(help="A scene file (TOML), or the name of a scene of the library.")],
    explain: Annotated[
        bool, typer.Option("--explain", help="Say what each effect costs and changes, in place of simulating.")
    ] = False,
    yes: Annotated[
        bool, typer.Option("--yes", help="Explain a scene in however many coarse runs it takes, not in five at most.")
    ] = False,
    accuracy: Accuracy = None,
    seconds: Seconds = None,
    tier: Tier = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of random fields and of noise.")] = 0,
    output: Annotated[Path | None, typer.Option(help="Write the grasp log with its truth to this NPZ.")] = None,
    picture: Picture = None,
    json: Json = False,
) -> None:
    """Simulate a grasp whose slip, forces and friction are known."""
    from slipcore.contact import Scene

    wanted = Scene.from_toml(scene)
    if explain:
        _tell_left_out(output=output, picture=picture, accuracy=accuracy, seconds=seconds, tier=tier)
    if output is not None:
        refuse_inputs(output, Path(scene))
        _check_output(output)
    if explain:
        _explain(wanted, seed, json, all_runs=yes)
        return
    for path in (output, picture):
        if path is not None:
            check_place(path)
    from service.jobs.campaign import RequestedAccuracy

    log, ended = _simulated(wanted, RequestedAccuracy(accuracy, seconds, tier), seed)
    if output is not None:
        from stiction_client import container

        write_whole(output, partial(container.write, log))
    if picture is not None:
        from service.report.pictures import save, truth_over_time

        save(truth_over_time(log, wanted.name), picture)
    _print(log, wanted.name, json)
    if ended:
        raise typer.Exit(INTERRUPTED)


def _tell_left_out(**options: object) -> None:
    """Warn of options that an explanation leaves out."""
    given = [f"--{name}" for name, value in options.items() if value is not None]
    if given:
        left = "is left out, and refused" if len(given) == 1 else "are left out, and refused"
        typer.echo(f"--explain makes coarse runs and no log: {', '.join(given)} {left} by the next version", err=True)


def _check_output(path: Path) -> None:
    """Raises ``InvalidInput`` for a folder, before anything is simulated, and warns of a name that tells of no NPZ."""
    from slipcore import InvalidInput

    if path.is_dir():
        raise InvalidInput("output", f"{path}, a folder", "a file that ends in .npz")
    if path.suffix.lower() != ".npz":
        typer.echo(f"{path} becomes an NPZ all the same; the next version refuses names without .npz", err=True)


def _simulated(scene: "Scene", asked: "RequestedAccuracy", seed: int) -> "tuple[GraspLog, bool]":
    """The log, and whether Ctrl-C ended it: it is then the best until then."""
    from slipcore.contact import simulate as simulate_scene
    from slipcore.contact.errors import Interrupted

    with shown_progress(f"simulating {scene.name}") as tell:
        try:
            return simulate_scene(scene, seed=seed, progress=tell, **asdict(asked)), False
        except Interrupted as stopped:
            return stopped.log, True


def campaign(
    scenes: Annotated[list[str], typer.Argument(help="Scene files (TOML), or names of scenes of the library.")],
    output: Annotated[Path, typer.Option(help="Folder of the logs; those that it holds already are not made again.")],
    seeds: Annotated[int, typer.Option(min=1, help="Logs of each scene, with seeds from 0 on.")] = 1,
    accuracy: Accuracy = None,
    seconds: Seconds = None,
    tier: Tier = None,
    processes: Annotated[
        int | None, typer.Option(min=1, help="Processes of this machine; as many as it has cores if not said.")
    ] = None,
    dask_address: Annotated[
        str | None,
        typer.Option(envvar="STICTION_DASK_ADDRESS", help="A Dask scheduler, whose workers do it in their place."),
    ] = None,
    written_as: Annotated[
        str, typer.Option("--format", help='"npz", or "parquet" for one data set in folders by scene and seed.')
    ] = "npz",
    json: Json = False,
) -> None:
    """Simulate many grasps, each scene with many seeds, on all cores or on a Dask cluster."""
    from service.jobs.campaign import RequestedAccuracy, run, workers
    from slipcore.contact import Scene

    wanted = [Scene.from_toml(scene) for scene in scenes]
    asked = RequestedAccuracy(accuracy, seconds, tier)
    with workers(processes or os.cpu_count() or 1, dask_address) as executor:
        outcomes = run(executor, wanted, range(seeds), output, asked, written_as)
        made = resumable(outcomes, len(wanted) * seeds, "logs", output)
    _print_campaign(made, output, json)
    if any(outcome.refused for outcome in made):
        raise typer.Exit(INPUT_REFUSED)


def _print_campaign(made: "Iterable[Outcome]", folder: Path, json: bool) -> None:
    rows = sorted(made, key=lambda outcome: (outcome.scene, outcome.seed))
    if json:
        print_json({"logs": [asdict(outcome) | {"path": str(outcome.path)} for outcome in rows]})
    else:
        cells = [
            (outcome.scene, outcome.seed, outcome.refused or str(outcome.path.relative_to(folder))) for outcome in rows
        ]
        print_table(str(folder), ("scene", "seed", "log"), cells)


def _explain(scene: "Scene", seed: int, json: bool, *, all_runs: bool) -> None:
    with shown_progress(f"explaining {scene.name}") as tell:
        explanation = scene.explain(seed, tell, all_runs=all_runs)
    if json:
        print_json(asdict(explanation))
    else:
        typer.echo(str(explanation))


def _print(log: "GraspLog", name: str, json: bool) -> None:
    summary = _summary(log)
    if json:
        assert log.truth is not None  # a simulated log has truth
        print_json(summary | {"time": log.time, "stick_ratio": log.truth.stick_ratio})
    else:
        print_lines(name, _lines(log, summary))


def _lines(log: "GraspLog", summary: dict[str, Any]) -> list[tuple[str, str | None]]:
    """What was simulated, then how: the metadata, which the tiers write for people."""
    how = {name: text for name, text in log.metadata.items() if name not in ("scene", "seconds")}
    zeroth, first, second = summary["friction"]
    return [
        ("frames", f"{summary['frames']} of {summary['points']} points in {number(summary['duration_s'])} s"),
        ("normal force", f"{number(summary['largest normal force_N'])} N at its largest"),
        ("stick ratio", f"{number(summary['smallest stick ratio'])} at its smallest"),
        ("friction", f"β₀ {number(zeroth)}, β₁ {number(first)} s/m, β₂ {number(second)} 1/N"),
        *how.items(),
        ("computed in", f"{number(float(log.metadata['seconds']))} s" if "seconds" in log.metadata else None),
    ]


def _summary(log: "GraspLog") -> dict[str, Any]:
    import numpy as np

    assert log.truth is not None
    assert log.force is not None  # a simulated log has both
    ratio, normal = log.truth.stick_ratio, -log.force[..., 2].sum(axis=(1, 2))
    touched = ~np.isnan(ratio)
    return {
        **log.metadata,
        "frames": len(log),
        "points": f"{log.grid[0]} x {log.grid[1]}",
        "duration_s": round(float(log.time[-1] - log.time[0]), 6),
        "largest normal force_N": round(float(normal.max()), 6),
        "smallest stick ratio": round(float(ratio[touched].min()), 6) if touched.any() else None,
        "friction": list(log.truth.friction.coefficients),
    }
