"""Frames → forces where they are missing → slip_state → samples of one log."""

from dataclasses import asdict, replace
from typing import TYPE_CHECKING

import slipcore
from db.blobs import disk_errors_named
from db.records import Detection, Gel, SampleSummary
from db.repositories import detections, grasp_logs, jobs, materials_of_logs, sensors
from service import formats
from service.domain.logs.collect_friction import collect
from service.domain.logs.same_grasp import MOST_LOGS, find_alike, fingerprint, same_grasp, signature
from service.domain.models.stored_results import (
    encode_history,
    encode_samples,
    stored_findings,
    summarise_history,
    summarise_samples,
)
from service.domain.sensors.calibrate import corrected, correction_findings
from service.domain.sensors.reconstruct import (
    bytes_needed,
    described_by_another,
    needs_forces,
    reconstruction_findings,
    with_forces,
)
from service.jobs.run import Run
from service.processes import limits
from slipcore import GraspLog

if TYPE_CHECKING:
    from slipcore.forces import Reconstruction


FITTED_AT_INGEST = ("hierarchical", "ols")
"""What the methods of an ingest store their models as."""


def find_samples(run: Run, log_id: str) -> SampleSummary:
    """Frames → forces where they are missing → slip_state → samples → moments of one log."""
    with run.database.read() as session:
        stored = grasp_logs.get(session, log_id)
    if stored.samples is not None:
        return stored.samples
    with run.stage("frames"), disk_errors_named():
        log = formats.read(run.blobs.path(stored.sha256))
        if log.sensor != stored.sensor:  # it was named beside the file
            log = replace(log, sensor=stored.sensor)
        own, content = fingerprint(log), signature(log)
    with run.database.read() as session:
        correction = corrected(session, log, stored.sensor, stored.calibration, stored.detector)
        sensor = sensors.get(session, stored.sensor)
    log, reconstruction = _with_forces(run, correction.log, sensor.gel)
    with run.stage("slip_state"):
        history = slipcore.detect_slip(
            log, method=stored.detector, lookahead=slipcore.LOOKAHEAD, sensor_model=None, **correction.options
        )
    with run.stage("samples"):
        found, none_because = collect(log, history, reconstruction)
        samples, findings = found.samples, slipcore.check_log(log, history, found.elements)
        findings = [
            *correction_findings(correction, stored.uploaded_by),
            *([] if reconstruction is None else described_by_another(sensor.described_by, stored.uploaded_by)),
            *reconstruction_findings(log, reconstruction),
            *findings,
        ]
        blob = run.blobs.put(encode_history(history))
        detection = summarise_history(
            history, run.seconds["slip_state"], blob, findings, found.contact, is_scaled=log.is_scaled
        )
        detection = replace(
            detection, calibration=correction.version, corrections=correction.changed, gel=sensor.gel, fingerprint=own
        )
        summary = summarise_samples(samples, none_because, run.blobs.put(encode_samples(samples)))
    _store_found(run, log_id, detection, summary, own, content if history.contact.any() else b"")
    return summary


def _store_found(run: Run, log_id: str, detection: Detection, summary: SampleSummary, own: str, content: bytes) -> None:
    """Store what was found in a log, of this fingerprint and signature, as that of the grasp that it is of.

    It is compared while others may write, and once more with what they stored of its material meanwhile. Logs that it
    shows to be of one grasp are of one as long as it counts: parts of it that came before need not be alike.
    """
    compared, alike = set[str](), list[str]()
    while True:
        with run.timed("samples"), run.database.read() as session:
            others = [each for each in detections.known_again(session, log_id, MOST_LOGS) if each not in compared]
            alike += find_alike(content, detections.signatures(session, others))
        compared.update(others)
        with run.database.write() as session:
            materials_of_logs.hold(session, log_id)
            jobs.start_stage(session, run.claim, "samples", run.seconds)  # nobody else has stored them meanwhile
            if not compared.issuperset(detections.known_again(session, log_id, MOST_LOGS)):
                continue
            marks = dict.fromkeys([*detections.fingerprints(session, alike), own])
            copied = same_grasp(detections.others_of_grasp(session, log_id, marks))
            findings = (*stored_findings(copied), *(detection.findings or ()))
            found, others_marks = replace(detection, findings=findings), [each for each in marks if each != own]
            detections.add(session, log_id, found, summary, content, others_marks)
            jobs.outdate_models(session, run.job.id, besides=FITTED_AT_INGEST)
            return


def _with_forces(run: Run, log: GraspLog, gel: Gel | None) -> "tuple[GraspLog, Reconstruction | None]":
    """The log, with reconstructed forces where it has none and its sensor's gel is described."""
    if gel is None or not needs_forces(log):
        return log, None
    with run.stage("forces"):
        limits.require(bytes_needed(log))
        return with_forces(log, asdict(gel))
