"""The report of one grasp: what was seen, what that says of friction, and what to do next."""

from collections.abc import Sequence
from dataclasses import dataclass

from db.records import ContactFriction, Detection
from estimators import FrictionModel, WorkingPoint, next_grasp
from service.formatting import NOTHING, interval, number
from service.report import wording
from service.report.page import Fact, Picture, Report, Section, Table
from service.report.pictures import SlipOverTime, draw_slip, friction_sections, marginals
from slipcore.finding import severity_of
from slipcore.samples import FrictionSamples

MAP = (
    "Maps of the contact at eight moments: blue elements stick, orange ones slip, grey ones do not touch. Below, the "
    "stick ratio over time; thin lines are the moments of the maps."
)


@dataclass(frozen=True, slots=True, eq=False)
class InspectedGrasp:
    """A grasp log with what was found in it: ``grasp_facts`` of it, the ``detection``, its ``samples`` of friction, the
    ``model`` that these alone allow, and where there is none, why (``refusal``); ``slip``: None where no map was kept.
    """

    name: str
    grasp_facts: Sequence[Fact]
    detection: Detection
    slip: SlipOverTime | None
    samples: FrictionSamples
    model: FrictionModel | None
    refusal: str | None


def grasp_facts(sensor: str, frames: int, duration: float, grid: tuple[int, int]) -> list[Fact]:
    """What a log holds."""
    held = f"{frames} in {number(duration)} s, of {grid[0]} × {grid[1]} elements"
    return [Fact("Sensor", sensor or NOTHING), Fact("Frames", held)]


def grasp_report(seen: InspectedGrasp) -> Report:
    """The report of a grasp."""
    model = seen.model
    facts, support = ([], None) if model is None else wording.friction_facts(model)
    if support is None:
        lead = f"This grasp alone gives no friction: {seen.refusal}."
    else:
        lead = f"Friction, from this grasp alone, is {support.kind}: {support.advice}."
    return Report(seen.name, lead, [*facts, *_seen_facts(seen)], _steps(seen), _sections(seen))


def _steps(seen: InspectedGrasp) -> list[str]:
    """What to do next: first what was found against the log, which more grasps of the kind do not mend."""
    found = seen.detection.findings or ()
    steps = [f"{finding.name}: {finding.remedy}." for finding in found]
    if seen.model is None:
        return [*steps, "Record another grasp of the same material, or load this one further, until parts of it slip."]
    if any(severity_of(finding.name) == "warning" for finding in found):
        return [*steps, "Record the grasp again once that is mended."]
    probe = next_grasp(seen.model, WorkingPoint(0.5 * sum(seen.model.domain.normal_force)), grasps=1)
    return [*steps, wording.record_next(probe), "Upload it with others of its material, and ask how hard to grip that."]


def _seen_facts(seen: InspectedGrasp) -> list[Fact]:
    found = seen.detection
    facts = [
        Fact("Friction samples", str(len(seen.samples))),
        Fact("Least stick ratio", number(found.stick_ratio_min)),
        Fact("Frames of gross slip", f"{found.macro_slip_frames} of {found.contact_frames} in contact"),
        Fact("Findings against it", str(len(found.findings or ()))),
    ]
    return [*facts, *seen.grasp_facts]


def _sections(seen: InspectedGrasp) -> list[Section]:
    sections = []
    if seen.slip is not None:
        picture = Picture(MAP, draw_slip(seen.slip))
        sections.append(Section("Slip over time", wording.STICK_RATIO, pictures=[picture]))
    if seen.detection.findings:
        rows = [[each.name, each.evidence, each.remedy] for each in seen.detection.findings]
        doubts = Table("Findings", ("finding", "evidence", "what to do"), rows)
        heading = wording.findings_heading([each.name for each in seen.detection.findings])
        sections.append(Section(heading, tables=[doubts]))
    if seen.model is not None:
        sections.append(_model_section(seen.samples, seen.model))
    return [*sections, _detection_section(seen.detection)]


def _model_section(samples: FrictionSamples, model: FrictionModel) -> Section:
    plane = Picture(
        "A dot: friction at a slipping element. Line: fitted. Band: where 90 % of new observations are expected.",
        friction_sections(model, samples),
    )
    spread = Picture("How probable each value of each coefficient is. Dotted: its 95 % interval.", marginals(model))
    table = wording.coefficient_table({model.method: model})
    return Section("Friction model", wording.MODEL, [table], [plane, spread], folded=True)


def _detection_section(found: Detection) -> Section:
    noise = NOTHING if found.noise is None else f"{number(1e6 * found.noise)} µm"
    rows = [
        ["detector", found.method],
        ["onsets of slip", str(found.onsets)],
        ["ends of slip", str(found.ends)],
        ["noise of a marker", noise],
        ["friction of the whole contact", _contact(found.contact_friction)],
    ]
    return Section("What was detected", tables=[Table("Detection", ("what", "value"), rows)], folded=True)


def _contact(found: ContactFriction | None) -> str:
    if found is None:
        return NOTHING
    if found.is_bound:
        return f"at least {number(found.low)}: {found.reason}"
    return f"{number(found.coefficient)} ({interval((found.low, found.high))}): {found.reason}"
