"""An unlucky operator: the database's file, the folder or the disk goes while the service runs."""

import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from pathlib import Path
from threading import Lock
from typing import Any

import httpx
import pytest
from sqlalchemy.exc import DBAPIError
from sqlalchemy.orm import Session

from db.blobs import BlobStore
from db.database import Database
from db.errors import StorageUnavailable
from db.repositories import stores
from service.observability.store_watch import StoreWatch
from service.settings import Settings

NPZ = {"content-type": "application/vnd.stiction.grasp-log+npz"}
UNAVAILABLE = (503, "/problems/storage-unavailable")


@pytest.fixture
def between_looks(monkeypatch: pytest.MonkeyPatch) -> Lock:
    """Hold it to move files one by one: a look that falls into the middle could find anything."""
    lock, look = Lock(), StoreWatch.look

    def look_alone(watch: StoreWatch) -> None:
        with lock:
            look(watch)

    monkeypatch.setattr(StoreWatch, "look", look_alone)
    return lock


@pytest.fixture
def running(
    tmp_path: Path,
    serving: Any,
    monkeypatch: pytest.MonkeyPatch,
    between_looks: Lock,  # noqa: ARG001 - there before the service begins to look
) -> Iterator[httpx.Client]:
    monkeypatch.setattr("service.observability.store_watch.LOOK_SECONDS", 0.05)
    with serving(Settings(data_folder=tmp_path / "data", workers=0)) as client:
        yield client


def send(client: httpx.Client, content: bytes) -> httpx.Response:
    return client.post("/v1/grasp-logs", content=content, headers=NPZ)


def told(response: httpx.Response) -> tuple[int, str]:
    return response.status_code, response.json().get("type", "")


def wait_for_health(client: httpx.Client, status: str) -> dict[str, Any]:
    deadline = time.monotonic() + 30.0  # pages are read at a hundredth of the time
    while (health := client.get("/healthz").raise_for_status().json())["status"] != status:
        assert time.monotonic() < deadline, health
        time.sleep(0.005)
    return dict(health)


def database_files(folder: Path) -> list[Path]:
    return list(folder.glob("stiction.sqlite3*"))


@pytest.mark.parametrize("suffixes", [("-wal",), ("-shm",), ("-wal", "-shm")])
def test_no_upload_is_accepted_into_a_deleted_write_ahead_log(
    running: httpx.Client, tmp_path: Path, content: bytes, suffixes: tuple[str, ...], between_looks: Lock
) -> None:
    log = send(running, content).raise_for_status().json()
    files = [tmp_path / "data" / f"stiction.sqlite3{suffix}" for suffix in suffixes]
    with between_looks:
        for file in files:
            file.rename(tmp_path / file.name)
    again = send(running, content)
    assert told(again) == UNAVAILABLE
    assert files[0].name in again.json()["detail"]
    assert told(running.get("/readyz")) == UNAVAILABLE
    assert not any(file.exists() for file in files)
    with between_looks:
        for file in files:
            (tmp_path / file.name).rename(file)
    assert send(running, content).raise_for_status().json()["id"] == log["id"]


@pytest.mark.parametrize("is_replaced", [False, True])
def test_no_upload_is_accepted_into_a_deleted_or_replaced_database(
    running: httpx.Client,
    tmp_path: Path,
    content: bytes,
    sqlite_template: Path,
    between_looks: Lock,
    *,
    is_replaced: bool,
) -> None:
    send(running, content).raise_for_status()
    (tmp_path / "away").mkdir()
    with between_looks:
        for file in database_files(tmp_path / "data"):
            file.rename(tmp_path / "away" / file.name)
        if is_replaced:
            shutil.copyfile(sqlite_template, tmp_path / "data" / "stiction.sqlite3")
    for _ in range(2):
        refused = send(running, content)
        assert told(refused) == UNAVAILABLE
        assert "was deleted or replaced while it was in use" in refused.json()["detail"]
    assert told(running.get("/readyz")) == UNAVAILABLE
    assert "deleted or replaced" in wait_for_health(running, "degraded")["trouble"]
    assert len(database_files(tmp_path / "data")) == is_replaced  # no empty one was made in its place
    with between_looks:
        for file in database_files(tmp_path / "away"):
            file.rename(tmp_path / "data" / file.name)
    wait_for_health(running, "ok")
    assert send(running, content).status_code == httpx.codes.OK


def test_no_upload_is_accepted_into_an_older_copy_of_the_same_size(
    running: httpx.Client, tmp_path: Path, content: bytes, between_looks: Lock
) -> None:
    """Put over the file with its inode kept, while the write-ahead log holds what came since."""
    file = tmp_path / "data" / "stiction.sqlite3"
    send(running, content).raise_for_status()
    with between_looks:
        with closing(Database(f"sqlite:///{file}")) as database:
            database.checkpoint()
            shutil.copyfile(file, tmp_path / "older")
            with database.write() as session:
                stores.touch(session)
            database.checkpoint()
        send(running, content).raise_for_status()
        size = file.stat().st_size
        shutil.copyfile(tmp_path / "older", file)
        assert file.stat().st_size == size
    assert told(send(running, content)) == UNAVAILABLE
    assert told(running.get("/readyz")) == UNAVAILABLE


def test_a_database_deleted_in_the_middle_of_a_write_is_noticed_before_the_answer(tmp_path: Path) -> None:
    with closing(Database(f"sqlite:///{tmp_path / 'stiction.sqlite3'}")) as database:

        def write() -> None:
            with database.write() as session:
                session.connection().exec_driver_sql("CREATE TABLE kept (number INTEGER)")
                (tmp_path / "stiction.sqlite3").unlink()

        with pytest.raises(StorageUnavailable, match="deleted or replaced"):
            write()


def test_another_database_under_the_same_name_takes_no_upload(
    reach: Callable[..., Any], database: Database, content: bytes
) -> None:
    """As PostgreSQL allows: dropped, made anew and restored."""
    database.store_id = "0" * 32
    with database.write() as session:
        stores.set_id(session, "1" * 32)
    refused = reach("open").request("POST", "/v1/grasp-logs", content=content, headers=NPZ)
    assert told(refused) == UNAVAILABLE
    assert "another database is in its place" in refused.json()["detail"]


def test_a_damaged_database_is_told(running: httpx.Client, tmp_path: Path, content: bytes, between_looks: Lock) -> None:
    send(running, content).raise_for_status()
    file = tmp_path / "data" / "stiction.sqlite3"
    with between_looks:
        with closing(Database(f"sqlite:///{file}")) as database, database.connect() as connection:
            emptied = connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)").one()
        with file.open("r+b") as stream:
            stream.seek(4096)
            stream.write(b"\xff" * (file.stat().st_size - 4096))
    assert emptied[0] == 0, "the log would still have the pages"
    health = wait_for_health(running, "degraded")
    assert "damaged" in health["trouble"] or "malformed" in health["trouble"]
    assert told(running.get("/readyz")) == UNAVAILABLE


def test_a_header_that_is_none_is_told_at_once(database: Database, tmp_path: Path) -> None:
    if not database.is_sqlite:
        pytest.skip("PostgreSQL keeps its own files")
    database.ping()
    with (tmp_path / "stiction.sqlite3").open("r+b") as stream:
        stream.write(b"no database" * 20)
    with pytest.raises(StorageUnavailable, match="not a database"):
        database.ping()


def test_a_missing_blob_folder_is_told_and_takes_no_upload(
    running: httpx.Client, tmp_path: Path, content: bytes
) -> None:
    folder = tmp_path / "data" / "blobs"
    folder.rename(tmp_path / "unmounted")
    folder.mkdir()  # the mount point is there, its disk is not
    assert told(running.get("/readyz")) == UNAVAILABLE
    assert "blob folder" in wait_for_health(running, "degraded")["trouble"]
    assert told(send(running, content)) == UNAVAILABLE
    assert running.get("/v1/grasp-logs").json()["items"] == []


@pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
def test_a_full_disk_of_the_database_is_told(
    database: Database, blobs: BlobStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    watch = StoreWatch(database, blobs, 0)
    watch.look()
    assert watch.trouble is None
    with database.read() as session:
        pages = session.connection().exec_driver_sql("PRAGMA page_count").scalar()
    begin = stores.touch

    def on_a_full_disk(session: Session) -> None:
        connection = session.connection()
        connection.exec_driver_sql(f"PRAGMA max_page_count = {pages}")
        connection.exec_driver_sql("CREATE TABLE needs_pages AS SELECT zeroblob(10000000)")  # more than are free
        begin(session)

    monkeypatch.setattr(stores, "touch", on_a_full_disk)
    watch.look()
    assert watch.trouble is not None
    assert "database or disk is full" in watch.trouble


def test_what_nobody_thought_of_is_trouble_and_the_watch_goes_on(database: Database, blobs: BlobStore) -> None:
    """As a table that somebody renamed, of which PostgreSQL does not say that it is unavailable."""
    watch = StoreWatch(database, blobs, 0)
    with database.write() as session:
        session.connection().exec_driver_sql("ALTER TABLE store RENAME TO away")
    with suppress(DBAPIError):  # the thread logs it, and goes on
        watch.look()
    assert watch.trouble is not None
    with database.write() as session:
        session.connection().exec_driver_sql("ALTER TABLE away RENAME TO store")
    watch.look()
    assert watch.trouble is None


def test_a_store_id_that_is_no_text_is_another_store(blobs: BlobStore, tmp_path: Path) -> None:
    blobs.store_id = "a" * 32
    (tmp_path / "blobs" / "store-id").write_bytes(b"\xff\xfe")
    with pytest.raises(StorageUnavailable, match=r"is \\xff\\xfe"):
        blobs.ping()
