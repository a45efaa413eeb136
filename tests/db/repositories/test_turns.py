import re
from typing import Any

import pytest
from sqlalchemy import event, insert, select, text
from sqlalchemy.orm import Session

from db.database import Database
from db.records import Claim, JobOrigin
from db.repositories import access_keys, jobs, materials, runners
from db.tables import JobRow, MaterialRow

SMALL, LARGE = "a" * 12, "b" * 12
WAITING = 10_000
ALL_OF_THEM = re.compile("Seq Scan|-> +Sort |^SCAN jobs$|TEMP B-TREE FOR ORDER BY")
"""What plans say where each of the jobs is looked at, or brought into order."""


@pytest.fixture
def paper(database: Database) -> int:
    with database.write() as session:
        for key in (SMALL, LARGE):
            access_keys.add(session, key, "robot", "upload", "0" * 64)
        return materials.create(session, "paper", "").id


def add(session: Session, material: int, count: int, key: str | None = None, *, is_long: bool = False) -> list[str]:
    return [
        jobs.add(session, "fit", "ols", material_id=material, origin=JobOrigin(None, key), is_long=is_long)
        for _ in range(count)
    ]


def served(session: Session) -> list[str]:
    """The queued jobs in the order in which one runner does them."""
    runner, done = runners.add(session, "host:1"), []
    while claim := jobs.claim(session, runner):
        done.append(claim.job_id)
        jobs.finish(session, claim, "done")
    return done


def test_a_key_with_one_job_goes_before_the_second_of_one_that_has_many(database: Database, paper: int) -> None:
    with database.write() as session:
        many = add(session, paper, 20, LARGE)
        one = add(session, paper, 2, SMALL)
        assert served(session)[:4] == [many[0], one[0], many[1], one[1]]


def test_a_new_key_waits_for_one_job_of_a_key_that_is_served_already(database: Database, paper: int) -> None:
    with database.write() as session:
        many, runner = add(session, paper, 20, LARGE), runners.add(session, "host:1")
        for expected in many[:5]:
            claim = jobs.claim(session, runner)
            assert claim is not None
            assert claim.job_id == expected
        (one,) = add(session, paper, 1, SMALL)
        assert one in served(session)[:2]


def test_materials_of_one_key_take_turns(database: Database, paper: int) -> None:
    with database.write() as session:
        felt = materials.create(session, "felt", "").id
        many, one = add(session, paper, 20), add(session, felt, 1)
        assert served(session)[:3] == [many[0], one[0], many[1]]


def test_many_materials_give_a_key_no_more_turns(database: Database, paper: int) -> None:
    with database.write() as session:
        many = [add(session, materials.create(session, f"felt {number}", "").id, 1, LARGE)[0] for number in range(20)]
        (one,) = add(session, paper, 1, SMALL)
        assert one in served(session)[:2]
        assert len(many) == 20


def test_a_job_that_goes_before_an_older_one_of_its_key_takes_that_ones_turn(database: Database, paper: int) -> None:
    with database.write() as session:
        card = materials.create(session, "card", "").id
        first, second = add(session, paper, 2, LARGE)
        (other,) = add(session, card, 1, LARGE)
        small = add(session, paper, 3, SMALL)
        assert served(session) == [first, small[0], other, small[1], second, small[2]]


def test_short_jobs_do_not_wait_behind_long_ones(database: Database, paper: int) -> None:
    with database.write() as session:
        long = add(session, paper, 5, is_long=True)
        short = add(session, paper, 5)
        order = served(session)
        assert order[:6] == [*short, long[0]] or order[:6] == [long[0], *short]
        assert order[6:] == long[1:]


def test_a_claim_of_short_jobs_passes_over_long_ones_of_every_key(database: Database, paper: int) -> None:
    with database.write() as session:
        add(session, paper, 3, LARGE, is_long=True)
        add(session, paper, 1, SMALL, is_long=True)
        short, runner = add(session, paper, 2, LARGE), runners.add(session, "host:1")
        assert jobs.any_queued(session, only_short=True)
        claims = [jobs.claim(session, runner, only_short=True) for _ in range(3)]
        assert claims == [Claim(job, runner, is_long=False) for job in short] + [None]
        assert not jobs.any_queued(session, only_short=True)
        rest = jobs.claim(session, runner)
        assert rest is not None
        assert rest.is_long


def test_a_short_job_that_is_served_before_its_turn_keeps_no_other_key_back(database: Database, paper: int) -> None:
    with database.write() as session:
        many, runner = add(session, paper, 20, LARGE, is_long=True), runners.add(session, "host:1")
        add(session, paper, 5, LARGE)
        assert jobs.claim(session, runner) == Claim(many[0], runner, is_long=True)
        assert jobs.claim(session, runner, only_short=True) is not None
        (one,) = add(session, paper, 1, SMALL, is_long=True)
        assert one in served(session)[:2]


@pytest.mark.parametrize("long_ones_wait", [0, pytest.param(3, marks=pytest.mark.long)])
@pytest.mark.parametrize("one_runs", [True, False])
def test_nor_does_a_long_one_let_a_new_key_overtake_those_whose_short_jobs_were_served_meanwhile(
    database: Database, paper: int, long_ones_wait: int, one_runs: bool
) -> None:
    with database.write() as session:
        runner = runners.add(session, "host:1")
        add(session, paper, 1 + long_ones_wait, is_long=True)
        assert jobs.claim(session, runner) is not None
        many = add(session, paper, 32, LARGE)
        for _ in range(20):
            claim = jobs.claim(session, runner, only_short=True)
            assert claim is not None
            jobs.finish(session, claim, "done")
        if one_runs:
            assert jobs.claim(session, runner, only_short=True) is not None
        new = add(session, paper, 12, SMALL)
        (long,) = add(session, paper, 1, SMALL, is_long=True)
        done = []
        while claim := jobs.claim(session, runner, only_short=True):
            done.append(claim.job_id)
            jobs.finish(session, claim, "done")
        assert sum(job in many for job in done[:10]) >= 4
        assert sum(job in new for job in done[:10]) >= 4
        assert long in served(session)


def test_long_jobs_of_a_new_key_wait_a_long_step_for_each_other_while_one_runs_that_began_long_ago(
    database: Database, paper: int
) -> None:
    """Ten short jobs of another key in each, however far behind the turn is in which the one that runs began."""
    with database.write() as session:
        runner = runners.add(session, "host:1")
        add(session, paper, 1, is_long=True)
        assert jobs.claim(session, runner) is not None
        add(session, paper, 45, LARGE)
        for _ in range(20):
            claim = jobs.claim(session, runner, only_short=True)
            assert claim is not None
            jobs.finish(session, claim, "done")
        long = add(session, paper, 3, SMALL, is_long=True)
        order = served(session)
        assert [order.index(job) for job in long] == [0, 11, 22]


@pytest.mark.parametrize("engine_name", ["postgresql"], indirect=True)
def test_a_claim_does_not_wait_for_a_merge(database: Database, paper: int) -> None:
    """It would, with a job's row locked for which the merge waits in turn."""
    with database.write() as session:
        felt = materials.create(session, "felt", "").id
        runner = runners.add(session, "host:1")
        add(session, paper, 3)
        add(session, felt, 1)
        assert jobs.claim(session, runner) is not None
    with database.write() as merging:
        merging.execute(select(MaterialRow).with_for_update()).all()
        with database.write() as session:
            session.execute(text("SET LOCAL lock_timeout = '2s'"))
            claim = jobs.claim(session, runner)
            assert claim is not None
            assert jobs.get(session, claim.job_id).material == "felt"  # that changed turns with one of paper


def test_a_job_that_is_tried_again_waits_as_a_new_one(database: Database, paper: int) -> None:
    with database.write() as session:
        (first,) = add(session, paper, 1, LARGE)
        assert served(session) == [first]
        others = add(session, paper, 2, LARGE)
        jobs.requeue(session, first, requested_by=LARGE)
        assert served(session) == [*others, first]


def plans(session: Session, statements: list[tuple[str, Any]]) -> list[str]:
    """How the database goes about what it is asked of the jobs."""
    explain = "EXPLAIN QUERY PLAN " if session.get_bind().dialect.name == "sqlite" else "EXPLAIN "
    asked = [(explain + statement, values) for statement, values in statements if "FROM jobs" in statement]
    return [str(row[-1]) for each in asked for row in session.connection().exec_driver_sql(*each)]


def test_the_next_job_is_found_by_an_index_among_ten_thousand(database: Database, paper: int) -> None:
    fit = {"kind": "fit", "status": "queued", "seconds": {}, "method": "ols", "seed": 0, "material_id": paper}
    asked: list[tuple[str, Any]] = []
    with database.write() as session:
        turns = [{"id": f"{k:032}", "turn": 2 * k, "turn_within_key": 2 * k} for k in range(WAITING)]
        rows = [fit | {"requested_by": LARGE} | each for each in turns]
        session.execute(insert(JobRow), rows)
    with database.write() as session:
        runner = runners.add(session, "host:1")
        session.execute(text("ANALYZE jobs"))
        event.listen(session.connection(), "before_cursor_execute", lambda *given: asked.append(given[2:4]))
        add(session, paper, 1, SMALL)
        assert jobs.claim(session, runner) is not None
        found = plans(session, list(asked))
    assert len(found) >= 8
    assert not [line for line in found if ALL_OF_THEM.search(line)], found
