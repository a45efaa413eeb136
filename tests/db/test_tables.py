from collections.abc import Callable
from datetime import UTC, datetime, timedelta, timezone
from typing import Any

import pytest
from sqlalchemy import insert, select, update
from sqlalchemy.exc import IntegrityError, StatementError

from db.database import Database
from db.records import NewGraspLog, NewModel
from db.repositories import friction_models, grasp_logs, jobs, materials
from db.tables import FrictionModelRow, GraspLogRow, JobRow, MaterialRow


def test_moments_come_back_in_utc(database: Database) -> None:
    berlin = datetime(2026, 7, 1, 12, 0, tzinfo=timezone(timedelta(hours=2)))
    with database.write() as session:
        session.add(MaterialRow(name="paper", description="", created_at=berlin))
    with database.read() as session:
        found = session.scalars(select(MaterialRow.created_at)).one()
    assert found == berlin
    assert found.tzinfo is UTC


def test_a_moment_without_zone_is_refused(database: Database) -> None:
    naive = datetime(2026, 7, 1, 12, 0)
    with pytest.raises(StatementError, match="without time zone"), database.write() as session:
        session.add(MaterialRow(name="paper", description="", created_at=naive))


def test_the_database_keeps_one_current_model_a_material_and_method(
    database: Database, new_model: Callable[..., NewModel]
) -> None:
    with database.write() as session:
        material = materials.create(session, "paper", "")
        for _ in range(2):
            job = jobs.add(session, "fit", "ols", material_id=material.id)
            friction_models.add(session, material.id, job, new_model())
    with pytest.raises(IntegrityError, match=r"(?i)unique"), database.write() as session:
        session.execute(update(FrictionModelRow).values(current=True))


def test_a_row_cannot_refer_to_a_material_that_is_not_there(database: Database) -> None:
    with pytest.raises(IntegrityError, match=r"(?i)foreign key"), database.write() as session:
        jobs.add(session, "fit", "ols", material_id=77)


@pytest.mark.parametrize(
    "wrong",
    [
        {"status": "sleeping"},
        {"kind": "guess"},
        {"status": "failed", "finished_at": datetime.now(UTC)},
        {"status": "done"},
        {"status": "cancelled", "finished_at": datetime.now(UTC)},
        {"status": "running"},
        {"kind": "ingest"},
        {"material_id": None},
    ],
    ids=[
        "status",
        "kind",
        "failed without reason",
        "done without end",
        "cancelled without reason",
        "running without runner",
        "ingest without log",
        "fit without material",
    ],
)
def test_the_database_refuses_a_job_that_cannot_be(database: Database, wrong: dict[str, Any]) -> None:
    with database.write() as session:
        material = materials.create(session, "paper", "")
        jobs.add(session, "fit", "ols", material_id=material.id)
    with pytest.raises(IntegrityError, match=r"(?i)check"), database.write() as session:
        session.execute(update(JobRow).values(**wrong))


def test_a_log_without_material_is_stored_once(database: Database, new_log: Callable[..., NewGraspLog]) -> None:
    with database.write() as session:
        log_id = grasp_logs.add(session, new_log(sha256="a" * 64))
        sensor = session.scalars(select(GraspLogRow.sensor_id)).one()
        columns = {"sha256": "a" * 64, "bytes": 1, "format": "npz", "detector": "strain_rate", "frames": 2}
        with pytest.raises(IntegrityError, match=r"(?i)unique"), session.begin_nested():
            session.execute(
                insert(GraspLogRow).values(
                    id="other", sensor_id=sensor, duration=1.0, grid_rows=1, grid_columns=1, **columns
                )
            )
        assert list(session.scalars(select(GraspLogRow.id))) == [log_id]
