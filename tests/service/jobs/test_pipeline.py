from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from threading import Thread
from types import ModuleType
from typing import Any, cast

import numpy as np
import pytest
from sqlalchemy import select, update
from sqlalchemy.orm import Session

import estimators
import slipcore
from db.blobs import BlobStore
from db.database import Database
from db.errors import ClaimLost
from db.records import Claim, Detection, Gel, Job, Material, NewGraspLog, StoredGraspLog, StoredModel
from db.repositories import access_keys, detections, friction_models, grasp_logs, jobs, materials, runners, sensors
from db.tables import DetectionRow, GraspLogRow, JobRow, SampleSummaryRow
from estimators import InvalidSamples, Moments, ScatterPrior
from service.domain.logs.collect_friction import collect
from service.domain.logs.same_grasp import find_alike
from service.domain.models.model_cache import KnownModel
from service.domain.models.recommended import recommended
from service.domain.models.stored_results import (
    SAMPLE_ARRAYS,
    decode_samples,
    encode_samples,
    summarise_samples,
    to_client_model,
    to_friction_model,
)
from service.domain.models.surface_change import MARK
from service.domain.planning.look_up import FrictionQuery, look_up
from service.domain.sensors.names import NAMELESS
from service.jobs import find_samples, fit_material, pipeline
from slipcore import FrictionSamples, GraspLog, forces
from slipcore.forces import reconstruct
from stiction_client.container import encode
from tests.service.grasps import another_grasp, same_grasp
from tests.service.remembered import remembering

RunWith = Callable[[Callable[[Session], object]], Job]

NOTHING_DETECTED = Detection("strain_rate", None, None, 0, 0, 0, 0, 0, 0, 0.1, "0" * 64)


class Shop:
    """The stores, with short words for what the tests do."""

    def __init__(self, database: Database, blobs: BlobStore) -> None:
        self.database, self.blobs = database, blobs
        with database.write() as session:
            self.material_id = materials.create(session, "paper", "").id

    def ingest(self, content: bytes, sensor: str = "s") -> tuple[str, str]:
        """A stored log of paper with its queued job."""
        sha256 = self.blobs.put(content)
        log = NewGraspLog(sha256, len(content), "npz", "strain_rate", self.material_id, sensor, 82, 2.7, (8, 8))
        with self.database.write() as session:
            log_id = grasp_logs.add(session, log)
            return log_id, jobs.add(session, "ingest", "ols", material_id=self.material_id, grasp_log_id=log_id)

    def fit(self, method: str = "ols") -> str:
        with self.database.write() as session:
            return jobs.add(session, "fit", method, material_id=self.material_id)

    def claim(self, job_id: str) -> Claim:
        """Give a job to a runner of its own; the one that was at it is dead."""
        with self.database.write() as session:
            before = session.scalar(select(JobRow.runner_id).where(JobRow.id == job_id))
            if before is not None:
                runners.remove(session, before)
            made = jobs.claim(session, runners.add(session, "host:1"))
        assert made is not None
        assert made.job_id == job_id
        return made

    def run(self, job_id: str) -> Job:
        """Have a job done."""
        pipeline.run_job(self.database, self.blobs, self.claim(job_id))
        with self.database.read() as session:
            return jobs.get(session, job_id)

    def log(self, log_id: str) -> StoredGraspLog:
        with self.database.read() as session:
            return grasp_logs.get(session, log_id)

    def material(self) -> Material:
        with self.database.read() as session:
            return materials.get(session, "paper")


@pytest.fixture(scope="module", autouse=True)
def worked_out_once() -> Iterator[None]:
    """What most jobs here are about: slip and samples of one log, forces by one gel, and fits of these samples."""
    detection = [(slipcore, name) for name in ("detect_slip", "collect_friction", "check_log")]
    with remembering(*detection, (forces, "reconstruct"), (estimators, "fit")):
        yield


@pytest.fixture
def shop(database: Database, blobs: BlobStore) -> Shop:
    return Shop(database, blobs)


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """Names of the numerics that were called."""
    made: list[str] = []
    for module, name in ((slipcore, "detect_slip"), (slipcore, "collect_friction"), (estimators, "fit")):
        original: Callable[..., Any] = getattr(module, name)

        def noted(*given: Any, _name: str = name, _original: Callable[..., Any] = original, **options: Any) -> Any:
            made.append(_name)
            return _original(*given, **options)

        monkeypatch.setattr(module, name, noted)
    return made


def test_a_log_goes_through_all_stages(shop: Shop, content: bytes, calls: list[str]) -> None:
    log_id, job_id = shop.ingest(content)
    job = shop.run(job_id)
    assert (job.status, job.model_version) == ("done", 1)
    assert list(job.seconds) == ["frames", "slip_state", "samples", "friction_model", "material"]
    assert calls == ["detect_slip", "collect_friction", "fit", "fit"]
    found = shop.log(log_id)
    assert found.samples is not None
    assert {stored.model.method: stored.model.n for stored in shop.material().models} == {
        "hierarchical": found.samples.count,
        "ols": found.samples.count,
    }


def test_an_ingest_keeps_the_models_current_that_planners_ask_for(shop: Shop, content: bytes) -> None:
    shop.run(shop.ingest(content)[1])
    shop.run(shop.fit("conjugate"))
    shop.run(shop.ingest(another_grasp(content))[1])
    told = {stored.model.method: (stored.version, stored.outdated) for stored in shop.material().models}
    assert told == {"hierarchical": (2, False), "ols": (2, False), "conjugate": (1, True)}
    best = recommended(shop.material().models)
    assert best is not None
    assert (best.stored.model.method, best.stored.model.scales is None) == ("hierarchical", False)


@pytest.mark.parametrize("most_sampled", [0, 30])
def test_logs_and_streams_that_name_no_sensor_are_of_one(
    shop: Shop, content: bytes, most_sampled: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They had been fitted as of two, whose gains are unknown: with intervals twice as wide."""
    monkeypatch.setattr(fit_material, "SAMPLED_AT_INGEST", most_sampled)
    for k, name in enumerate(NAMELESS):
        shop.run(shop.ingest(another_grasp(content, k), name)[1])
    scales = [each.model.scales for each in shop.material().models if each.model.method == "hierarchical"]
    assert [each is not None and each.between_sensors for each in scales] == [None]


@pytest.mark.parametrize("most_sampled", [0, 30])
def test_what_sensors_differ_by_is_stored_and_told(
    shop: Shop, content: bytes, most_sampled: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fit_material, "SAMPLED_AT_INGEST", most_sampled)
    shop.run(shop.ingest(content)[1])
    shop.run(shop.ingest(another_grasp(content), "other")[1])
    stored = next(each for each in shop.material().models if each.model.method == "hierarchical")
    assert stored.model.scales is not None
    assert stored.model.scales.between_sensors is not None
    assert set(stored.model.scales.between_sensors["sensors"]) == {"s", "other"}
    model = to_client_model(stored)
    assert model.of_sensor("s").scales != model.scales
    assert len(model.notes) == 1
    known = KnownModel(stored, to_friction_model(stored.model), "", 0.0, 0.0)
    answer = look_up(known, FrictionQuery(0.0, 0.05, 0.01))
    assert answer.notes == model.notes == (stored.model.diagnostics["sensor_gain"],)


def test_a_grasp_that_was_sent_in_several_files_counts_once(shop: Shop, content: bytes, ramp: GraspLog) -> None:
    """Four files of one grasp had been four grasps, which seemed to agree as no grasps do."""
    shop.run(shop.ingest(content)[1])
    alone = hierarchical_model(shop).model
    assert ramp.force is not None
    changed = (
        replace(ramp, time=ramp.time + 1000.0),
        replace(ramp, truth=None, sensor="other"),
        ramp.take(slice(-1)),
        replace(ramp, force=np.round(ramp.force, 6)),
    )
    contents = [(same_grasp(content, 1), "s"), *((encode(log), log.sensor) for log in changed)]
    copies = [shop.ingest(*each) for each in contents]
    assert [shop.run(job).status for _, job in copies] == ["done"] * 5
    stored = hierarchical_model(shop)
    assert (stored.model.coefficients, stored.model.n) == (alone.coefficients, alone.n)
    known = KnownModel(stored, to_friction_model(stored.model), "", 0.0, 0.0)
    (note,) = look_up(known, FrictionQuery(0.0, 0.05, 0.01)).notes
    assert note.startswith("5 logs repeat the measurements of another log: counted once (")
    for log_id, _ in copies:
        found = shop.log(log_id).detection
        assert log_id in note
        assert found is not None
        assert found.findings is not None
        assert found.findings[0].name == "same grasp"


def test_the_whole_log_counts_where_a_short_cut_of_it_came_first(shop: Shop, content: bytes, ramp: GraspLog) -> None:
    """The cut had counted alone."""
    shop.run(shop.ingest(content)[1])
    alone = hierarchical_model(shop).model
    with shop.database.write() as session:
        steel = materials.create(session, "steel", "").id
    shop.material_id = steel
    short, job = shop.ingest(encode(ramp.take(slice(76))))
    assert shop.run(job).status == "done"
    shop.run(shop.ingest(content)[1])
    with shop.database.read() as session:
        models = materials.get(session, "steel").models
    whole = next(each.model for each in models if each.model.method == "hierarchical")
    assert (whole.coefficients, whole.n) == (alone.coefficients, alone.n)
    assert f"({short} of " in str(whole.diagnostics["same_grasps"])


@pytest.mark.parametrize("is_withdrawn", [False, True])
def test_parts_of_a_grasp_count_once_when_the_whole_shows_it(
    shop: Shop, content: bytes, ramp: GraspLog, is_withdrawn: bool
) -> None:
    """The newest part alone had been taken for the same. Where the whole was sent by mistake, they are two grasps."""
    even, odd = (ramp.take(slice(begin, None, 2)) for begin in (0, 1))
    for log in (even, odd):
        shop.run(shop.ingest(encode(log))[1])
    shop.run(shop.ingest(another_grasp(content))[1])
    shop.run(shop.fit("robust"))
    with shop.database.read() as session:
        assert len(detections.samples_of_material(session, shop.material_id)) == 3
    log_id, job = shop.ingest(content)
    with shop.database.write() as session:
        if is_withdrawn:
            grasp_logs.withdraw(session, log_id, "sent by mistake")
    assert shop.run(job).status == "done"
    with shop.database.read() as session:
        parts = detections.samples_of_material(session, shop.material_id)
    assert sorted(len(part.copies) for part in parts) == ([0, 0, 0] if is_withdrawn else [0, 2])
    assert (log_id in {part.grasp_log_id for part in parts}) == (not is_withdrawn)
    outdated = {stored.model.method: stored.outdated for stored in shop.material().models}
    assert outdated == {"hierarchical": False, "ols": False, "robust": not is_withdrawn}


def test_a_whole_log_without_samples_makes_no_grasps_one(
    shop: Shop, ramp: GraspLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its material would not be fitted again."""
    for begin in (0, 1):
        shop.run(shop.ingest(encode(ramp.take(slice(begin, None, 2))))[1])
    collect = find_samples.collect

    def none(*arguments: Any) -> Any:
        found, _ = collect(*arguments)
        return found._replace(samples=found.samples.take(slice(0))), "no slip"

    monkeypatch.setattr(find_samples, "collect", none)
    assert shop.run(shop.ingest(encode(ramp))[1]).status == "refused"
    with shop.database.read() as session:
        assert len(detections.samples_of_material(session, shop.material_id)) == 2
    assert not any(stored.outdated for stored in shop.material().models)


def test_a_cut_log_that_is_looked_at_meanwhile_does_not_count_either(
    shop: Shop, content: bytes, ramp: GraspLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither of two jobs at once has seen the other's grasp before both store theirs."""
    log_id, job = shop.ingest(encode(ramp.take(slice(-1))))
    check = slipcore.check_log

    def check_late(*arguments: Any) -> Any:
        monkeypatch.setattr(slipcore, "check_log", check)
        shop.run(shop.ingest(content)[1])
        return check(*arguments)

    monkeypatch.setattr(slipcore, "check_log", check_late)
    assert shop.run(job).status == "done"
    with shop.database.read() as session:
        parts = detections.samples_of_material(session, shop.material_id)
    assert [len(part.copies) for part in parts] == [1]
    found = shop.log(log_id).detection
    assert found is not None
    assert found.findings is not None
    assert "same grasp" in {finding.name for finding in found.findings}


def test_logs_are_compared_while_others_may_write(
    shop: Shop, content: bytes, ramp: GraspLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What another job stores between the comparison and the storing is compared, too."""
    log_id, job = shop.ingest(encode(ramp.take(slice(-1))))
    found: list[bool] = []

    def compare_while_another_stores(*given: Any) -> Any:
        alike = find_alike(*given)
        found.append(bool(alike))
        if len(found) == 1:
            shop.run(shop.ingest(content)[1])
        return alike

    monkeypatch.setattr(find_samples, "find_alike", compare_while_another_stores)
    assert shop.run(job).status == "done"
    assert found == [False, False, True]  # of ours, of the other, and of ours with that
    told = shop.log(log_id).detection
    assert told is not None
    assert told.findings is not None
    assert told.findings[0].name == "same grasp"


@pytest.mark.parametrize("missing", ["findings", "signature"])
def test_answers_say_that_logs_were_not_checked(shop: Shop, content: bytes, missing: str) -> None:
    shop.run(shop.ingest(content)[1])
    with shop.database.write() as session:
        session.execute(update(DetectionRow).values({missing: None}))
    shop.run(shop.ingest(another_grasp(content))[1])
    stored = hierarchical_model(shop)
    assert to_client_model(stored).notes == (stored.model.diagnostics["unchecked_logs"],)
    assert str(stored.model.diagnostics["unchecked_logs"]).startswith("1 of 2 logs was stored before ")


def test_a_log_that_lowers_what_may_be_counted_on_is_named(
    shop: Shop, content: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fit_material, "SAMPLED_AT_INGEST", 0)
    ids = []
    for number in range(3):
        log_id, job_id = shop.ingest(another_grasp(content, number))
        shop.run(job_id)
        ids.append(log_id)
    kept = shop.log(ids[1]).samples
    assert kept is not None
    samples = decode_samples(shop.blobs.path(kept.samples_blob))
    weak = Moments.from_samples(replace(samples, friction_coefficient=0.4 * samples.friction_coefficient))
    with shop.database.write() as session:
        detections.set_moments(session, ids[1], weak.to_bytes())
    shop.run(shop.fit("hierarchical"))
    stored = next(each for each in shop.material().models if each.model.method == "hierarchical")
    assert stored.model.diagnostics["weakened_by"] == ids[1]
    assert to_client_model(stored).notes[0].startswith(f"by log {ids[1]}, of ")


def test_an_ingest_of_many_logs_looks_at_moments_alone(
    shop: Shop, content: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fit_material, "SAMPLED_AT_INGEST", 1)
    seen: list[type] = []
    fit = estimators.fit

    def noted(parts: Any, **options: Any) -> estimators.FrictionModel:
        seen.extend(map(type, parts))
        return fit(parts, **options)

    monkeypatch.setattr(estimators, "fit", noted)
    for number in range(2):
        shop.run(shop.ingest(another_grasp(content, number))[1])
    assert seen == [FrictionSamples] * 2 + [Moments] * 4


def test_a_job_that_is_done_is_not_done_again(shop: Shop, content: bytes, calls: list[str]) -> None:
    log_id, job_id = shop.ingest(content)
    claim = shop.claim(job_id)
    pipeline.run_job(shop.database, shop.blobs, claim)
    done = shop.log(log_id)
    calls.clear()
    with pytest.raises(ClaimLost):
        pipeline.run_job(shop.database, shop.blobs, claim)
    assert shop.log(log_id) == done
    assert calls == []


@pytest.mark.parametrize(
    ("module", "name"), [(slipcore, "detect_slip"), (slipcore, "collect_friction"), (estimators, "fit")]
)
def test_a_worker_whose_job_went_to_another_stores_nothing_more(
    shop: Shop, content: bytes, monkeypatch: pytest.MonkeyPatch, module: ModuleType, name: str
) -> None:
    log_id, job_id = shop.ingest(content)
    claim = shop.claim(job_id)
    numerics = getattr(module, name)

    def slow(*given: Any, **options: Any) -> Any:
        monkeypatch.setattr(module, name, numerics)
        shop.run(job_id)
        return numerics(*given, **options)

    monkeypatch.setattr(module, name, slow)
    with pytest.raises(ClaimLost):
        pipeline.run_job(shop.database, shop.blobs, claim)
    assert shop.log(log_id).job.status == "done"
    assert {stored.version for stored in shop.material().models} == {1}


@pytest.mark.parametrize(
    ("dies_in", "left_to_do"),
    [
        ("detections.add", ["detect_slip", "collect_friction", "fit", "fit"]),
        ("friction_models.add", ["fit", "fit"]),
        ("jobs.finish", ["fit", "fit"]),
    ],
)
def test_a_job_that_was_interrupted_goes_on_where_it_was(
    shop: Shop, content: bytes, calls: list[str], monkeypatch: pytest.MonkeyPatch, dies_in: str, left_to_do: list[str]
) -> None:
    log_id, job_id = shop.ingest(content)

    def die(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(f"db.repositories.{dies_in}", die)
        with pytest.raises(KeyboardInterrupt):
            shop.run(job_id)
    assert shop.material().models == ()
    calls.clear()
    job = shop.run(job_id)
    assert (job.status, job.model_version) == ("done", 1)
    assert list(job.seconds) == ["frames", "slip_state", "samples", "friction_model", "material"]
    assert calls == left_to_do
    assert shop.log(log_id).samples is not None


def test_a_model_leaves_no_samples_out_that_came_in_while_it_was_fitted(
    shop: Shop, content: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else a fit that began earlier and ended later would make an older picture the current one."""
    log_id, first = shop.ingest(content)
    fit = estimators.fit
    grasps = []

    def slow_fit(samples: list[Any], **options: Any) -> estimators.FrictionModel:
        grasps.append(len(samples))
        if len(grasps) == 1:
            monkeypatch.setattr(estimators, "fit", fit)
            _, second = shop.ingest(another_grasp(content))
            assert shop.run(second).model_version == 1
            monkeypatch.setattr(estimators, "fit", slow_fit)
        return fit(samples, **options)

    monkeypatch.setattr(estimators, "fit", slow_fit)
    assert shop.run(first).model_version == 2
    assert grasps == [1, 1, 2, 2]  # by each of the two methods
    samples = shop.log(log_id).samples
    assert samples is not None
    assert {(stored.version, stored.model.n) for stored in shop.material().models} == {(2, 2 * samples.count)}


@pytest.fixture
def run_with(shop: Shop, content: bytes, monkeypatch: pytest.MonkeyPatch) -> RunWith:
    """Runs an ingest, with a change to the database that another process makes while slip is detected."""

    def run(change: Callable[[Session], object]) -> Job:
        detect = slipcore.detect_slip

        def detect_meanwhile(*given: Any, **options: Any) -> slipcore.SlipHistory:
            with shop.database.write() as session:
                change(session)
            return detect(*given, **options)

        monkeypatch.setattr(slipcore, "detect_slip", detect_meanwhile)
        return shop.run(shop.ingest(content)[1])

    return run


def test_a_job_stays_with_its_material_whatever_takes_its_name(shop: Shop, run_with: RunWith) -> None:
    def take_the_name(session: Session) -> None:
        materials.rename(session, shop.material_id, "card")
        materials.remove_alias(session, shop.material_id, "paper")
        materials.create(session, "paper", "another one")

    job = run_with(take_the_name)
    assert (job.status, job.material) == ("done", "card")
    with shop.database.read() as session:
        assert [stored.version for stored in materials.get(session, "card").models] == [1, 1]
    assert shop.material().models == ()  # of the other paper


def test_a_log_that_is_merged_away_while_it_is_read_counts_in_the_other_material(shop: Shop, run_with: RunWith) -> None:
    def merge(session: Session) -> None:
        materials.merge(session, materials.create(session, "card", "").id, shop.material_id)

    assert run_with(merge).status == "done"
    material = shop.material()  # an alias by now
    assert (material.name, material.grasp_logs, len(material.models)) == ("card", 1, 2)


@pytest.mark.parametrize(
    ("method", "kind"),
    [("ols", Moments), ("conjugate", Moments), ("bayes", Moments), ("robust", FrictionSamples)],
)
def test_a_fit_reads_moments_where_its_method_needs_no_more_one_part_a_grasp(
    shop: Shop, content: bytes, monkeypatch: pytest.MonkeyPatch, method: str, kind: type
) -> None:
    counts = []
    for number in range(2):
        log_id, job_id = shop.ingest(another_grasp(content, number))
        shop.run(job_id)
        samples = shop.log(log_id).samples
        assert samples is not None
        counts.append(samples.count)
    seen: list[Moments | FrictionSamples] = []
    fit = estimators.fit

    def noted(parts: Any, **options: Any) -> estimators.FrictionModel:
        seen.extend(parts)
        return fit(parts, **options)

    monkeypatch.setattr(estimators, "fit", noted)
    if kind is Moments:
        shop.blobs.remove(list(shop.blobs.hashes()))  # not one sample is read
    assert shop.run(shop.fit(method)).status == "done"
    assert [(type(part), part.n if isinstance(part, Moments) else len(part)) for part in seen] == [
        (kind, count) for count in counts
    ]


@pytest.mark.parametrize("places", [None, False])
def test_moments_that_an_older_version_did_not_store_are_made_up_for(
    shop: Shop, content: bytes, places: bool | None
) -> None:
    """Neither those stored without moments, nor those whose moments do not tell their places."""
    for number in range(2):
        shop.run(shop.ingest(another_grasp(content, number))[1])
    with shop.database.write() as session:
        before = detections.samples_of_material(session, shop.material_id)
        older_moments = None if places is None else replace(Moments.from_bytes(before[0].moments), grasps=()).to_bytes()
        session.execute(update(SampleSummaryRow).values(moments=older_moments))
    assert shop.run(shop.fit()).status == "done"
    with shop.database.read() as session:
        assert detections.samples_of_material(session, shop.material_id) == before
        newest, older, _ = friction_models.versions(session, shop.material_id, "ols")
    assert newest.model.coefficients == older.model.coefficients


def overtake(monkeypatch: pytest.MonkeyPatch, change: Callable[[int], object]) -> list[int]:
    """Do something under each fit from now on, told how many there were; returns how many logs each was of."""
    fit, fitted = estimators.fit, list[int]()

    def overtaken_fit(parts: Any, **options: Any) -> estimators.FrictionModel:
        fitted.append(len(parts))
        with monkeypatch.context() as meanwhile:
            meanwhile.setattr(estimators, "fit", fit)
            change(len(fitted))
        return fit(parts, **options)

    monkeypatch.setattr(estimators, "fit", overtaken_fit)
    return fitted


def test_a_fit_that_logs_overtake_is_made_again(shop: Shop, content: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    shop.run(shop.ingest(content)[1])

    def add(count: int) -> None:
        if count <= fit_material.MOST_REPEATS:
            shop.run(shop.ingest(another_grasp(content, count))[1])

    fitted = overtake(monkeypatch, add)
    assert shop.run(shop.fit()).model_version == 2 + fit_material.MOST_REPEATS
    assert fitted == [1, 2, 3, 4]


def test_nobody_waits_for_a_fit_that_logs_overtake_all_the_time(
    shop: Shop, content: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The last time it was made within a transaction, and whoever wrote to SQLite waited until he was refused."""
    shop.run(shop.ingest(content)[1])
    fitted = overtake(monkeypatch, lambda count: shop.run(shop.ingest(another_grasp(content, count))[1]))
    assert shop.run(shop.fit("conjugate")).status == "done"
    assert fitted == [1 + tries for tries in range(1 + fit_material.MOST_REPEATS)]
    assert {stored.model.method: stored.outdated for stored in shop.material().models} == {
        "conjugate": True,
        "hierarchical": False,
        "ols": False,
    }
    monkeypatch.undo()
    with shop.database.read() as session:
        refit = jobs.queued_fit(session, shop.material_id, "conjugate")
    assert refit is not None
    assert shop.run(refit).status == "done"
    assert not any(stored.outdated for stored in shop.material().models)


def test_a_model_of_fewer_logs_does_not_take_the_place_of_one_of_all(
    shop: Shop, content: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """That another job stored meanwhile: friction was told by four logs of five."""
    shop.run(shop.ingest(content)[1])
    overtake(monkeypatch, lambda count: shop.run(shop.ingest(another_grasp(content, count))[1]))
    version = shop.run(shop.fit()).model_version
    with shop.database.read() as session:
        newest, current, *_ = friction_models.versions(session, shop.material_id, "ols")
        assert jobs.queued_fit(session, shop.material_id, "ols") is None
    assert (newest.version, newest.current, newest.outdated) == (version, False, True)
    assert (current.current, current.outdated) == (True, False)
    assert current.model.n > newest.model.n


def test_samples_are_not_read_while_others_wait(shop: Shop, content: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    """All that each of thousands of copies of a grasp is alike was read once more where the models are stored."""
    read, engines = detections.samples_of_material, list[Any]()

    def noting(session: Session, material_id: int) -> Any:
        engines.append(session.get_bind())
        return read(session, material_id)

    monkeypatch.setattr(detections, "samples_of_material", noting)
    assert shop.run(shop.ingest(content)[1]).status == "done"
    assert engines
    assert all(engine is shop.database._reading for engine in engines)


def test_logs_are_not_read_one_by_one_while_others_wait(
    shop: Shop, content: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whether the same ones count still took 0.16 s of 20,000, for which every writer waited."""
    read, engines = detections.logs_that_count, list[Any]()

    def noting(session: Session, material_id: int) -> Any:
        engines.append(session.get_bind())
        return read(session, material_id)

    monkeypatch.setattr(detections, "logs_that_count", noting)
    assert shop.run(shop.ingest(content)[1]).status == "done"
    assert engines
    assert all(engine is shop.database._reading for engine in engines)


@pytest.mark.parametrize("change", ["withdrawn", "added"])
def test_a_first_model_of_logs_that_were_withdrawn_under_its_fit_is_fitted_again(
    shop: Shop, content: bytes, monkeypatch: pytest.MonkeyPatch, change: str
) -> None:
    """By a method that is not cheap, too: who withdraws a log asks for fits by those of which there is a model."""
    logs = [shop.ingest(another_grasp(content, number)) for number in range(2 + fit_material.MOST_REPEATS)]
    for _, ingest in logs:
        shop.run(ingest)

    def alter(count: int) -> None:
        if change == "added":
            shop.run(shop.ingest(another_grasp(content, 10 + count))[1])
            return
        with shop.database.write() as session:
            grasp_logs.withdraw(session, logs[count][0], "wet", None)

    fitted = overtake(monkeypatch, alter)
    assert shop.run(shop.fit("robust")).status == "done"
    assert len(fitted) == 1 + fit_material.MOST_REPEATS
    with shop.database.read() as session:
        refit = jobs.queued_fit(session, shop.material_id, "robust")
    assert (refit is not None) == (change == "withdrawn")


def test_no_model_of_logs_that_were_all_withdrawn_under_its_fit_is_stored(
    shop: Shop, content: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    shop.run(shop.ingest(content)[1])

    def alter(count: int) -> None:
        if count <= fit_material.MOST_REPEATS:
            shop.run(shop.ingest(another_grasp(content, count))[1])
            return
        with shop.database.write() as session:
            grasp_logs.withdraw_before(session, shop.material_id, None, "worn", None)
            friction_models.retire(session, shop.material_id)

    fitted = overtake(monkeypatch, alter)
    assert shop.run(shop.fit()).status == "refused"
    assert len(fitted) == 1 + fit_material.MOST_REPEATS
    assert not shop.material().models


def test_too_few_samples_are_refused_with_the_reason(shop: Shop, content: bytes, ramp: GraspLog) -> None:
    log_id, ingest = shop.ingest(content)
    samples = slipcore.collect_samples(ramp, slipcore.detect_slip(ramp))
    two = replace(samples, **{name: getattr(samples, name)[:2] for name in SAMPLE_ARRAYS})
    summary = summarise_samples(two, None, shop.blobs.put(encode_samples(two)))
    with shop.database.write() as session:
        detections.add(session, log_id, NOTHING_DETECTED, summary)
    job = shop.run(ingest)
    assert (job.status, job.stage) == ("refused", "friction_model")
    assert job.reason is not None
    assert "2" in job.reason
    assert "allowed" in job.reason
    assert shop.material().models == ()


def test_a_lattice_on_which_no_strain_can_be_told_is_refused_with_the_reason(shop: Shop, ramp: GraspLog) -> None:
    assert ramp.force is not None
    row = GraspLog(
        time=ramp.time,
        position=ramp.position[:1],
        displacement=ramp.displacement[:, :1],
        element_area=ramp.element_area,
        force=ramp.force[:, :1],
    )
    job = shop.run(shop.ingest(encode(row))[1])
    assert job.status == "refused"
    assert "position is 1 ×" in (job.reason or "")


def test_a_repeated_fit_is_a_version_of_its_own(shop: Shop, content: bytes) -> None:
    shop.run(shop.ingest(content)[1])
    assert shop.run(shop.fit()).model_version == 2
    with shop.database.read() as session:
        first, second = friction_models.versions(session, shop.material_id, "ols")[::-1]
    np.testing.assert_array_equal(first.model.coefficients, second.model.coefficients)
    assert (first.current, second.current) == (False, True)


def test_what_one_method_cannot_fit_another_may(monkeypatch: pytest.MonkeyPatch) -> None:
    def fit_by(_run: Any, _parts: Any, method: str, *_: object) -> str:
        if method in unfit:
            raise InvalidSamples(method, "such that it fits none", "others")
        return method

    monkeypatch.setattr(fit_material, "_fit_by", fit_by)
    unfit = {"auto"}
    assert fit_material._all_that_fit(cast(Any, None), [], ScatterPrior()) == ["ols"]
    unfit = {"auto", "ols"}
    with pytest.raises(InvalidSamples, match="auto"):
        fit_material._all_that_fit(cast(Any, None), [], ScatterPrior())


def refuse(_shop: Shop, _job_id: str) -> None:
    raise InvalidSamples("samples", "such that nothing fits", "others")


def cancel(shop: Shop, job_id: str) -> None:
    with shop.database.write() as session:
        jobs.cancel(session, job_id, "nobody wants it")


@pytest.mark.parametrize(("end", "status"), [(refuse, "refused"), (cancel, "cancelled")])
def test_models_say_so_that_lack_the_samples_of_a_job_that_made_none(
    shop: Shop, content: bytes, end: Callable[[Shop, str], None], status: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    shop.run(shop.ingest(content)[1])
    assert {stored.outdated for stored in shop.material().models} == {False}
    log_id, job_id = shop.ingest(another_grasp(content))
    fit = estimators.fit

    def ended_meanwhile(*given: Any, **options: Any) -> estimators.FrictionModel:
        end(shop, job_id)
        return fit(*given, **options)

    monkeypatch.setattr(estimators, "fit", ended_meanwhile)
    with suppress(ClaimLost):
        shop.run(job_id)
    log = shop.log(log_id)
    assert (log.job.status, log.samples is None) == (status, False)
    assert {stored.outdated for stored in shop.material().models} == {True}


def test_models_lack_samples_that_were_being_stored_when_the_job_was_cancelled(
    shop: Shop, content: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Who cancels then waits for the worker's transaction, and must see what that has stored."""
    shop.run(shop.ingest(content)[1])
    log_id, job_id = shop.ingest(another_grasp(content))
    cancelling, add = Thread(target=cancel, args=(shop, job_id)), detections.add

    def add_meanwhile(*given: Any) -> None:
        add(*given)
        cancelling.start()
        cancelling.join(timeout=0.3)
        assert cancelling.is_alive()

    monkeypatch.setattr(detections, "add", add_meanwhile)
    with suppress(ClaimLost):
        shop.run(job_id)
    cancelling.join()
    log = shop.log(log_id)
    if log.job.status == "cancelled":  # on SQLite the job may be done before the other gets the lock
        assert log.samples is not None
        assert {stored.outdated for stored in shop.material().models} == {True}
    else:
        assert {(stored.version, stored.outdated) for stored in shop.material().models} == {(2, False)}


def test_a_model_by_a_method_that_cannot_fit_all_samples_is_outdated(
    shop: Shop, content: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    shop.run(shop.ingest(content)[1])
    fit = estimators.fit

    def fit_by(parts: Any, *, method: str, **options: Any) -> estimators.FrictionModel:
        if method == "ols":
            raise InvalidSamples(method, "such that it fits none", "others")
        return fit(parts, method=method, **options)

    monkeypatch.setattr(estimators, "fit", fit_by)
    shop.run(shop.ingest(another_grasp(content))[1])
    assert {stored.model.method: stored.outdated for stored in shop.material().models} == {
        "hierarchical": False,
        "ols": True,
    }


def hierarchical_model(shop: Shop) -> StoredModel:
    """Paper's current one."""
    (model,) = [stored for stored in shop.material().models if stored.model.method == "hierarchical"]
    return model


def know_card(shop: Shop, sensor: str = "s", **diagnostics: str) -> None:
    """Another material of four grasps, with the model of paper."""
    model = hierarchical_model(shop).model
    told = model.diagnostics | {"clusters": 4.0, "cluster_kind": "grasp"} | diagnostics
    log = NewGraspLog("2" * 64, 10, "npz", "strain_rate", None, sensor, 82, 2.7, (8, 8))
    with shop.database.write() as session:
        card = materials.create(session, "card", "").id
        grasp_logs.add(session, replace(log, material_id=card))
        job = jobs.add(session, "fit", "auto", material_id=card)
        friction_models.add(session, card, job, replace(model, diagnostics=told))
        jobs.cancel(session, job, "its model is here")


def test_other_materials_of_the_sensor_tell_how_much_grasps_may_differ(shop: Shop, content: bytes) -> None:
    shop.run(shop.ingest(content)[1])
    assert "scale 0.07, the default;" in str(hierarchical_model(shop).model.diagnostics["prior"])
    know_card(shop)
    shop.run(shop.ingest(another_grasp(content))[1])
    assert "from 1 other material;" in str(hierarchical_model(shop).model.diagnostics["prior"])
    best = recommended(shop.material().models)
    assert best is not None
    assert "expected from 1 other material" in best.because
    claim = shop.claim(shop.fit("hierarchical"))
    pipeline.run_job(shop.database, shop.blobs, claim, scatter_from_other_materials=False)
    stored = hierarchical_model(shop)
    assert (stored.version, "the default;" in str(stored.model.diagnostics["prior"])) == (3, True)
    assert "scatter_prior" not in stored.model.diagnostics


@pytest.mark.parametrize("of_another_sensor", [True, False])
def test_materials_of_another_sensor_or_whose_surface_changed_tell_nothing(
    shop: Shop, content: bytes, of_another_sensor: bool
) -> None:
    shop.run(shop.ingest(content)[1])
    know_card(shop, **{"sensor": "t"} if of_another_sensor else {MARK: "friction is 20% lower"})
    shop.run(shop.fit("hierarchical"))
    stored = hierarchical_model(shop)
    assert (stored.version, "the default;" in str(stored.model.diagnostics["prior"])) == (2, True)


@pytest.fixture(scope="module")
def blind(ramp: GraspLog) -> GraspLog:
    """A few frames of the ramp, without forces."""
    return GraspLog(ramp.time[30::13], ramp.position, ramp.displacement[30::13], ramp.element_area)


def test_forces_that_a_described_sensor_lacks_are_reconstructed(shop: Shop, blind: GraspLog) -> None:
    with shop.database.write() as session:
        sensors.describe(session, "s", Gel(1e6, 0.49, None, 0.0))
    log_id, job_id = shop.ingest(encode(blind))
    job = shop.run(job_id)
    assert list(job.seconds)[:3] == ["frames", "forces", "slip_state"]
    found = shop.log(log_id).detection
    assert found is not None
    assert found.findings is not None
    assert found.findings[0].name == "reconstructed forces"
    assert "by the data: x 100%, y 100%, z 100%" in found.findings[0].evidence


@pytest.mark.parametrize(
    ("described_by", "sent_by", "is_told"),
    [("a", "b", True), ("a", None, True), ("a", "a", False), (None, "b", False)],
)
def test_forces_by_a_gel_that_another_key_described_say_so(
    shop: Shop, blind: GraspLog, described_by: str | None, sent_by: str | None, is_told: bool
) -> None:
    """A wrong one bends friction of all who use the name; none is told of an admin's."""
    with shop.database.write() as session:
        for name in "ab":
            access_keys.add(session, name, f"robot {name}", "upload", name * 64)
        sensors.describe(session, "s", Gel(1e6, 0.49, None, 0.0), described_by)
    log_id, job_id = shop.ingest(encode(blind))
    with shop.database.write() as session:
        session.execute(update(GraspLogRow).values(uploaded_by=sent_by))
    shop.run(job_id)
    found = shop.log(log_id).detection
    assert found is not None
    told = [finding.evidence for finding in found.findings or () if finding.name == "another's gel"]
    assert told == ["key a described the sensor's gel, by which forces are reconstructed"] * is_told


def test_a_gripper_that_reports_its_force_is_named_beside_the_gel(shop: Shop, blind: GraspLog) -> None:
    with shop.database.write() as session:
        sensors.describe(session, "s", Gel(1e6, 0.49, None, 0.0))
    told = replace(blind, gripper_force=np.linspace(0.0, 1.0, len(blind)))
    log_id, job_id = shop.ingest(encode(told))
    shop.run(job_id)
    found = shop.log(log_id).detection
    assert found is not None
    assert found.findings is not None
    told_by, contradicted = found.findings[:2]
    assert (
        "by the sensor's gel and from the normal force that the gripper reports, in effect averaged" in told_by.evidence
    )
    assert contradicted.name == "gripper's force contradicted"  # it is by far too small


def test_a_log_that_calls_its_forces_reconstructed_silences_no_check_without_a_word(shop: Shop, ramp: GraspLog) -> None:
    log_id, job_id = shop.ingest(encode(replace(ramp, metadata={"force": "reconstructed"})))
    shop.run(job_id)
    found = shop.log(log_id).detection
    assert found is not None
    assert "forces not checked" in {finding.name for finding in found.findings or ()}


def test_without_a_description_a_log_without_forces_is_refused_with_advice(shop: Shop, blind: GraspLog) -> None:
    job = shop.run(shop.ingest(encode(blind))[1])
    assert job.status == "refused"
    assert job.reason is not None
    assert job.reason.startswith("the log has no forces")
    assert "describe the gel of sensor" in job.reason
    assert "forces" not in job.seconds


def test_columns_that_were_left_out_are_named_where_forces_are_missing(shop: Shop, blind: GraspLog) -> None:
    told = replace(blind, metadata={"columns_left_out": "fx, fy, fz"})
    job = shop.run(shop.ingest(encode(told))[1])
    assert job.reason is not None
    assert "the columns that were left out (fx, fy, fz), say which in a mapping" in job.reason


def test_samples_carry_the_noise_of_reconstructed_forces(blind: GraspLog) -> None:
    found = reconstruct(blind, forces.Gel(1e6, 0.49))
    log = found.apply(blind)
    collected, _ = collect(log, slipcore.detect_slip(log), found)
    assert collected.elements.normal_force_noise == pytest.approx(found.force_noise / np.sqrt(2.0))


def test_of_elements_forces_that_are_too_unsure_it_is_said(blind: GraspLog) -> None:
    found = reconstruct(blind, forces.Gel(1e6, 0.49))
    log, found = found.apply(blind), replace(found, deviation=np.full(found.force.shape, 0.05))
    collected, because = collect(log, slipcore.detect_slip(log), found)
    assert len(collected.samples) == 0
    assert because is not None
    assert because.startswith("elements' normal forces follow from displacement to ± ")
    assert "record the object's pose" in because


def test_of_forces_alone_it_is_said_that_they_tell_no_velocity(shop: Shop, ramp: GraspLog) -> None:
    _, job_id = shop.ingest(encode(replace(ramp, displacement=None, truth=None)))
    job = shop.run(job_id)
    assert job.status == "refused"
    assert job.reason is not None
    assert job.reason.startswith("forces alone show slip but no velocity, so there are no friction samples")
