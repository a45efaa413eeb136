"""What a key has asked for and stored, and which of its files may go."""

from collections.abc import Callable
from dataclasses import replace
from datetime import datetime, timedelta
from typing import Any

import pytest
from sqlalchemy import update

from db.database import Database
from db.records import Actor, JobOrigin, NewGraspLog
from db.repositories import access_keys, audit, grasp_logs, jobs, materials, owners, runners, stores, uploads, usage
from db.tables import GraspLogRow, JobRow, StoreRow, now

Store = Callable[..., str]


@pytest.fixture
def store(database: Database, new_log: Callable[..., NewGraspLog]) -> Store:
    """Store a log with a job, and set columns of either."""
    with database.write() as session:
        for number, name in enumerate(("k", "other")):
            access_keys.add(session, name, "robot", "upload", f"{number:064}")

    def add(sha256: str | None = None, key: str | None = "k", job: str = "done", size: int = 10, **columns: Any) -> str:
        with database.write() as session:
            material = columns.pop("of", None)
            log_id = grasp_logs.add(session, replace(new_log(material, sha256), uploaded_by=key, bytes=size))
            of = {"material_id": material, "grasp_log_id": log_id, "origin": JobOrigin(requested_by=key)}
            job_id = jobs.add(session, "ingest", "ols", **of)
            ended = None if job in {"queued", "running"} else now()
            by = runners.add(session, "here") if job == "running" else None
            reason = "told" if job in {"refused", "failed", "cancelled"} else None
            row = {"status": job, "finished_at": ended, "runner_id": by, "reason": reason}
            session.execute(update(JobRow).where(JobRow.id == job_id).values(**row))
            if columns:
                session.execute(update(GraspLogRow).where(GraspLogRow.id == log_id).values(**columns))
        return log_id

    return add


def test_queued_jobs_are_those_that_wait_and_of_the_key_alone(database: Database, store: Store) -> None:
    for key, status in (("k", "queued"), ("k", "queued"), ("k", "running"), ("other", "queued"), (None, "queued")):
        store(key=key, job=status)
    with database.read() as session:
        assert (usage.queued_jobs(session, "k"), usage.queued_jobs(session, "x")) == (2, 0)


def test_logs_count_from_the_moment_on(database: Database, store: Store) -> None:
    moment = now() - timedelta(hours=1)
    for since in (moment - timedelta(microseconds=1), moment, moment + timedelta(minutes=1)):
        store(created_at=since)
    store(key="other")
    with database.read() as session:
        assert usage.logs_since(session, "k", moment) == 2


def test_bytes_are_of_files_that_are_still_there(database: Database, store: Store) -> None:
    store(size=7)
    store(size=5)
    store(size=3, file_state="gone")
    store(size=2, key="other")
    with database.read() as session:
        assert (usage.stored_bytes(session, "k"), usage.stored_bytes(session, "x")) == (12, 0)


def test_changes_are_those_of_some_kinds_by_the_key(database: Database) -> None:
    with database.write() as session:
        for actor, action in (
            ("key:k", "material.created"),
            ("key:k", "material.changed"),
            ("key:k", "job.cancelled"),
            ("key:other", "material.created"),
        ):
            audit.add(session, Actor(actor), action, "paper", {})  # type: ignore[arg-type]
    kinds = ("material.created", "material.changed")
    with database.read() as session:
        assert usage.changes_since(session, "k", kinds, now() - timedelta(hours=1)) == 2  # type: ignore[arg-type]
        assert usage.changes_since(session, "k", kinds[:1], now() - timedelta(hours=1)) == 1  # type: ignore[arg-type]
        assert usage.changes_since(session, "k", kinds, now() + timedelta(hours=1)) == 0  # type: ignore[arg-type]


@pytest.fixture
def before() -> datetime:
    return now() - timedelta(days=30)


def test_a_file_may_go_that_is_older_and_whose_job_has_ended(
    database: Database, store: Store, before: datetime
) -> None:
    older, as_old = before - timedelta(microseconds=1), before
    for status in ("done", "refused", "cancelled"):
        store(job=status, file_since=older)
    for status in ("queued", "running", "failed"):
        store(job=status, file_since=older)
    store(file_since=as_old)
    store(file_since=older, file_state="gone")
    with database.read() as session:
        assert uploads.count_old(session, before) == (3, 30)


def test_one_content_is_one_file_which_stays_while_any_log_needs_it(
    database: Database, store: Store, before: datetime
) -> None:
    older, shared, twice = before - timedelta(days=1), "5" * 64, "7" * 64
    with database.write() as session:
        paper, felt = (materials.create(session, name, "").id for name in ("paper", "felt"))
    store(shared, file_since=older, of=paper)
    store(shared, file_since=now(), of=felt)
    store(twice, file_since=older, of=paper)
    store(twice, file_since=older, of=felt)
    with database.write() as session:
        assert uploads.count_old(session, before) == (1, 10)
        assert uploads.mark(session, before, 9) == 1
        assert uploads.leaving(session, 9) == [twice]
        assert [sha256 for _, sha256 in uploads.note_gone(session, [twice])] == [twice, twice]
        assert uploads.leaving(session, 9) == []
        assert uploads.bring_back(session, twice)
        assert not uploads.bring_back(session, twice)


def test_the_oldest_go_first_and_so_many_at_once(database: Database, store: Store, before: datetime) -> None:
    hashes = [f"{digit}" * 64 for digit in (3, 1, 2)]
    for days, sha256 in enumerate(hashes, 1):
        store(sha256, file_since=before - timedelta(days=days))
    with database.write() as session:
        assert uploads.mark(session, before, 2) == 2
        assert sorted(uploads.leaving(session, 9)) == sorted(hashes[1:])
        assert len(uploads.leaving(session, 1)) == 1


def test_a_marked_file_that_a_new_log_needs_is_spared(database: Database, store: Store, before: datetime) -> None:
    needed, left = "a" * 64, "b" * 64
    with database.write() as session:
        material = materials.create(session, "paper", "").id
    for sha256 in (needed, left):
        store(sha256, file_since=before - timedelta(days=1))
    with database.write() as session:
        assert uploads.mark(session, before, 9) == 2
    store(needed, of=material)
    with database.write() as session:
        assert uploads.spare_needed(session, [needed, left]) == [left]
        assert uploads.leaving(session, 9) == [left]


def test_the_newest_log_is_known_by_its_time(database: Database, store: Store) -> None:
    with database.read() as session:
        assert uploads.newest(session) is None
    moment = now() - timedelta(days=2)
    store(created_at=moment)
    store(created_at=moment - timedelta(days=1))
    with database.read() as session:
        assert uploads.newest(session) == moment


def test_owners_stand_by_name_each_once_and_go_once(database: Database) -> None:
    with database.write() as session:
        material = materials.create(session, "paper", "").id
        other = materials.create(session, "felt", "").id
        assert [owners.add(session, material, name) for name in ("key:b", "group:a", "key:b")] == [True, True, False]
        assert owners.of_material(session, material) == ["group:a", "key:b"]
        assert owners.of_material(session, other) == []
        assert not owners.remove(session, other, "key:b")
        assert [owners.remove(session, material, "key:b") for _ in range(2)] == [True, False]
        assert owners.of_material(session, material) == ["group:a"]


def test_a_runner_beats_until_it_is_taken_off_and_its_jobs_wait_again(database: Database, store: Store) -> None:
    store(job="queued")
    with database.write() as session:
        first, second = runners.add(session, "one"), runners.add(session, "two")
        claim = jobs.claim(session, first)
        assert claim is not None
        assert [runners.beat(session, first) for _ in range(2)] == [True, True]
        assert {runner.name: runner.beats for runner in runners.list_all(session)} == {"one": 2, "two": 0}
        assert runners.remove(session, first) == [claim.job_id]
        assert jobs.get(session, claim.job_id).status == "queued"
        assert runners.remove(session, first) == []
        assert not runners.beat(session, first)
        assert [runner.id for runner in runners.list_all(session)] == [second]


def test_what_the_webhook_has_had_only_grows(database: Database) -> None:
    with database.write() as session:
        stores.set_id(session, "0" * 32)
        session.execute(update(StoreRow).values(webhook_entry_id=None))
        assert stores.webhook_entry(session) is None
        stores.set_webhook_entry(session, 7, None)
        stores.set_webhook_entry(session, 9, 5)
        assert stores.webhook_entry(session) == 7
        stores.set_webhook_entry(session, 9, 7)
        assert stores.webhook_entry(session) == 9
        assert stores.find_id(session) == "0" * 32
