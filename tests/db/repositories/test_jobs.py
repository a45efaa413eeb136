import pytest

from db.database import Database
from db.errors import NotFound
from db.repositories import jobs, materials


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


def test_a_job_runs_through_its_stages_and_is_done(database: Database, job: str) -> None:
    with database.write() as session:
        jobs.start_stage(session, job, "friction_model", {"frames": 0.5})
        running = jobs.get(session, job)
        jobs.finish(session, job, "done", model_version=3, seconds={"frames": 0.5, "friction_model": 0.1})
        done = jobs.get(session, job)
    assert (running.status, running.stage, running.seconds) == ("running", "friction_model", {"frames": 0.5})
    assert (done.status, done.stage, done.model_version) == ("done", None, 3)
    assert done.seconds == {"frames": 0.5, "friction_model": 0.1}
    assert done.finished_at is not None
    assert done.finished_at >= done.created_at


def test_a_refused_job_keeps_the_stage_and_the_reason(database: Database, job: str) -> None:
    with database.write() as session:
        jobs.start_stage(session, job, "samples", {})
        jobs.finish(session, job, "refused", reason="no slip")
        found = jobs.get(session, job)
    assert (found.status, found.stage, found.reason) == ("refused", "samples", "no slip")


def test_unfinished_jobs_are_the_queued_and_the_running_oldest_first(database: Database, job: str) -> None:
    with database.write() as session:
        material = materials.find_id(session, "paper")
        others = [jobs.add(session, "fit", "ols", material_id=material) for _ in range(3)]
        jobs.start_stage(session, others[0], "frames", {})
        jobs.finish(session, others[1], "failed", reason="bug")
        assert jobs.unfinished(session) == [job, others[0], others[2]]


def test_a_death_is_counted_and_the_job_waits_again(database: Database, job: str) -> None:
    with database.write() as session:
        jobs.start_stage(session, job, "samples", {"frames": 0.5})
        assert [jobs.count_death(session, job).deaths for _ in range(2)] == [1, 2]
        assert jobs.get(session, job).status == "queued"


def test_a_failed_job_can_be_queued_as_if_new(database: Database, job: str) -> None:
    with database.write() as session:
        before = jobs.get(session, job)
        jobs.count_death(session, job)
        jobs.start_stage(session, job, "samples", {})
        jobs.finish(session, job, "failed", reason="bug")
        jobs.requeue(session, job)
        assert jobs.get(session, job) == before


def test_an_unknown_job_is_named(database: Database) -> None:
    with database.read() as session, pytest.raises(NotFound, match="no job 'x' is stored"):
        jobs.get(session, "x")
