"""The report of one grasp: what was seen, what that tells of friction, and what to do next."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np

from db.records import ContactFriction, Detection, StoredGraspLog
from estimators import EstimatorError, FrictionModel, WorkingPoint, fit, next_grasp
from service import formats
from service.domain.doubtful_logs import with_doubts
from service.domain.stored_results import StoredHistory, decode_history, decode_samples, summarise_history
from service.formatting import NOTHING, interval, number
from service.jobs.pipeline import collect
from service.report import wording
from service.report.page import Fact, Picture, Report, Section, Table, write_report
from service.report.pictures import SlipOverTime, detected, draw_slip, friction_sections, marginals
from slipcore import LOOKAHEAD, FrictionSamples, GraspLog, check_log, detect_slip
from slipcore.checks import AGAINST_FRICTION
from slipcore.defaults import DEFAULT_METHOD

MAP = (
    "Maps of the contact at eight moments: blue elements stick, orange ones slip, grey ones do not touch. Below, the "
    "stick ratio over time; thin lines are the moments of the maps."
)
METHOD = "auto"


@dataclass(frozen=True, slots=True, eq=False)
class SeenGrasp:
    """A grasp log with what was found in it: ``about`` it, the ``detection``, its ``samples`` of friction, and if there
    are none, ``none_because``; ``slip`` is None where no map of it was kept.
    """

    name: str
    about: Sequence[Fact]
    detection: Detection
    slip: SlipOverTime | None
    samples: FrictionSamples
    none_because: str | None


def see(log: GraspLog, name: str, method: str | None = None) -> SeenGrasp:
    """What is found in a log, as a service would find it; ``method``: of detection, the best one where None is named.

    Raises what ``detect_slip`` raises.
    """
    begin = perf_counter()
    history = detect_slip(log, method=method or DEFAULT_METHOD, lookahead=LOOKAHEAD)
    seconds = perf_counter() - begin
    found, none_because = collect(log, history, None)
    findings = check_log(log, history, found.elements)
    detection = summarise_history(history, seconds, "", findings, found.contact, is_scaled=log.is_scaled)
    said = about(log.sensor, len(log), float(log.time[-1] - log.time[0]), log.grid)
    return SeenGrasp(name, said, detection, detected(log, history), found.samples, none_because)


def write_stored(log: StoredGraspLog, history: Path, samples: Path, upload: Path | None, target: Path) -> None:
    """Write the report of a stored log with these results; ``upload`` is the log itself, None where it was deleted."""
    assert log.detection is not None
    assert log.samples is not None
    said = Fact("Material", log.material or "none"), *about(log.sensor, log.frames, log.duration, log.grid)
    slip = _stored_slip(decode_history(history), upload, log.detection.method)
    name = f"Grasp log of {log.created_at:%Y-%m-%d %H:%M:%S} UTC"
    seen = SeenGrasp(name, said, log.detection, slip, decode_samples(samples), log.samples.none_because)
    write_report(grasp_report(seen), target)


def about(sensor: str, frames: int, duration: float, grid: tuple[int, int]) -> list[Fact]:
    """What a log holds."""
    held = f"{frames} in {number(duration)} s, of {grid[0]} × {grid[1]} elements"
    return [Fact("Sensor", sensor or NOTHING), Fact("Frames", held)]


def _stored_slip(history: StoredHistory, upload: Path | None, method: str) -> SlipOverTime | None:
    """What the pictures show; without the upload places on the lattice stand for positions in m."""
    if history.contact is None or history.slip is None or not len(history.time):
        return None
    if upload is None:
        rows, columns = history.contact.shape[1:]
        position = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).astype(np.float64)
    else:
        position = formats.read(upload).position[..., :2]
    since = history.time - history.time[0]
    return SlipOverTime(since, position, history.contact, history.slip, history.stick_ratio, method)


def grasp_report(seen: SeenGrasp) -> Report:
    """The report of a grasp, with the model that its samples alone allow."""
    model, refusal = _fitted(seen)
    facts, support = ([], None) if model is None else wording.friction_facts(model)
    if model is None or support is None:
        lead = f"This grasp alone tells no friction: {refusal}."
    else:
        lead = f"Friction, as far as this grasp alone tells it, is {support.kind}: {support.advice}."
    return Report(seen.name, lead, [*facts, *_seen_facts(seen)], _steps(seen, model), _sections(seen, model))


def _steps(seen: SeenGrasp, model: FrictionModel | None) -> list[str]:
    """What to do next: first what was found against the log, which more grasps of the kind do not mend."""
    found = seen.detection.findings or ()
    steps = [f"{finding.name}: {finding.remedy}." for finding in found]
    if model is None:
        return [*steps, "Record another grasp of the same material, or load this one further, until parts of it slip."]
    if AGAINST_FRICTION.intersection(finding.name for finding in found):
        return [*steps, "Record the grasp again once that is mended."]
    told = next_grasp(model, WorkingPoint(0.5 * sum(model.domain.normal_force)), grasps=1)
    return [*steps, wording.record_next(told), "Upload it with others of its material, and ask how hard to grip that."]


def _fitted(seen: SeenGrasp) -> tuple[FrictionModel | None, str | None]:
    """The model, or why there is none."""
    if seen.none_because is not None:
        return None, seen.none_because
    names = [finding.name for finding in seen.detection.findings or ()]
    try:
        return with_doubts(fit([seen.samples], method=METHOD), [names]), None
    except EstimatorError as error:
        return None, str(error)


def _seen_facts(seen: SeenGrasp) -> list[Fact]:
    found = seen.detection
    facts = [
        Fact("Friction samples", str(len(seen.samples))),
        Fact("Least stick ratio", number(found.stick_ratio_min)),
        Fact("Frames of gross slip", f"{found.macro_slip_frames} of {found.contact_frames} in contact"),
        Fact("Findings against it", str(len(found.findings or ()))),
    ]
    return [*facts, *seen.about]


def _sections(seen: SeenGrasp, model: FrictionModel | None) -> list[Section]:
    sections = []
    if seen.slip is not None:
        picture = Picture(MAP, draw_slip(seen.slip))
        sections.append(Section("Slip over time", wording.STICK_RATIO, pictures=[picture]))
    if seen.detection.findings:
        rows = [[each.name, each.evidence, each.remedy] for each in seen.detection.findings]
        doubts = Table("Findings", ("finding", "evidence", "what to do"), rows)
        sections.append(Section("What makes its friction doubtful", tables=[doubts]))
    if model is not None:
        sections.append(_model_section(seen, model))
    return [*sections, _detection_section(seen.detection)]


def _model_section(seen: SeenGrasp, model: FrictionModel) -> Section:
    plane = Picture(
        "A dot: friction at a slipping element. Line: fitted. Band: where 90 % of new observations are expected.",
        friction_sections(model, seen.samples),
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
