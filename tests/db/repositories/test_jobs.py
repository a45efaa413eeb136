from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from threading import Barrier

import pytest
from sqlalchemy import event, select

from db.database import Database
from db.errors import ClaimLost, NotFound
from db.paging import Window
from db.records import Claim, JobOrigin, JobStatus, NewModel
from db.repositories import access_keys, friction_models, jobs, materials, runners
from db.tables import FrictionModelRow


@pytest.fixture
def job(database: Database) -> str:
    with database.write() as session:
        material = materials.create(session, "paper", "")
        return jobs.add(session, "fit", "bayes", material_id=material.id, seed=7)


def test_a_new_job_is_queued(database: Database, job: str) -> None:
    with database.read() as session:
        found = jobs.get(session, job)
    assert (found.kind, found.status, found.method, found.seed) == ("fit", "queued", "bayes", 7)
    assert (found.material, found.grasp_log_id, found.stage, found.reason) == ("paper", None, None, None)
    assert (found.seconds, found.deaths, found.model_version, found.finished_at) == ({}, 0, None, None)


def test_a_job_runs_through_its_stages_and_is_done(database: Database, job: str, claim: Callable[[], Claim]) -> None:
    mine = claim()
    with database.write() as session:
        jobs.start_stage(session, mine, "friction_model", {"frames": 0.5})
        running = jobs.get(session, job)
        jobs.finish(session, mine, "done", model_version=3, seconds={"frames": 0.5, "friction_model": 0.1})
        done = jobs.get(session, job)
        assert jobs.claimed(session, mine.runner_id) == set()
    assert (running.status, running.stage, running.seconds) == ("running", "friction_model", {"frames": 0.5})
    assert (done.status, done.stage, done.model_version) == ("done", None, 3)
    assert done.seconds == {"frames": 0.5, "friction_model": 0.1}
    assert done.finished_at is not None
    assert done.finished_at >= done.created_at


def test_a_refused_job_keeps_the_stage_and_the_reason(database: Database, job: str, claim: Callable[[], Claim]) -> None:
    mine = claim()
    with database.write() as session:
        jobs.start_stage(session, mine, "samples", {})
        jobs.finish(session, mine, "refused", reason="no slip")
        found = jobs.get(session, job)
    assert (found.status, found.stage, found.reason) == ("refused", "samples", "no slip")


def test_queued_jobs_are_claimed_oldest_first_and_each_once(database: Database, job: str) -> None:
    with database.write() as session:
        material = materials.find_id(session, "paper")
        others = [jobs.add(session, "fit", "ols", material_id=material) for _ in range(3)]
        runner = runners.add(session, "host:1")
        assert jobs.any_queued(session)
        made = [jobs.claim(session, runner) for _ in range(5)]
        assert made == [*(Claim(job_id, runner) for job_id in (job, *others)), None]
        assert jobs.claimed(session, runner) == {job, *others}
        assert not jobs.any_queued(session)


def test_runners_that_claim_at_once_get_different_jobs(database: Database, job: str) -> None:
    count = 6
    with database.write() as session:
        material = materials.find_id(session, "paper")
        ids = {job, *(jobs.add(session, "fit", "ols", material_id=material) for _ in range(count - 1))}
        names = [runners.add(session, f"host:{number}") for number in range(count)]
    barrier = Barrier(count)

    def claim(runner: str) -> str | None:
        barrier.wait()
        with database.write() as session:
            made = jobs.claim(session, runner)
        return made and made.job_id

    with ThreadPoolExecutor(count) as pool:
        assert set(pool.map(claim, names)) == ids


@pytest.mark.parametrize("taken_by", ["cancel", "death of the runner", "end"])
def test_a_runner_that_lost_its_claim_can_change_nothing(
    database: Database, job: str, claim: Callable[[], Claim], taken_by: str
) -> None:
    mine = claim()
    with database.write() as session:
        if taken_by == "cancel":
            jobs.cancel(session, job, "no longer wanted")
        elif taken_by == "end":
            jobs.finish(session, mine, "done")
        else:
            assert runners.remove(session, mine.runner_id) == [job]
        before = jobs.get(session, job)
        for change in (
            lambda: jobs.start_stage(session, mine, "samples", {}),
            lambda: jobs.finish(session, mine, "failed", reason="bug"),
            lambda: jobs.count_death(session, mine),
            lambda: jobs.release(session, mine),
        ):
            with pytest.raises(ClaimLost, match=job):
                change()
        assert jobs.get(session, job) == before


def test_jobs_of_a_dead_runner_go_to_another_and_count_no_death(
    database: Database, job: str, claim: Callable[[], Claim]
) -> None:
    first = claim()
    with database.write() as session:
        assert runners.beat(session, first.runner_id)
        assert runners.remove(session, first.runner_id) == [job]
        assert runners.remove(session, first.runner_id) == []
        assert not runners.beat(session, first.runner_id)
    second = claim()
    assert second.job_id == job
    with database.read() as session:
        assert (jobs.get(session, job).status, jobs.get(session, job).deaths) == ("running", 0)
        assert [(runner.id, runner.beats) for runner in runners.list_all(session)] == [(second.runner_id, 0)]


def test_a_death_is_counted_and_the_job_can_wait_again(
    database: Database, job: str, claim: Callable[[], Claim]
) -> None:
    mine = claim()
    with database.write() as session:
        jobs.start_stage(session, mine, "samples", {"frames": 0.5})
        assert [jobs.count_death(session, mine).deaths for _ in range(2)] == [1, 2]
        jobs.release(session, mine)
        assert (jobs.get(session, job).status, jobs.get(session, job).stage) == ("queued", "samples")


def test_a_job_is_cancelled_unless_it_has_ended(database: Database, job: str, claim: Callable[[], Claim]) -> None:
    with database.write() as session:
        cancelled = jobs.cancel(session, job, "no longer wanted")
        assert (cancelled.status, cancelled.reason) == ("cancelled", "no longer wanted")
        assert cancelled.finished_at is not None
        jobs.requeue(session, job)
    mine = claim()
    with database.write() as session:
        jobs.finish(session, mine, "failed", reason="bug")
        assert jobs.cancel(session, job, "no longer wanted").status == "failed"
        with pytest.raises(NotFound):
            jobs.cancel(session, "x", "")


def test_a_failed_job_can_be_queued_as_if_new(database: Database, job: str, claim: Callable[[], Claim]) -> None:
    with database.read() as session:
        before = jobs.get(session, job)
    mine = claim()
    with database.write() as session:
        jobs.count_death(session, mine)
        jobs.start_stage(session, mine, "samples", {})
        jobs.finish(session, mine, "failed", reason="bug")
        jobs.requeue(session, job)
        assert jobs.get(session, job) == before


def test_a_job_that_is_done_again_leaves_its_models_to_one_that_ended_as_it_had(
    database: Database, claim: Callable[[], Claim], new_model: Callable[..., NewModel]
) -> None:
    """Whoever looks up where a model is from finds what it found before."""
    with database.write() as session:
        material = materials.create(session, "paper", "").id
        for key_id in ("first", "second"):
            access_keys.add(session, key_id, key_id, "upload", key_id)
        origin = JobOrigin(requested_by="first", trace="00-1-2-00")
        job = jobs.add(session, "fit", "bayes", material_id=material, seed=7, origin=origin)
    mine = claim()
    with database.write() as session:
        friction_models.add(session, material, job, new_model())
        seconds = {"friction_model": 0.1}
        jobs.finish(session, mine, "refused", reason="too few samples", model_version=1, seconds=seconds)
        before = jobs.get(session, job)
        jobs.requeue(session, job, "second")
        (found,) = session.scalars(select(FrictionModelRow.job_id)).all()
        past, again = jobs.get(session, found), jobs.get(session, job)
    assert past == replace(before, id=found, stage=None)
    assert (found != job, again.status, again.requested_by) == (True, "queued", "second")


def test_jobs_are_listed_newest_first(database: Database, job: str, claim: Callable[[], Claim]) -> None:
    mine = claim()
    with database.write() as session:
        newer = [jobs.add(session, "fit", "ols", material_id=materials.find_id(session, "paper")) for _ in range(2)]
        jobs.finish(session, mine, "failed", reason="bug")
        assert [found.id for found in jobs.list_all(session, Window("created_at", descending=True, limit=2))] == newer[
            ::-1
        ]
        assert [(found.id, found.reason) for found in jobs.list_all(session, Window("created_at"), "failed")] == [
            (job, "bug")
        ]


def test_an_unknown_job_is_named(database: Database) -> None:
    with database.read() as session, pytest.raises(NotFound, match="no job 'x' is stored"):
        jobs.get(session, "x")


@pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
@pytest.mark.parametrize("status", [None, "failed"])
def test_the_newest_jobs_are_found_without_sorting_all(database: Database, status: JobStatus | None) -> None:
    asked: list[tuple[str, tuple[object, ...]]] = []

    def note(_connection: object, _cursor: object, statement: str, values: tuple[object, ...], *_rest: object) -> None:
        asked.append((statement, values))

    event.listen(database.engine, "before_cursor_execute", note)
    with database.read() as session:
        jobs.list_all(session, Window("created_at", descending=True, limit=20), status)
        statement, values = asked[-1]
        plan = session.connection().exec_driver_sql(f"EXPLAIN QUERY PLAN {statement}", values).all()
    assert "TEMP B-TREE" not in str(plan)
    assert "USING INDEX ix_jobs_" in str(plan)
