"""A disk that fails between any two system calls, at each point once: nothing is lost, and nothing half is kept.

At a third of the points in ``make test``, at all of them in long tests.
"""

import hashlib
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

import httpx
import pytest
from sqlalchemy import func, select

import slipcore
from db import backup as copies
from db import migrate
from db.backup import FILE, LEFT_OUT, backup, restore
from db.blobs import BlobStore
from db.database import Database
from db.errors import DatabaseError, NotEmpty, StorageUnavailable
from db.records import Claim
from db.repositories import blobs as references
from db.repositories import jobs, runners
from db.tables import Base, FrictionModelRow, GraspLogRow, JobRow
from service.jobs import worker
from slipcore import GraspLog
from tests.service.grasps import another_grasp, same_grasp

FAULTS = ("EIO", "ENOSPC", "short write")
NPZ = {"content-type": "application/vnd.stiction.grasp-log+npz"}
MOST_POINTS = 2000
"""Only against a loop without end."""

pytestmark = [
    pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True),
    pytest.mark.parametrize(
        ("fault", "stride"), [("EIO", 3), *(pytest.param(each, 1, marks=pytest.mark.long) for each in FAULTS)]
    ),
]


@pytest.fixture
def database(layer: Any, new_url: Callable[..., str], tmp_path: Path) -> Iterator[Database]:
    assert layer.at == -1
    with closing(Database(new_url(tmp_path))) as database:
        yield database


def each_point(layer: Any, fault: str, stride: int) -> Iterator[int]:
    """Arm the layer for one point after the other, or every third of them, until a run passes fewer than that."""
    for at in range(0, MOST_POINTS, stride):
        layer.arm(at, fault)
        yield at
        if layer.disarm() is None:
            assert at > 5, "the run passes next to no points"
            return
    raise AssertionError("the run has no end of points")


def check_sound(database: Database, blobs: BlobStore) -> None:
    """Every file has the bytes of its name; every row has its files; every log has its job."""
    for sha256 in blobs.hashes():
        assert hashlib.sha256(blobs.locate(sha256).read_bytes()).hexdigest() == sha256
    with database.read() as session:
        assert set(references.all_referenced(session)) <= set(blobs.hashes())
        assert set(session.scalars(select(JobRow.grasp_log_id))) - {None} == set(
            session.scalars(select(GraspLogRow.id))
        )
        assert session.connection().exec_driver_sql("PRAGMA integrity_check").scalar() == "ok"


def test_an_upload_is_stored_as_a_whole_or_refused(
    layer: Any, fault: str, stride: int, reach: Callable[..., Any], database: Database, blobs: BlobStore, content: bytes
) -> None:
    caller = reach("open")

    def send(body: bytes) -> httpx.Response:
        answer: httpx.Response = caller.request("POST", "/v1/grasp-logs", content=body, headers=NPZ)
        return answer

    for at in each_point(layer, fault, stride):
        body = same_grasp(content, at)  # another log each time
        answer = send(body)
        point = layer.disarm()
        layer.fired = point
        if answer.is_error:
            assert (answer.status_code, answer.json()["type"]) == (503, "/problems/storage-unavailable"), point
        check_sound(database, blobs)
        again = send(body)
        assert again.status_code == (200 if answer.is_success or point == "after commit" else again.status_code), point
        log = again.raise_for_status().json()
        assert caller.get(f"/v1/grasp-logs/{log['id']}/file").content == body
    left = list((blobs._spool).iterdir())
    assert len(left) <= 1  # where it was the removal that failed; a start clears it


@pytest.fixture
def quick_numerics(ramp: GraspLog, monkeypatch: pytest.MonkeyPatch) -> None:
    """The results of one log for all of them: faults are what is tried."""
    history = slipcore.detect_slip(ramp)
    samples = slipcore.collect_samples(ramp, history)
    monkeypatch.setattr(slipcore, "detect_slip", lambda *_, **__: history)
    monkeypatch.setattr(slipcore, "collect_samples", lambda *_, **__: samples)


@pytest.mark.long
@pytest.mark.usefixtures("quick_numerics")
def test_a_job_stores_its_results_once_and_whole(
    layer: Any,
    fault: str,
    stride: int,
    reach: Callable[..., Any],
    database: Database,
    blobs: BlobStore,
    content: bytes,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    caller = reach("open")
    caller.request("POST", "/v1/materials", json={"name": "paper"})
    monkeypatch.setattr(worker, "_stores", lambda _: (database, blobs))
    config = worker.StoreConfig(database.url, tmp_path)

    def claim() -> Claim:
        with database.write() as session:
            made = jobs.claim(session, runners.add(session, "host:1"))
        assert made is not None
        return made

    for at in each_point(layer, fault, stride):
        layer.disarm()
        query = {"material": "paper"}
        body = another_grasp(content, at // 2 + 1)  # every second one is a copy, which does not count
        body = same_grasp(body, at % 2)
        log = caller.request("POST", "/v1/grasp-logs", params=query, content=body, headers=NPZ).json()
        claimed = claim()
        layer.arm(at, fault)
        with suppress(StorageUnavailable):
            worker.run_job(config, claimed)
        layer.at = -1
        check_sound(database, blobs)
        with database.write() as session:
            job = jobs.get(session, claimed.job_id)
            if job.status == "running":
                jobs.release(session, claimed)
        if job.status == "running":
            worker.run_job(config, claim())
        after = caller.get(f"/v1/jobs/{log['job']['id']}").json()
        assert (after["status"], after["reason"]) == ("done", None), layer.fired
        with database.read() as session:
            stored = session.execute(
                select(FrictionModelRow.method, func.count())
                .where(FrictionModelRow.job_id == claimed.job_id)
                .group_by(FrictionModelRow.method)
            ).all()
            current = session.execute(
                select(FrictionModelRow.method, func.count())
                .where(FrictionModelRow.current)
                .group_by(FrictionModelRow.method)
            ).all()
        assert stored, layer.fired
        assert set(stored) == set(current) == {(method, 1) for method, _ in stored}, layer.fired


def rows(database: Database) -> dict[str, list[Any]]:
    with database.read() as session:
        return {
            table.name: [tuple(row) for row in session.execute(select(table).order_by(*table.primary_key))]
            for table in Base.metadata.sorted_tables
            if table.name not in LEFT_OUT
        }


def nothing(what: str, count: int) -> None:
    pass


@pytest.fixture
def migrated_at_once(layer: Any, sqlite_template: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """New databases get their tables in one step, whose statements are not the ones to be tried."""
    content = sqlite_template.read_bytes()

    def upgrade(database: Database) -> None:
        file = Path(str(database.engine.url.database))
        if not file.exists() or file.stat().st_size == 0:
            at, layer.at = layer.at, -1
            file.write_bytes(content)
            layer.at = at

    monkeypatch.setattr(migrate, "upgrade", upgrade)
    monkeypatch.setattr(migrate, "check", lambda _: None)


@pytest.fixture
def filled(reach: Callable[..., Any], database: Database, blobs: BlobStore, content: bytes) -> Database:
    caller = reach("open")
    for number in range(2):
        caller.request("POST", "/v1/grasp-logs", content=same_grasp(content, number), headers=NPZ).raise_for_status()
    assert len(list(blobs.hashes())) == 2
    return database


@pytest.mark.usefixtures("migrated_at_once")
def test_a_backup_is_complete_or_none(
    layer: Any, fault: str, stride: int, filled: Database, blobs: BlobStore, tmp_path: Path
) -> None:
    wanted = rows(filled)
    for at in each_point(layer, fault, stride):
        folder = tmp_path / f"copy {at}"
        with suppress(DatabaseError, OSError):
            backup(filled, blobs, folder, nothing)
        point = layer.disarm()
        if not (folder / FILE).exists():
            backup(filled, blobs, folder, nothing)
        layer.fired = point
        with closing(copies._opened(folder / FILE)) as copy:
            assert rows(copy) == wanted, point
            check_sound(copy, BlobStore(folder))


@pytest.mark.usefixtures("migrated_at_once")
def test_a_restore_brings_everything_or_can_be_done_again(
    layer: Any, fault: str, stride: int, filled: Database, blobs: BlobStore, tmp_path: Path
) -> None:
    wanted = rows(filled)
    backup(filled, blobs, tmp_path / "copy", nothing)
    for at in each_point(layer, fault, stride):
        target = tmp_path / f"restored {at}"
        layer.at = -1
        again = BlobStore(target)
        with closing(Database(f"sqlite:///{target / 'stiction.sqlite3'}")) as database:
            layer.arm(at, fault)
            with suppress(DatabaseError, OSError):
                restore(tmp_path / "copy", database, again, nothing)
            layer.at = -1
            with suppress(NotEmpty):  # only the answer was lost
                restore(tmp_path / "copy", database, again, nothing)
            assert rows(database) == wanted, layer.fired
            check_sound(database, again)
