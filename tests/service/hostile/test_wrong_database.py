"""An unlucky operator: the service started with the wrong database, or in the wrong folder. No file may be lost."""

import asyncio
import shutil
from collections.abc import Callable
from contextlib import AbstractContextManager, closing
from pathlib import Path
from typing import Any

import httpx
import pytest
from sqlalchemy import inspect

from db import migrate
from db.blobs import BlobStore
from db.database import Database
from db.errors import StoreMismatch
from db.records import Claim
from service.app import running
from service.cli import main
from service.jobs import worker
from service.settings import Settings

NPZ = {"content-type": "application/vnd.stiction.grasp-log+npz"}
Serving = Callable[[Settings], AbstractContextManager[httpx.Client]]


@pytest.fixture
def right(tmp_path: Path, serving: Serving, content: bytes) -> Settings:
    """A service that has stored a log."""
    settings = Settings(data_folder=tmp_path / "data", workers=0)
    with serving(settings) as client:
        client.post("/v1/grasp-logs", content=content, headers=NPZ).raise_for_status()
    return settings


def start(settings: Settings) -> None:
    async def start_and_stop() -> None:
        async with running(settings):
            pass

    asyncio.run(start_and_stop())


def files(settings: Settings) -> set[str]:
    return set(BlobStore(settings.data_folder).hashes())


@pytest.mark.parametrize("has_id", [True, False])
def test_a_start_with_a_wrong_database_is_refused_and_loses_nothing(
    right: Settings, tmp_path: Path, *, has_id: bool
) -> None:
    before = files(right)
    assert before
    if not has_id:  # as versions before this left it
        (right.data_folder / "blobs" / "store-id").unlink()
    wrong = right.model_copy(update={"database_url": f"sqlite:///{tmp_path / 'wrong.sqlite3'}"})
    with pytest.raises(StoreMismatch, match=r"wrong\.sqlite3 .*allowed: name the database and the data folder"):
        start(wrong)
    assert files(right) == before
    assert not (tmp_path / "wrong.sqlite3").exists()


def test_an_empty_database_is_not_made_beside_a_service_without_uploads(tmp_path: Path) -> None:
    """It may have keys, owners and materials already."""
    new = Settings(data_folder=tmp_path / "data", workers=0)
    start(new)
    before = files(new)
    wrong = new.model_copy(update={"database_url": f"sqlite:///{tmp_path / 'wrong.sqlite3'}"})
    with pytest.raises(StoreMismatch, match="of no store yet"):
        start(wrong)
    assert files(new) == before
    assert not (tmp_path / "wrong.sqlite3").exists()
    start(new)


def test_an_empty_database_beside_files_stays_empty(right: Settings, tmp_path: Path) -> None:
    (right.data_folder / "blobs" / "store-id").unlink()
    wrong = right.model_copy(update={"database_url": f"sqlite:///{tmp_path / 'wrong.sqlite3'}"})
    with closing(Database(wrong.resolved_database_url)) as database, database.connect() as connection:
        with pytest.raises(StoreMismatch, match=r"refers to none; allowed: .*stiction db restore --take-over"):
            start(wrong)
        assert inspect(connection).get_table_names() == []


def test_a_lost_database_in_the_folder_is_not_made_anew(right: Settings) -> None:
    before = files(right)
    for file in right.data_folder.glob("stiction.sqlite3*"):
        file.unlink()
    with pytest.raises(StoreMismatch, match="of no store yet"):
        start(right)
    assert files(right) == before


def test_a_second_server_on_the_database_wants_its_folder(right: Settings, tmp_path: Path) -> None:
    url = right.resolved_database_url
    with pytest.raises(StoreMismatch, match="of no store yet"):
        start(Settings(data_folder=tmp_path / "other", database_url=url, workers=0))


def test_a_worker_process_in_another_folder_takes_no_job(right: Settings, tmp_path: Path) -> None:
    """Such as one of a Dask cluster, on a machine where that folder is another."""
    config = worker.StoreConfig(right.resolved_database_url, tmp_path / "other")
    with pytest.raises(StoreMismatch, match="of no store yet"):
        worker.run_job(config, Claim("0" * 32, "1" * 32))


def test_a_store_of_before_is_taken_over_without_a_hand(right: Settings, serving: Serving, content: bytes) -> None:
    (right.data_folder / "blobs" / "store-id").unlink()
    with closing(Database(right.resolved_database_url)) as database, database.write() as session:
        session.connection().exec_driver_sql("DELETE FROM store")
    with serving(right) as client:
        (log,) = client.get("/v1/grasp-logs").json()["items"]
        assert client.get(f"/v1/grasp-logs/{log['id']}/file").content == content


@pytest.mark.parametrize(
    "command",
    [("serve",), ("worker",), ("db", "check"), ("db", "backup", "COPY"), ("blobs", "prune", "--delete")],
    ids=lambda command: " ".join(command),
)
def test_each_command_refuses_by_name_with_its_exit_code(
    right: Settings,
    tmp_path: Path,
    command: tuple[str, ...],
    sqlite_template: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    caplog: pytest.LogCaptureFixture,
) -> None:
    before = files(right)
    wrong = tmp_path / "wrong.sqlite3"
    shutil.copyfile(sqlite_template, wrong)
    monkeypatch.setenv("STICTION_DATA_FOLDER", str(right.data_folder))
    monkeypatch.setenv("STICTION_DATABASE_URL", f"sqlite:///{wrong}")
    monkeypatch.setattr("service.cli.running._prepare", lambda _: None)  # the log of this process stays its own
    with pytest.raises(SystemExit) as ending:
        main([str(tmp_path / "copy") if part == "COPY" else part for part in command])
    told = capsys.readouterr().err + caplog.text
    assert (ending.value.code, "Traceback" in told) == (3, False)
    assert f"database sqlite:///{wrong} is of no store yet, and blob folder" in told
    assert files(right) == before


def test_a_store_can_be_joined_by_hand(
    right: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    moved = tmp_path / "moved"
    right.data_folder.rename(moved)
    (moved / "blobs" / "store-id").unlink()
    monkeypatch.setenv("STICTION_DATA_FOLDER", str(moved))
    with pytest.raises(StoreMismatch):
        start(Settings(workers=0))
    with pytest.raises(SystemExit) as ending:
        main(["db", "adopt"])
    assert ending.value.code == 0
    assert "1 of 1 files that rows refer to are there" in capsys.readouterr().out
    start(Settings(workers=0))


def test_joining_an_empty_database_tells_what_that_means_and_what_to_do(
    right: Settings,
    tmp_path: Path,
    sqlite_template: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    shutil.copyfile(sqlite_template, tmp_path / "wrong.sqlite3")
    monkeypatch.setenv("STICTION_DATA_FOLDER", str(right.data_folder))
    with pytest.raises(SystemExit) as ending:
        main(["db", "adopt", "--database-url", f"sqlite:///{tmp_path / 'wrong.sqlite3'}"])
    told = capsys.readouterr()
    assert (ending.value.code, "0 of 0 files that rows refer to are there" in told.out) == (0, True)
    assert "the 1 files there belong to none" in told.err
    assert "stiction db restore --take-over" in told.err


def test_the_same_holds_for_an_object_store(s3: Any, tmp_path: Path, serving: Serving, content: bytes) -> None:
    right = Settings(data_folder=tmp_path / "data", blob_url="s3://grasps/lab", workers=0)
    with serving(right) as client:
        client.post("/v1/grasp-logs", content=content, headers=NPZ).raise_for_status()
    before = set(s3.objects)
    assert any(key.endswith("store-id") for key in before)
    with pytest.raises(StoreMismatch, match="s3://grasps/lab of store"):
        start(Settings(data_folder=tmp_path / "other", blob_url="s3://grasps/lab", workers=0))
    assert set(s3.objects) == before
    start(right)


@pytest.mark.parametrize("revision", ["0005", "0011"])
def test_a_refused_start_leaves_the_schema_of_the_wrong_database(
    right: Settings, tmp_path: Path, revision: str
) -> None:
    wrong = right.model_copy(update={"database_url": f"sqlite:///{tmp_path / 'wrong.sqlite3'}"})
    with closing(Database(wrong.resolved_database_url)) as database:
        migrate.upgrade(database, revision)
        with pytest.raises(StoreMismatch):
            start(wrong)
        assert migrate.current(database) == revision
