"""Gather what the report of a grasp says, and draw it up: of a file, or of a stored log with its results."""

from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from db.records import StoredGraspLog
from estimators import EstimatorError, FrictionModel, fit
from service import formats
from service.domain.logs.collect_friction import collect
from service.domain.logs.doubtful_logs import with_doubts, with_reconstructed
from service.domain.models.stored_results import StoredHistory, decode_history, decode_samples, summarise_history
from service.domain.sensors.reconstruct import reconstruction_findings
from service.report.grasp import InspectedGrasp, grasp_facts, grasp_report
from service.report.page import Fact, Report
from service.report.pictures import SlipOverTime, detected
from slipcore import LOOKAHEAD, FrictionSamples, GraspLog, check_log, detect_slip
from slipcore.method_choice import recommended_method

if TYPE_CHECKING:
    from slipcore.forces import Reconstruction

METHOD = "auto"
"""By which a grasp alone is fitted."""


def report_of_log(
    log: GraspLog, name: str, method: str | None = None, reconstruction: "Reconstruction | None" = None
) -> Report:
    """The report of a log, as a service would see it; ``method``: of detection, the best one where None is named;
    ``reconstruction`` of its forces, where they are not its sensor's.

    Raises what ``detect_slip`` raises.
    """
    return grasp_report(inspect_grasp(log, name, method, reconstruction))


def inspect_grasp(
    log: GraspLog, name: str, method: str | None = None, reconstruction: "Reconstruction | None" = None
) -> InspectedGrasp:
    """What is found in a log."""
    begin = perf_counter()
    history = detect_slip(log, method=method or recommended_method(log), lookahead=LOOKAHEAD)
    seconds = perf_counter() - begin
    found, none_because = collect(log, history, reconstruction)
    findings = [*reconstruction_findings(log, reconstruction), *check_log(log, history, found.elements)]
    detection = summarise_history(history, seconds, "", findings, found.contact, is_scaled=log.is_scaled)
    facts = grasp_facts(log.sensor, len(log), float(log.time[-1] - log.time[0]), log.grid)
    model, refusal = _fitted(found.samples, [finding.name for finding in findings], none_because)
    return InspectedGrasp(name, facts, detection, detected(log, history), found.samples, model, refusal)


def report_of_stored(log: StoredGraspLog, history: Path, samples: Path, upload: Path | None) -> Report:
    """The report of a stored log with these results; ``upload`` is the log itself, None where it was deleted."""
    assert log.detection is not None
    assert log.samples is not None
    facts = Fact("Material", log.material or "none"), *grasp_facts(log.sensor, log.frames, log.duration, log.grid)
    slip = _stored_slip(decode_history(history), upload, log.detection.method)
    name = f"Grasp log of {log.created_at:%Y-%m-%d %H:%M:%S} UTC"
    found, names = decode_samples(samples), [finding.name for finding in log.detection.findings or ()]
    model, refusal = _fitted(found, names, log.samples.none_because)
    return grasp_report(InspectedGrasp(name, facts, log.detection, slip, found, model, refusal))


def _fitted(
    samples: FrictionSamples, findings: list[str], none_because: str | None
) -> tuple[FrictionModel | None, str | None]:
    """The model that samples of one grasp allow, or why there is none."""
    if none_because is not None:
        return None, none_because
    try:
        return with_reconstructed(with_doubts(fit([samples], method=METHOD), [findings]), [findings]), None
    except EstimatorError as error:
        return None, str(error)


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
