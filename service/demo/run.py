"""Run the demo: inputs → server → uploads → fits → planner's question → tables, pictures, report."""

import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from service.demo import tables
from service.demo.drawing import detect_all, draw_grasps, draw_models
from service.demo.inputs import DemoLog, recorded_logs, simulated_logs
from service.demo.server import starting_server
from service.demo.tables import METHODS, Answer, Upload
from service.report import wording
from service.report.page import Report, Section, write_report
from stiction_client import (
    FrictionClient,
    FrictionModel,
    NoFeasibleForce,
    RequiredForce,
    required_normal_force,
)

TANGENTIAL_LOAD = 1.5
"""N; about the weight of a 150 g object on one of two fingers, doubled for a brisk lift."""

SLIP_PROBABILITY = 1e-3

CONTACT_AREA = 6e-5
"""m²; a fingertip of 15 mm radius and 1 MPa pressed with about 10 N."""


STEPS = (
    "See the same in a browser: stiction serve, then stiction open; its first page loads simulated grasps.",
    "Go the whole way with a sensor of yours: docs/tutorial.md takes 15 minutes.",
)

Show = Callable[[str, Sequence[str], Sequence[Sequence[object]]], None]
"""Prints a table: its caption, columns and rows."""


def run_demo(output: Path, recordings: Path | None, seed: int, show: Show) -> None:
    """Run the main job; shows its tables and leaves ``report.html`` with its pictures in ``output``."""
    console = Console()
    output.mkdir(parents=True, exist_ok=True)
    shutil.rmtree(output / "service", ignore_errors=True)  # the demo's own folder: each run starts a fresh database
    with starting_server(output / "service", console.print) as address:
        logs = _inputs(output, recordings, seed, console)
        with _progress(console) as progress, FrictionClient(address()) as client:
            uploads = _upload(client, logs, progress)
            answers = _ask(client, list(dict.fromkeys(log.material for log in logs)), seed, progress)
            sections = _sections(uploads, answers, progress)
    for section in sections:
        for table in section.tables:
            show(table.caption, table.columns, table.rows)
    report = Report("Stiction: from tactile recordings to a planner's answer", _lead(logs), (), STEPS, sections)
    console.print(f"Report: {write_report(report, output / 'report.html')}")


def _inputs(output: Path, recordings: Path | None, seed: int, console: Console) -> list[DemoLog]:
    recorded = list(recorded_logs(recordings))
    if not recorded:
        where = "no folder was given" if recordings is None else f"none below {recordings}"
        console.print(f"Real Tac3D recordings are left out ({where}); going on with simulated grasps.")
    return [*simulated_logs(output / "logs", seed), *recorded]


def _upload(client: FrictionClient, logs: Sequence[DemoLog], progress: Progress) -> list[Upload]:
    uploads = []
    for entry in progress.track(logs, description="upload, detect, fit"):
        client.ensure_material(entry.material)
        receipt = client.upload(entry.path, material=entry.material)
        client.wait(receipt)
        uploads.append(Upload(entry, client.grasp_log(receipt.id)))
    return uploads


def _ask(client: FrictionClient, materials: Sequence[str], seed: int, progress: Progress) -> list[Answer]:
    """Fit each material by each method on the server, then ask the planner's question of the model."""
    questions = [(material, method) for material in materials for method in METHODS]
    answers = []
    for material, method in progress.track(questions, description="fit each material, plan its grip"):
        job = client.wait(client.fit(material, method=method, seed=seed))
        model = client.model(material, method=method) if job.status == "done" else None
        answers.append(Answer(material, method, job, model, None if model is None else _grip(model)))
    return answers


def _grip(model: FrictionModel) -> RequiredForce | NoFeasibleForce:
    try:
        return required_normal_force(
            model, TANGENTIAL_LOAD, slip_probability=SLIP_PROBABILITY, contact_area=CONTACT_AREA
        )
    except NoFeasibleForce as refusal:
        return refusal


def _sections(
    uploads: Sequence[Upload],
    answers: Sequence[Answer],
    progress: Progress,
) -> list[Section]:
    logs = [upload.log for upload in uploads]
    seen = detect_all(logs, progress)
    return [
        Section(
            "Friction of each material",
            f"{wording.MODEL} Simulated grasps follow Coulomb's law, so β₁ and β₂ are truly 0; of the real recordings "
            "no truth is known.",
            [
                tables.friction(answers, {log.material: log.truth for log in logs}),
                *tables.reasons((f"{answer.material} by {answer.method}", answer.job) for answer in answers),
            ],
        ),
        Section(
            "The planner's answer",
            f"The smallest normal force that holds {TANGENTIAL_LOAD:g} N with a probability of slip of at most "
            f"{SLIP_PROBABILITY:g}, over a contact of {CONTACT_AREA * 1e6:g} mm², scatter and uncertainty included.",
            [tables.grips(answers)],
        ),
        Section(
            "The grasps",
            f"What the detector said of each grasp. {wording.STICK_RATIO} The real recordings carry no labels.",
            [
                tables.grasps(uploads),
                *tables.reasons((upload.log.name, upload.receipt.job) for upload in uploads),
                tables.stages(uploads),
            ],
            draw_grasps(seen),
            folded=True,
        ),
        Section("The models", "As fitted by the service.", pictures=draw_models(answers, seen), folded=True),
    ]


def _lead(logs: Sequence[DemoLog]) -> str:
    simulated = sum(log.truth is not None for log in logs)
    return (
        f"{len(logs)} grasps ({simulated} simulated with known friction, {len(logs) - simulated} real recordings) "
        "went by REST into a fresh service; slip was detected, friction samples collected and models fitted there."
    )


def _progress(console: Console) -> Progress:
    return Progress(
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), console=console
    )
