"""Runners that live, and what becomes of the jobs of those that do not."""

from datetime import timedelta

import pytest
from sqlalchemy import update

from db.database import Database
from db.repositories import jobs, materials, runners
from db.tables import RunnerRow, now


def test_a_runner_lives_while_it_beats(database: Database) -> None:
    with database.write() as session:
        first, second = (runners.add(session, "host:1") for _ in range(2))
        assert [runners.beat(session, first) for _ in range(3)] == [True] * 3
        beats = {runner.id: runner.beats for runner in runners.list_all(session)}
        assert beats == {first: 3, second: 0}


def test_runners_are_listed_oldest_first(database: Database) -> None:
    with database.write() as session:
        added = [runners.add(session, f"host:{number}") for number in range(3)]
        for runner_id, hours in zip(added, (2, 3, 1), strict=True):
            at = now() - timedelta(hours=hours)
            session.execute(update(RunnerRow).where(RunnerRow.id == runner_id).values(started_at=at))
        listed = runners.list_all(session)
        assert [runner.id for runner in listed] == [added[1], added[0], added[2]]
        assert [runner.name for runner in listed] == ["host:1", "host:0", "host:2"]


def test_jobs_of_a_dead_runner_are_queued_again_and_no_others(database: Database) -> None:
    with database.write() as session:
        material = materials.create(session, "paper", "")
        for _ in range(3):
            jobs.add(session, "fit", "ols", material_id=material.id)
        dead, living = (runners.add(session, name) for name in ("host:1", "host:2"))
        claims = [jobs.claim(session, runner) for runner in (dead, living, dead)]
        mine = sorted(claim.job_id for claim in claims if claim is not None and claim.runner_id == dead)
        assert sorted(runners.remove(session, dead)) == mine
        assert [runner.id for runner in runners.list_all(session)] == [living]
        assert [jobs.get(session, job_id).status for job_id in mine] == ["queued"] * 2
        assert len(jobs.claimed(session, living)) == 1
        assert not runners.beat(session, dead)
        assert runners.remove(session, dead) == []


@pytest.mark.parametrize("act", ["beat", "remove"])
def test_nobody_lives_by_an_id_that_was_never_given(database: Database, act: str) -> None:
    with database.write() as session:
        assert not getattr(runners, act)(session, "0" * 32)
