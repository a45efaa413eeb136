"""How much a key may have, and when its transactions wait for one another."""

from collections.abc import Callable
from dataclasses import replace
from datetime import timedelta
from typing import Any

import pytest
from sqlalchemy import func, select, update
from sqlalchemy.orm import Session

from db.database import Database
from db.records import AuditAction, JobOrigin, NewGraspLog
from db.repositories import access_keys, grasp_logs, jobs, materials
from db.tables import AuditEntryRow, GraspLogRow, now
from service.domain.access import quotas
from service.domain.errors import QuotaExceeded, StorageQuotaExceeded
from service.settings import Settings


@pytest.mark.parametrize("quota", ["key_queued_jobs", "key_logs_a_day", "key_stored_bytes", "key_changes_a_day"])
@pytest.mark.parametrize(("key_id", "is_set", "locked"), [("a", True, ["a"]), ("a", False, []), (None, True, [])])
def test_a_key_is_locked_only_where_something_of_it_is_counted(
    monkeypatch: pytest.MonkeyPatch, quota: str, key_id: str | None, is_set: bool, locked: list[str]
) -> None:
    asked: list[str] = []
    monkeypatch.setattr(quotas.access_keys, "lock", lambda _, key: asked.append(key))
    session: Any = None
    quotas.lock(session, Settings(**({quota: 5} if is_set else {})), key_id)
    assert asked == locked


KEY, OTHER = "a" * 12, "b" * 12


@pytest.fixture
def keys(database: Database) -> Database:
    with database.write() as session:
        for key_id in (KEY, OTHER):
            access_keys.add(session, key_id, "robot", "upload", "0" * 64)
    return database


def queue(session: Session, key_id: str | None, count: int) -> None:
    """So many jobs of a key, and one of another and one of nobody."""
    material = materials.create(session, "paper", "").id
    for each in (*[key_id] * count, OTHER, None):
        jobs.add(session, "fit", "ols", material_id=material, origin=JobOrigin(None, each))


@pytest.mark.parametrize("check", [quotas.check_job, quotas.check_upload])
def test_as_many_jobs_of_a_key_wait_as_may(keys: Database, check: Callable[..., None]) -> None:
    with keys.write() as session:
        queue(session, KEY, 2)
        check(session, Settings(key_queued_jobs=3), KEY)
        check(session, Settings(key_queued_jobs=2), None)
        check(session, Settings(), KEY)
        with pytest.raises(QuotaExceeded) as refusal:
            check(session, Settings(key_queued_jobs=2), KEY)
    assert str(refusal.value) == "queued jobs of this key are 2; allowed: 2 (STICTION_KEY_QUEUED_JOBS)"
    assert refusal.value.retry_seconds == 10


def send(session: Session, key_id: str | None, hours: float = 0.0, state: str | None = None) -> NewGraspLog:
    """A log of 1,000 bytes that somebody has sent so long ago."""
    count = session.scalar(select(func.count()).select_from(GraspLogRow)) or 0
    log = NewGraspLog(f"{count:064x}", 1000, "npz", "filter", None, "left", 9, 1.0, (8, 8), uploaded_by=key_id)
    log_id = grasp_logs.add(session, log)
    at = now() - timedelta(hours=hours)
    changed = update(GraspLogRow).where(GraspLogRow.id == log_id)
    session.execute(changed.values(created_at=at, file_state=state))
    return log


def test_logs_of_a_key_are_counted_for_a_day(keys: Database) -> None:
    with keys.write() as session:
        for key_id, hours in [(KEY, 0.0), (KEY, 23.9), (KEY, 24.1), (OTHER, 0.0), (None, 0.0)]:
            sent = send(session, key_id, hours)
        quotas.check_upload(session, Settings(key_logs_a_day=3), KEY)
        quotas.check_upload(session, Settings(key_logs_a_day=2), OTHER)
        quotas.check_log(session, Settings(key_logs_a_day=2), KEY, sent)  # it is stored already
        quotas.check_log(session, Settings(), KEY, replace(sent, sha256="f" * 64))
        quotas.check_log(session, Settings(key_logs_a_day=2), None, replace(sent, sha256="f" * 64))
        for check in (
            lambda: quotas.check_upload(session, Settings(key_logs_a_day=2), KEY),
            lambda: quotas.check_log(session, Settings(key_logs_a_day=2), KEY, replace(sent, sha256="f" * 64)),
        ):
            with pytest.raises(QuotaExceeded) as refusal:
                check()
            told = "logs of the last 24 hours of this key are 2; allowed: 2 (STICTION_KEY_LOGS_A_DAY)"
            assert (str(refusal.value), refusal.value.retry_seconds) == (told, 3600)


def test_bytes_of_a_key_are_those_of_files_that_are_there(keys: Database) -> None:
    with keys.write() as session:
        for key_id, state in [(KEY, None), (KEY, None), (KEY, "gone"), (OTHER, None)]:
            send(session, key_id, 100.0, state)
        quotas.check_upload(session, Settings(key_stored_bytes=2001), KEY)
        with pytest.raises(StorageQuotaExceeded) as refusal:
            quotas.check_upload(session, Settings(key_stored_bytes=2000), KEY)
    assert (refusal.value.name, refusal.value.value) == ("bytes stored by this key", "2000")
    assert refusal.value.allowed == "less than 2000 (STICTION_KEY_STORED_BYTES), before another log"


@pytest.mark.parametrize("action", ["material.created", "grasp_log.withdrawn", "sensor.described", "fit.requested"])
def test_changes_of_a_key_are_counted_for_a_day_and_what_takes_away_is_none(
    keys: Database, action: AuditAction
) -> None:
    said: list[tuple[str, AuditAction, float]] = [
        (f"key:{KEY}", action, 0.0),
        (f"key:{KEY}", action, 23.9),
        (f"key:{KEY}", action, 24.1),
        (f"key:{KEY}", "owner.removed", 0.0),
        (f"key:{OTHER}", action, 0.0),
        ("service", action, 0.0),
    ]
    with keys.write() as session:
        for actor, what, hours in said:
            session.add(
                AuditEntryRow(actor=actor, action=what, subject="x", details={}, at=now() - timedelta(hours=hours))
            )
        session.flush()
        quotas.check_change(session, Settings(key_changes_a_day=3), KEY)
        quotas.check_change(session, Settings(key_changes_a_day=2), None)
        quotas.check_change(session, Settings(), KEY)
        with pytest.raises(QuotaExceeded) as refusal:
            quotas.check_change(session, Settings(key_changes_a_day=2), KEY)
    told = "changes of materials, sensors and stored logs, and fits, in the last 24 hours of this key are 2; allowed: 2"
    assert str(refusal.value) == f"{told} (STICTION_KEY_CHANGES_A_DAY)"
    assert refusal.value.retry_seconds == 3600
