"""The report of a material: its friction, what that rests on, the grasps behind it, and what to do next."""

from collections.abc import Sequence
from pathlib import Path

from service.formatting import number
from service.report import wording
from service.report.page import Fact, Picture, Report, Section, Table, write_report
from service.report.pictures import friction_sections, marginals
from stiction_client.model import FrictionModel
from stiction_client.records import GraspLogReceipt, Material
from stiction_client.support import disagreement


def write_material(
    material: Material, logs: Sequence[GraspLogReceipt], probe: wording.Probe | None, target: Path
) -> None:
    """Write the report of a material."""
    write_report(material_report(material, logs, probe), target)


def material_report(material: Material, logs: Sequence[GraspLogReceipt], probe: wording.Probe | None) -> Report:
    """The report of a material with the newest of its ``logs``; ``probe``: the grasp that is worth recording next."""
    model = material.models.get(material.recommended or "")
    counted = [Fact("Grasp logs", str(material.grasp_logs))]
    if model is None:
        lead = "There is no model of its friction yet: a model needs a log with slip and forces."
        steps = ["Upload a grasp in which parts of the contact slip; each log below says what became of it."]
        return Report(material.name, lead, counted, steps, _about(material, logs))
    facts, support = wording.friction_facts(model)
    lead = f"Its friction is {support.kind}: {support.advice}."
    others = {method: other for method, other in material.models.items() if other is not model and not other.outdated}
    steps = [f"{disagreeing}."] if (disagreeing := disagreement(model.method, model, others)) else []
    steps += [] if probe is None else [wording.record_next(probe)]
    steps.append("Ask how hard to grip it: load, contact area and the probability of slip you accept give a force.")
    version = f"{model.method} version {model.version}, of {model.n} samples"
    sections = [*_model_sections(material, model), *_about(material, logs)]
    return Report(material.name, lead, [*facts, *counted, Fact("Model", version)], steps, sections)


def _model_sections(material: Material, model: FrictionModel) -> list[Section]:
    plane = Picture(
        "Line: expected friction. Band: where 90 % of new observations are expected, over the range of the data.",
        friction_sections(model),
    )
    spread = Picture("How probable each value of each coefficient is. Dotted: its 95 % interval.", marginals(model))
    best_first = {model.method: model} | dict(material.models)
    return [
        Section("Friction over normal force and velocity", pictures=[plane]),
        Section("Model", wording.MODEL, [wording.coefficient_table(best_first)], [spread], folded=True),
    ]


def _about(material: Material, logs: Sequence[GraspLogReceipt]) -> list[Section]:
    """What somebody wrote about it, and its logs with what was found against them."""
    description = [Section("Description", material.description)] if material.description else []
    columns = ("uploaded", "sensor", "frames", "duration", "state", "samples", "least stick ratio", "findings")
    table = Table(f"The newest {len(logs)} of {material.grasp_logs} logs", columns, [_row(log) for log in logs])
    return [*description, Section("Grasps", wording.STICK_RATIO, [table], folded=True)]


def _row(log: GraspLogReceipt) -> list[str]:
    seen, state = log.detection, "withdrawn" if log.withdrawal is not None else log.job.status
    found = ["", "", ""]
    if seen is not None:
        names = ", ".join(finding.name for finding in seen.findings or ())
        found = [str(seen.samples), number(seen.stick_ratio_min), names]
    return [
        log.created_at[:19].replace("T", " "),
        log.sensor,
        str(log.frames),
        f"{number(log.duration)} s",
        state,
        *found,
    ]
