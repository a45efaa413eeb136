"""Commands of the open slip benchmark: make sealed scenes, run detectors on them, score what these said."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.exit_codes import INPUT_REFUSED
from service.cli.options import Json, drawn_path
from service.cli.output import plain, print_json, print_table, printable
from service.cli.progress import counted, resumable, shown_progress
from service.whole_files import check_place

if TYPE_CHECKING:
    from service.slip_benchmark.running import PredictionRun
    from service.slip_benchmark.scoring import Scores

app = typer.Typer(help="The open slip benchmark, of simulated grasps (docs/slip-benchmark.md).", no_args_is_help=True)

Folder = Annotated[Path, typer.Argument(help="A folder that `stiction benchmark make` made.")]
Processes = Annotated[
    int | None, typer.Option(min=1, help="Processes of this machine; as many as it has cores if not said.")
]
OWN_NAME = "external"
"""Of the results of a program that is given no name."""
MOST_NAMED = 20
"""Reasons that are printed; all are in the files."""


@app.command()
def make(
    phrase: Annotated[str, typer.Option(help="What scenes are drawn from: the same phrase gives the same scenes.")],
    output: Annotated[Path, typer.Option("--output", "--out", help="Folder; scenes that it holds are kept.")],
    scenes: Annotated[int, typer.Option(min=1, max=9999, help="How many; each kind has each fault once in 40.")] = 100,
    kind: Annotated[list[str] | None, typer.Option(help="Only this kind of sensor; may be given again.")] = None,
    processes: Processes = None,
    json: Json = False,
) -> None:
    """Make sealed scenes: what a sensor measures of simulated grasps, and apart from that the truth."""
    from service.jobs.campaign import workers
    from service.slip_benchmark.kinds import kinds_named
    from service.slip_benchmark.making import make as make_scenes
    from service.slip_benchmark.making import scenes_in

    kinds = kinds_named(kind or ())
    with workers(processes or _cores()) as executor:
        entries = make_scenes(executor, phrase, scenes, kinds, output)
        made = resumable(entries, scenes_in(output, scenes), "scenes", output)
    if json:
        print_json({"folder": str(output), "scenes": len(made), "kinds": [each.name for each in kinds]})
    else:
        typer.echo(printable(f"{output}: {len(made)} scenes of {', '.join(each.name for each in kinds)}"))


@app.command()
def run(
    folder: Folder,
    detector: Annotated[
        list[str] | None, typer.Option(help="A detector of docs/detector.md; may be given again. All where none is.")
    ] = None,
    external: Annotated[
        str | None, typer.Option(help="A program of your own: it is given the paths of an input and of its prediction.")
    ] = None,
    name: Annotated[str, typer.Option(help="What its results are called.")] = OWN_NAME,
    limit: Annotated[float, typer.Option(min=0.1, help="Time that the program has for a scene, s.")] = 60.0,
    processes: Processes = None,
    json: Json = False,
) -> None:
    """Run detectors on the inputs; none of them is given the truth."""
    from dataclasses import asdict

    from service.jobs.campaign import workers
    from service.slip_benchmark.folder import read_whole_benchmark
    from service.slip_benchmark.running import Program
    from service.slip_benchmark.running import run as run_methods
    from slipcore.defaults import METHOD_NAMES
    from slipcore.errors import InvalidInput

    if external is None and name != OWN_NAME:
        raise InvalidInput("name", name, "none without --external, the program whose results are called so")
    count = len(read_whole_benchmark(folder).scenes)
    detectors = detector or ([] if external else list(METHOD_NAMES))
    program = Program(name, external, limit) if external else None
    total = count * (len(set(detectors)) + (program is not None))
    with workers(processes or _cores()) as executor:
        ran = list(counted(run_methods(executor, folder, detectors, program), total, "predictions"))
    if json:
        print_json({"predictions": [asdict(each) for each in ran]})
    else:
        _print_run(ran, count)
    if program is not None and any(each.refused for each in ran if each.method == program.name):
        raise typer.Exit(INPUT_REFUSED)


def _print_run(ran: "list[PredictionRun]", count: int) -> None:
    methods = dict.fromkeys(each.method for each in ran)
    own = {method: [each for each in ran if each.method == method] for method in methods}
    rows = [
        (
            method,
            f"{sum(not each.refused for each in own[method])} of {count}",
            f"{sum(e.seconds for e in own[method]):.1f}",
        )
        for method in methods
    ]
    print_table("Predictions", ("method", "scenes", "seconds"), rows)
    scenes: dict[tuple[str, str], list[str]] = {}
    for each in sorted(ran, key=lambda each: each.scene):
        if each.refused:
            scenes.setdefault((each.method, each.refused), []).append(each.scene)
    for (method, refused), names in list(scenes.items())[:MOST_NAMED]:
        typer.echo(printable(f"{method}, {_named(names)}: {refused}"))


def _named(scenes: list[str]) -> str:
    """The first of some scenes, and how many there are besides."""
    return f"scene {scenes[0]}" + (f" and {len(scenes) - 1} more" if len(scenes) > 1 else "")


@app.command()
def score(
    folder: Folder,
    picture: Annotated[
        Path | None, typer.Option(callback=drawn_path, help="Write the picture of F1 to this PNG or SVG, too.")
    ] = None,
    json: Json = False,
) -> None:
    """Score all results: a table here, FOLDER/score.json, and FOLDER/score.html with a picture."""
    from service.report.page import write_report
    from service.slip_benchmark.folder import write_json
    from service.slip_benchmark.page import draw, page
    from service.slip_benchmark.scoring import PAGE, SCORE
    from service.slip_benchmark.scoring import score as score_folder

    if picture is not None:
        check_place(picture)
    with shown_progress(f"scoring {folder}") as tell:
        scores = score_folder(folder, tell)
    record = plain(scores.as_json())
    write_json(folder / SCORE, record)
    write_report(page(scores), folder / PAGE)
    if picture is not None:
        from service.report.pictures import save

        save(draw(scores), picture)
    if json:
        print_json(record)
    else:
        _print_scores(scores, folder / PAGE)
    for wrong in scores.wrong[:MOST_NAMED]:
        typer.echo(f"stiction: {printable(str(wrong.wrong))}", err=True)
    if scores.wrong:
        raise typer.Exit(INPUT_REFUSED)


def _print_scores(scores: "Scores", page: Path) -> None:
    from service.slip_benchmark.page import COLUMNS, SIMULATION, f1_by_kind, overall

    print_table(f"{len(scores.manifest.scenes)} simulated scenes", COLUMNS, overall(scores))
    print_table("F1 by kind of sensor", ("method", *scores.kinds), f1_by_kind(scores))
    typer.echo(SIMULATION)
    typer.echo(str(page))


def _cores() -> int:
    return os.cpu_count() or 1
