"""The demo's tables, as text cells."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np

from service.demo.inputs import DemoLog
from service.formatting import number
from service.report.page import Table
from slipcore import FrictionLaw
from stiction_client import FrictionModel, GraspLogReceipt, Job, NoFeasibleForce, RequiredForce

METHODS = ("ols", "bayes")
"""By which each material is fitted."""

COEFFICIENTS = ("β₀ [-]", "β₁ [s/m]", "β₂ [1/N]")


@dataclass(frozen=True, slots=True, eq=False)
class Upload:
    """A grasp log that was uploaded, as the service keeps it once its job has ended."""

    log: DemoLog
    receipt: GraspLogReceipt


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """What the service and the planner said of one material under one method."""

    material: str
    method: str
    job: Job
    model: FrictionModel | None
    grip: RequiredForce | NoFeasibleForce | None


def friction(answers: Iterable[Answer], truths: Mapping[str, FrictionLaw | None]) -> Table:
    """Coefficients with 95 % intervals, σ, and the truth where known; how the job ended where there is no model."""
    columns = ("material", "method", *COEFFICIENTS, "σ [-]", "true β₀")
    rows = []
    for answer in answers:
        if answer.model is None:
            outcome = [answer.job.status, *[""] * 4]
        else:
            outcome = _fitted(answer.model, truths[answer.material])
        rows.append([answer.material, answer.method, *outcome])
    caption = "Friction models: estimate ± half of the 95 % interval; † marks what the data do not determine"
    return Table(caption, columns, rows)


def grips(answers: Iterable[Answer]) -> Table:
    """The planner's answer for each model."""
    rows = [[answer.material, answer.method, *_grip(answer.grip)] for answer in answers]
    return Table("Normal force needed", ("material", "method", "normal force", "remark"), rows)


def grasps(uploads: Sequence[Upload]) -> Table:
    """Each uploaded grasp: what was detected, its outcome, and the time from upload to stored fit."""
    columns = (
        "grasp",
        "in contact",
        "least stick ratio",
        "gross slip",
        "onsets",
        "noise",
        "samples",
        "outcome",
        "work",
    )
    return Table("Grasps uploaded", columns, [_grasp(upload) for upload in uploads])


def stages(uploads: Sequence[Upload]) -> Table:
    """Median time of each stage over all uploads."""
    spent = [upload.receipt.job.seconds for upload in uploads]
    names = list(dict.fromkeys(stage for seconds in spent for stage in seconds))
    rows = [[name, _milliseconds(median(s[name] for s in spent if name in s))] for name in names]
    return Table("Time per stage (median over the uploads)", ("stage", "time"), rows)


def reasons(jobs: Iterable[tuple[str, Job]]) -> list[Table]:
    """Why jobs, each of something by name, ended as they did, in a column with room for it; no table without any."""
    rows = [(name, job.status, job.reason) for name, job in jobs if job.reason is not None]
    return [Table("Reasons", ("of what", "outcome", "reason"), rows)] if rows else []


def _fitted(model: FrictionModel, truth: FrictionLaw | None) -> list[str]:
    halves = 0.5 * np.diff(model.interval(0.95), axis=1).ravel()
    cells = [
        f"{number(value)} ± {number(half, 2)}{'' if identifiable else ' †'}"
        for value, half, identifiable in zip(model.coefficients, halves, model.identifiable, strict=True)
    ]
    return [*cells, number(model.scale), "unknown" if truth is None else f"{truth.coefficients[0]:g}"]


def _grip(grip: RequiredForce | NoFeasibleForce | None) -> list[str]:
    if isinstance(grip, RequiredForce):
        return [f"{grip.normal_force:.3g} N", grip.warning or ""]
    return ["no model", ""] if grip is None else ["none", str(grip)]


def _grasp(upload: Upload) -> list[str]:
    receipt, seen = upload.receipt, upload.receipt.detection
    detected = [""] * 6
    if seen is not None:
        detected = [
            f"{seen.contact_frames} of {receipt.frames}",
            "" if seen.stick_ratio_min is None else f"{seen.stick_ratio_min:.2f}",
            str(seen.macro_slip_frames),
            str(seen.events["onset"]),
            "" if seen.noise is None else f"{seen.noise * 1e6:.2f} µm",
            str(seen.samples),
        ]
    work = _milliseconds(sum(receipt.job.seconds.values()))
    return [upload.log.name, *detected, receipt.job.status, work]


def _milliseconds(seconds: float) -> str:
    return f"{seconds * 1e3:.1f} ms"
