"""The stages in their order: frames → strain → events → slip_state → samples → friction_model → material.

Runs in a worker process. Every step can be done again: what is stored already is not computed twice, and the last
step stores the model and closes the job in one transaction. Whatever is stored is stored under the job's claim: a
worker that was taken for dead, or whose job was cancelled, stores nothing.
"""

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from itertools import count
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

from sqlalchemy import Row
from sqlalchemy.orm import Session

import estimators
import slipcore
from db.blobs import BlobStore, disk_errors_named
from db.database import Database
from db.records import Claim, Detection, Gel, Job, NewModel, SamplesOfLog, SampleSummary
from db.repositories import audit, detections, friction_models, grasp_logs, jobs, materials_of_logs, sensors
from estimators import EstimatorError, FrictionModel, Moments, ScatterPrior
from estimators.method_names import SCATTER_METHODS
from service import formats
from service.domain.jobs.queueing import INGEST_METHODS, queue_cheap_refits
from service.domain.logs.collect_friction import collect
from service.domain.logs.doubtful_logs import (
    with_doubts,
    with_others_calibrations,
    with_others_gels,
    with_reconstructed,
    with_unchecked,
)
from service.domain.logs.same_grasp import MOST_LOGS, find_alike, fingerprint, same_grasp, signature, with_copies
from service.domain.models.other_materials import prior_from_others
from service.domain.models.stored_results import (
    decode_samples,
    encode_history,
    encode_samples,
    stored_findings,
    summarise_history,
    summarise_samples,
    to_new_model,
)
from service.domain.models.surface_change import MARK, with_change
from service.domain.models.weakening import with_weakening
from service.domain.sensors.calibrate import corrected, correction_findings
from service.domain.sensors.names import grasping
from service.domain.sensors.reconstruct import (
    bytes_needed,
    described_by_another,
    needs_forces,
    reconstruction_findings,
    with_forces,
)
from service.observability import logs, traces
from service.processes import limits
from slipcore import FrictionSamples, GraspLog, SlipcoreError

if TYPE_CHECKING:
    from slipcore.forces import Reconstruction

logger = logging.getLogger(__name__)

MOST_REPEATS = 3
"""Of a fit whose logs changed under it: nobody who writes waits for a fit, which may take minutes."""

FITTED_AT_INGEST = ("hierarchical", "ols")
"""What the methods of an ingest store their models as."""

SAMPLED_AT_INGEST = 30
"""Logs of a material up to which an ingest's fit by `auto` looks at their samples, for outliers, 3 ms a log. With more
logs it takes their moments as they are, 0.2 ms a log, until a fit is asked for."""


class InsufficientData(Exception):
    """The data do not allow what the job is for; the message says why."""


@dataclass(frozen=True, slots=True)
class Run:
    """One job under way: the stores, the claim to it, and the seconds of the stages done."""

    database: Database
    blobs: BlobStore
    claim: Claim
    job: Job
    seconds: dict[str, float] = field(default_factory=dict)
    others_tell: bool = True
    """Whether the other materials of its sensor show how much grasps of one may differ."""

    @property
    def total(self) -> float:
        """Seconds of all stages done."""
        return round(sum(self.seconds.values()), 6)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Say that the job is in this stage, and take its time; raises ``ClaimLost`` where it is not ours any more."""
        logs.note(stage=name)
        with self.database.write(durable=False) as session:
            jobs.start_stage(session, self.claim, name, self.seconds)
        with self.timed(name), traces.span(name):
            yield

    @contextmanager
    def timed(self, name: str) -> Iterator[None]:
        """Take the time of a stage."""
        begin = perf_counter()
        yield
        self.seconds[name] = self.seconds.get(name, 0.0) + perf_counter() - begin


def prepare(database: Database, claim: Claim) -> None:
    """Load the kernels that a job needs: their compiler ends the whole process where memory is at its limit."""
    with database.read() as session:
        job = jobs.get(session, claim.job_id)
        if job.grasp_log_id is not None:
            _load_kernels(grasp_logs.get(session, job.grasp_log_id).detector)


@cache
def _load_kernels(detector: str) -> None:
    slipcore.warm_up(detector)


def run_job(database: Database, blobs: BlobStore, claim: Claim, scatter_from_other_materials: bool = True) -> None:
    """Do a job to its end: done, or refused where the data do not allow it (or no chain of theirs converges).

    Raises ``ClaimLost`` once it is not this runner's any more.
    """
    with database.read() as session:
        job = jobs.get(session, claim.job_id)
    run = Run(database, blobs, claim, job, dict(job.seconds), scatter_from_other_materials)
    logs.note(kind=job.kind)
    try:
        with traces.span(job.kind, job.trace, job=job.id):
            _take_through_the_stages(run)
    except (InsufficientData, SlipcoreError, EstimatorError) as refusal:
        with database.write() as session:
            jobs.finish(session, claim, "refused", reason=str(refusal), seconds=run.seconds)
        logger.info("job refused: %s", refusal, extra=logs.of(seconds=run.total))
    else:
        logger.info("job done", extra=logs.of(seconds=run.total))


def _take_through_the_stages(run: Run) -> None:
    job = run.job
    samples = None if job.grasp_log_id is None else find_samples(run, job.grasp_log_id)
    if job.material is None:  # detection only
        with run.database.write() as session:
            jobs.finish(session, run.claim, "done", seconds=run.seconds)
        return
    if samples is not None and samples.none_because is not None:
        raise InsufficientData(samples.none_because)
    fit_material(run)


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


def fit_material(run: Run) -> None:
    """Moments or samples of all logs of a material → friction_model → material; raises ``InsufficientData``.

    Done again where its logs changed meanwhile; where they do so all the time, the models are stored as outdated.
    """
    _note_missing_moments(run)
    for tries in count():
        with run.stage("friction_model"):
            with run.database.read() as session:
                material_id = jobs.material_id(session, run.job.id)
                basis = _basis(run, session, material_id)
            models = _fit(run, basis)
        with run.database.write() as session:
            friction_models.lock(session, material_id)
            is_still = jobs.material_id(session, run.job.id) == material_id  # copies stay with one that was merged
            counting = _logs_by_now(session, material_id, basis) if is_still else []
            if counting == basis.logs or (counting and tries >= MOST_REPEATS):
                _store_models(run, session, material_id, models, basis.logs, counting)
                return


def _with_forces(run: Run, log: GraspLog, gel: Gel | None) -> "tuple[GraspLog, Reconstruction | None]":
    """The log, with reconstructed forces where it has none and its sensor's gel is described."""
    if gel is None or not needs_forces(log):
        return log, None
    with run.stage("forces"):
        limits.require(bytes_needed(log))
        return with_forces(log, asdict(gel))


class Basis(NamedTuple):
    """What a material is fitted by: its logs that count, the ``state`` by which it is known while they are the same,
    their samples, how much grasps may differ before its own show it, and its current models by method.
    """

    state: str
    logs: Sequence[Row[Any]]
    parts: list[SamplesOfLog]
    prior: ScatterPrior
    before: dict[str, NewModel]


def _basis(run: Run, session: Session, material_id: int) -> Basis:
    before = friction_models.all_current(session, [material_id]).get(material_id, [])
    return Basis(
        detections.state_of_logs(session, material_id),
        detections.logs_that_count(session, material_id),
        detections.samples_of_material(session, material_id),
        prior_from_others(session, material_id) if run.others_tell else ScatterPrior(),
        {stored.model.method: stored.model for stored in before},
    )


def _logs_by_now(session: Session, material_id: int, basis: Basis) -> Sequence[Row[Any]]:
    """Those of a material that count, of which all are read only where they are others than those of the basis."""
    is_same = detections.state_of_logs(session, material_id) == basis.state
    return basis.logs if is_same else detections.logs_that_count(session, material_id)


def _fit(run: Run, basis: Basis) -> list[FrictionModel]:
    """The models of the job's methods."""
    parts, prior, before = basis.parts, basis.prior, basis.before
    if not parts:
        raise InsufficientData("no grasp log of this material has friction samples yet")
    ingested = run.job.kind == "ingest"
    models = _all_that_fit(run, parts, prior) if ingested else [_fit_by(run, parts, run.job.method, len(parts), prior)]
    moments = {part.grasp_log_id: _moments(run, part) for part in parts}
    return with_weakening(with_change(models, list(moments.values()), prior), before, moments, prior)


def _all_that_fit(run: Run, parts: Sequence[SamplesOfLog], prior: ScatterPrior) -> list[FrictionModel]:
    """The models of an ingest; what one method cannot fit another may. Raises what was wrong where none can."""
    models, refusals = list[FrictionModel](), list[EstimatorError]()
    for method in INGEST_METHODS:
        try:
            models.append(_fit_by(run, parts, method, SAMPLED_AT_INGEST, prior))
        except EstimatorError as refusal:
            logger.info("no %s fit: %s", method, refusal)
            refusals.append(refusal)
    if not models:
        raise refusals[0]
    return models


def _fit_by(
    run: Run, parts: Sequence[SamplesOfLog], method: str, most_sampled: int, prior: ScatterPrior
) -> FrictionModel:
    """From the moments where the method needs no more, or of more than ``most_sampled`` logs; else from the samples."""
    data: list[Moments] | list[FrictionSamples]
    if len(parts) <= most_sampled and estimators.needs_samples(method, len(parts)):
        data = [
            replace(decode_samples(run.blobs.path(part.samples_blob)), sensor=grasping(part.sensor)) for part in parts
        ]
    else:
        data = [_moments(run, part) for part in parts]
    prior_or_none = prior if method in SCATTER_METHODS else None
    model = estimators.fit(data, method=method, seed=run.job.seed, scatter_prior=prior_or_none)
    findings = [part.findings for part in parts]
    for noted in (with_doubts, with_others_calibrations, with_others_gels, with_reconstructed):
        model = noted(model, findings)
    return with_copies(with_unchecked(model, [part.is_checked for part in parts]), parts)


def _moments(run: Run, part: SamplesOfLog) -> Moments:
    """Those stored, unless by a version that did not yet keep each place."""
    known = None if part.moments is None else Moments.from_bytes(part.moments)
    if known is None or not known.grasps:
        known = Moments.from_samples(decode_samples(run.blobs.path(part.samples_blob)))
    return known.of_sensor(grasping(part.sensor))


def _note_missing_moments(run: Run) -> None:
    """Of samples that an older version stored without, or without their places."""
    with run.database.read() as session:
        parts = detections.samples_of_material(session, jobs.material_id(session, run.job.id))
    for part in parts:
        if part.moments is None or not Moments.from_bytes(part.moments).grasps:
            content = _moments(run, part).to_bytes()
            with run.database.write(durable=False) as session:
                detections.set_moments(session, part.grasp_log_id, content)


def _store_models(
    run: Run,
    session: Session,
    material_id: int,
    models: Sequence[FrictionModel],
    fitted: Sequence[Row[Any]],
    counting: Sequence[Row[Any]],
) -> None:
    """Store the models and close the job, in one transaction with the logs that they were ``fitted`` to; it names the
    first.

    Where others are ``counting`` by now, they are fitted once more: by a method that is not cheap only if they were
    fitted to logs that count no longer, since who withdrew those did not know of this fit.
    """
    outdated = fitted != counting
    misled = {log.id for log in fitted} - {log.id for log in counting}
    with run.timed("material"):
        # before the models, of which a job may have one a method
        jobs.start_stage(session, run.claim, "material", run.seconds)
        _note_change(run, session, material_id, models[0])
        jobs.outdate_models(session, run.job.id)  # what could not be fitted stays so
        new = [to_new_model(model) for model in models]
        versions = [friction_models.add(session, material_id, run.job.id, each, outdated=outdated) for each in new]
        if run.job.kind == "ingest" or outdated:
            again = [model.method for model in models] if misled else []
            queue_cheap_refits(session, material_id, run.job.requested_by, again)
    jobs.finish(session, run.claim, "done", model_version=versions[0], seconds=run.seconds)


def _note_change(run: Run, session: Session, material_id: int, model: FrictionModel) -> None:
    """Record in the audit trail that the surface has changed, where the models before did not say so."""
    if MARK not in model.diagnostics:
        return
    before = friction_models.all_current(session, [material_id]).get(material_id, [])
    if not any(MARK in stored.model.diagnostics for stored in before):
        details = {"change": model.diagnostics[MARK], "grasp_log": run.job.grasp_log_id}
        name = jobs.get(session, run.job.id).material
        audit.add(session, audit.SERVICE, "material.surface_changed", str(name), details)
