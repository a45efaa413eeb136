"""Which of two copies of one log a material keeps after a merge."""

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest
from sqlalchemy import update
from sqlalchemy.orm import Session

from db.database import Database
from db.errors import NotFound
from db.records import Detection, NewGraspLog, SampleSummary
from db.repositories import copies, detections, grasp_logs, jobs, materials, materials_of_logs
from db.tables import GraspLogRow, JobRow, MaterialRow

pytestmark = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
THEN = datetime(2026, 1, 1, tzinfo=UTC)
Add = Callable[..., str]


@pytest.fixture
def add(detection: Detection, samples: SampleSummary) -> Add:
    """Store a log of one content, whose job ended so many hours after a moment, with so many samples or none."""

    def store(
        session: Session, material: int, ended: str = "done", hours: float | None = 0.0, count: int | None = 9,
        content: str = "1" * 64, samples_blob: str = "2" * 64, detector: str = "filter",
    ) -> str:  # fmt: skip
        log = NewGraspLog(content, 10, "npz", detector, material, "left", 9, 1.0, (2, 2))
        log_id = grasp_logs.add(session, log)
        job = jobs.add(session, "ingest", "ols", material_id=material, grasp_log_id=log_id)
        if hours is not None:
            reason = None if ended == "done" else "none"
            changes = {"status": ended, "reason": reason, "finished_at": THEN + timedelta(hours=hours)}
            session.execute(update(JobRow).where(JobRow.id == job).values(**changes))
        if count is not None:
            found = replace(samples, count=count, none_because=None if count else "none", samples_blob=samples_blob)
            detections.add(session, log_id, replace(detection, history_blob="3" * 64), found)
        session.flush()
        return log_id

    return store


@pytest.mark.parametrize(
    ("own", "copy", "changes"),
    [
        ({"count": None, "ended": "failed"}, {}, True),
        ({"count": None, "ended": "cancelled"}, {"hours": -1.0}, True),
        ({"count": None, "ended": "refused"}, {"hours": -1.0}, False),
        ({"count": 0}, {"hours": 1.0}, True),
        ({"count": 0}, {"hours": -1.0}, False),
        ({"count": 0}, {"count": 0, "hours": 1.0}, False),
        ({"count": None, "ended": "failed"}, {"count": None, "hours": None}, True),
        ({"count": None, "ended": "failed"}, {"count": None, "ended": "failed", "hours": 1.0}, False),
        ({"count": None, "hours": None}, {}, False),
        ({}, {"hours": 1.0}, False),
        ({}, {"hours": 1.0, "samples_blob": "4" * 64}, True),
        ({}, {"hours": -1.0, "samples_blob": "4" * 64}, False),
        ({}, {"count": 0, "hours": 1.0, "samples_blob": "4" * 64}, False),
        ({"count": None, "ended": "failed"}, {"detector": "force_ratio"}, False),
        ({"count": None, "ended": "failed"}, {"content": "5" * 64}, False),
    ],
)
def test_the_copy_that_has_samples_or_the_latest_ones_is_kept(
    database: Database, add: Add, own: dict[str, object], copy: dict[str, object], changes: bool
) -> None:
    with database.write() as session:
        paper, felt = (materials.create(session, name, "").id for name in ("paper", "felt"))
        mine, other = add(session, paper, **own), add(session, felt, **copy)
        copies.exchange(session, paper, felt)
        now_of = [materials_of_logs.get(session, each) for each in (mine, other)]
        assert now_of == ([felt, paper] if changes else [paper, felt])
        assert grasp_logs.get(session, mine).sha256 == "1" * 64


@pytest.mark.parametrize("which", [0, 1])
def test_a_copy_that_was_withdrawn_takes_no_place_and_gives_none(database: Database, add: Add, which: int) -> None:
    with database.write() as session:
        paper, felt = (materials.create(session, name, "").id for name in ("paper", "felt"))
        both = add(session, paper, count=None, ended="failed"), add(session, felt)
        grasp_logs.withdraw(session, both[which], "wrong")
        copies.exchange(session, paper, felt)
        assert [materials_of_logs.get(session, each) for each in both] == [paper, felt]


def test_one_that_a_merge_left_behind_stands_in(database: Database, add: Add) -> None:
    """Of several the one with samples; of a material that was not merged none."""
    with database.write() as session:
        paper, felt, wood, steel = (materials.create(session, name, "").id for name in ("a", "b", "c", "d"))
        mine = add(session, paper, count=None, ended="failed")
        without, good, foreign = add(session, felt, count=None, hours=None), add(session, wood), add(session, steel)
        for merged in (felt, wood):
            session.execute(update(MaterialRow).where(MaterialRow.id == merged).values(merged_into_id=paper))
        assert copies.stand_in(session, mine) == good
        places = [materials_of_logs.get(session, each) for each in (mine, without, good, foreign)]
        assert places == [wood, felt, paper, steel]
        assert copies.stand_in(session, good) is None


def test_a_log_is_held_with_its_material(database: Database, add: Add) -> None:
    with database.write() as session:
        paper = materials.create(session, "paper", "").id
        log = add(session, paper)
        assert materials_of_logs.hold(session, log) == materials_of_logs.get(session, log) == paper
        session.execute(update(GraspLogRow).where(GraspLogRow.id == log).values(material_id=None))
        assert materials_of_logs.hold(session, log) is None
        for look in (materials_of_logs.get, materials_of_logs.hold):
            with pytest.raises(NotFound, match="no grasp log 'none'"):
                look(session, "none")
