"""Moments or samples of all logs of a material → friction_model → material."""

import logging
from collections.abc import Sequence
from dataclasses import replace
from itertools import count
from typing import Any, NamedTuple

from sqlalchemy import Row
from sqlalchemy.orm import Session

import estimators
from db.records import NewModel, SamplesOfLog
from db.repositories import audit, detections, friction_models, jobs
from estimators import EstimatorError, FrictionModel, Moments, ScatterPrior
from estimators.method_names import SCATTER_METHODS
from service.domain.jobs.queueing import INGEST_METHODS, queue_cheap_refits
from service.domain.logs.doubtful_logs import (
    with_doubts,
    with_others_calibrations,
    with_others_gels,
    with_reconstructed,
    with_unchecked,
)
from service.domain.logs.same_grasp import with_copies
from service.domain.models.other_materials import prior_from_others
from service.domain.models.stored_results import decode_samples, to_new_model
from service.domain.models.surface_change import MARK, with_change
from service.domain.models.weakening import with_weakening
from service.domain.sensors.names import grasping
from service.jobs.run import InsufficientData, Run
from slipcore import FrictionSamples

logger = logging.getLogger(__name__)

MOST_REPEATS = 3
"""Of a fit whose logs changed under it: nobody who writes waits for a fit, which may take minutes."""

SAMPLED_AT_INGEST = 30
"""Logs of a material up to which an ingest's fit by `auto` looks at their samples, for outliers, 3 ms a log. With more
logs it takes their moments as they are, 0.2 ms a log, until a fit is asked for."""


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
