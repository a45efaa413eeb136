"""The stages in their order: frames → strain → events → slip_state → samples → friction_model → material.

Runs in a worker process. Every step can be done again: what is stored already is not computed twice, and the last
step stores the model and closes the job in one transaction.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np

import estimators
import slipcore
from db.blobs import BlobStore
from db.database import Database
from db.records import Detection, Job, SampleSummary, StoredGraspLog
from db.repositories import detections, friction_models, grasp_logs, jobs, materials
from estimators import EstimatorError, FrictionModel
from service import formats
from service.stored_results import (
    decode_samples,
    encode_history,
    encode_samples,
    summarise_history,
    summarise_samples,
    to_new_model,
)
from slipcore import FrictionSamples, GraspLog, SlipcoreError, SlipHistory


class Refused(Exception):
    """The data do not allow what the job is for; the message says why."""


@dataclass(frozen=True, slots=True)
class Run:
    """One job under way: the stores, and the seconds of the stages done."""

    database: Database
    blobs: BlobStore
    job: Job
    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Say that the job is in this stage, and take its time."""
        with self.database.write() as session:
            jobs.start_stage(session, self.job.id, name, self.seconds)
        begin = perf_counter()
        yield
        self.seconds[name] = self.seconds.get(name, 0.0) + perf_counter() - begin


def run_job(database: Database, blobs: BlobStore, job_id: str) -> None:
    """Do a job to its end: done, or refused where the data do not allow it (or no chain of theirs converges)."""
    with database.read() as session:
        job = jobs.get(session, job_id)
    if job.finished_at is not None:
        return
    run = Run(database, blobs, job, dict(job.seconds))
    try:
        _take_through_the_stages(run)
    except (Refused, SlipcoreError, EstimatorError) as refusal:
        with database.write() as session:
            jobs.finish(session, job.id, "refused", reason=str(refusal), seconds=run.seconds)


def _take_through_the_stages(run: Run) -> None:
    job = run.job
    samples = None if job.grasp_log_id is None else find_samples(run, job.grasp_log_id)
    if job.material is None:  # detection only
        with run.database.write() as session:
            jobs.finish(session, job.id, "done", seconds=run.seconds)
        return
    if samples is not None and samples.none_because is not None:
        raise Refused(samples.none_because)
    fit_material(run, job.material)


def find_samples(run: Run, log_id: str) -> SampleSummary:
    """Frames → strain → events → slip_state → samples of one log."""
    with run.database.read() as session:
        stored = grasp_logs.get(session, log_id)
    if stored.samples is not None:
        return stored.samples
    with run.stage("frames"):
        log = formats.read(run.blobs.path(stored.sha256))
    with run.stage("slip_state"):
        history = slipcore.detect_slip(log, method=stored.detector)  # strain and events are its inner stages
    with run.stage("samples"):
        samples, none_because = _collect(log, history)
        blob = run.blobs.put(encode_history(history))
        detection = summarise_history(history, run.seconds["slip_state"], blob, is_scaled=log.is_scaled)
        summary = summarise_samples(samples, none_because, run.blobs.put(encode_samples(samples)))
        _store(run.database, stored, detection, summary)
    return summary


def fit_material(run: Run, material: str) -> None:
    """Samples of all logs of a material → friction_model → material; raises ``Refused``."""
    while True:
        with run.stage("friction_model"):
            with run.database.read() as session:
                material_id = materials.find_id(session, material)
                parts = detections.sample_blobs(session, material_id)
            model = _fit(run, parts)
        with run.stage("material"):
            if _store_model(run, material_id, model, parts):
                return


def _collect(log: GraspLog, history: SlipHistory) -> tuple[FrictionSamples, str | None]:
    """The samples, and if there are none, why."""
    if not log.is_scaled:
        return _no_samples(log), "the log's scale is unknown; friction needs velocities in m/s, not pixels a second"
    if log.force is None:
        return _no_samples(log), "the log has no forces; friction is tangential over normal force"
    if not history.contact.any():
        return _no_samples(log), f"no element was in contact in any of the {len(log)} frames"
    samples = slipcore.collect_samples(log, history)
    if len(samples) == 0:
        slipping = int(history.slip.sum())
        return samples, f"no slip gave a friction sample ({slipping} slipping elements in {len(log)} frames)"
    return samples, None


def _no_samples(log: GraspLog) -> FrictionSamples:
    none = np.empty(0)
    return FrictionSamples(none, none, none, none, none, none.astype(int), none, log.element_area)


def _store(database: Database, log: StoredGraspLog, detection: Detection, samples: SampleSummary) -> None:
    with database.write() as session:
        if grasp_logs.get(session, log.id).samples is None:
            detections.add(session, log.id, detection, samples)


def _fit(run: Run, parts: Mapping[str, str]) -> FrictionModel:
    if not parts:
        raise Refused("no grasp log of this material has friction samples yet")
    samples = [decode_samples(run.blobs.path(blob)) for blob in parts.values()]
    return estimators.fit(samples, method=run.job.method, seed=run.job.seed)


def _store_model(run: Run, material_id: int, model: FrictionModel, parts: Mapping[str, str]) -> bool:
    """Store the model and close the job; False if samples came in meanwhile, which the model must not leave out."""
    begin = perf_counter()
    with run.database.write() as session:
        friction_models.lock(session, material_id)
        if detections.sample_blobs(session, material_id) != parts:
            return False
        version = friction_models.add(session, material_id, run.job.id, to_new_model(model))
        seconds = run.seconds | {"material": perf_counter() - begin}
        jobs.finish(session, run.job.id, "done", model_version=version, seconds=seconds)
    return True
