import json
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from typing import Any

import httpx
import pytest
from sqlalchemy import select, update

from db import migrate, tables
from db.blobs import BlobStore, Spool, open_blobs
from db.database import Database
from db.errors import SchemaMismatch
from db.paging import Window
from db.records import AuditFilter, Claim
from db.repositories import audit, jobs, uploads
from db.repositories import blobs as references
from db.tables import AuditEntryRow, GraspLogRow, JobRow, now
from service import formats
from service.cli import main
from service.http.download import Download
from service.http.routes import grasp_logs
from service.jobs import pipeline, retention, steady_clock
from service.jobs.retention import Retention, prune
from service.settings import Settings
from slipcore import GraspLog
from stiction_client.container import encode
from tests.service.jobs import clocks as clocks_of_tests
from tests.service.jobs.clocks import vouch_for_the_clock
from tests.waiting import wait_until

NPZ = {"content-type": "application/vnd.stiction.grasp-log+npz"}
AGE = timedelta(days=90)
ONLY_SQLITE = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)


class Killed(BaseException):
    """The process is no more: nothing in it goes on."""


class Shelf:
    """Uploads to an application whose jobs are done by hand."""

    def __init__(self, client: Any, database: Database, blobs: BlobStore) -> None:
        self.client, self.database, self.blobs = client, database, blobs
        client.request("POST", "/v1/materials", json={"name": "paper"})

    def upload(self, content: bytes, detector: str = "filter") -> httpx.Response:
        query = {"material": "paper", "detector": detector}
        answer: httpx.Response = self.client.request(
            "POST", "/v1/grasp-logs", params=query, content=content, headers=NPZ
        )
        return answer

    def store(self, content: bytes, days: float, status: str = "done", detector: str = "filter") -> str:
        """A log of some age with an end of its job."""
        log_id: str = self.upload(content, detector).raise_for_status().json()["id"]
        ended = None if status == "queued" else now()
        with self.database.write() as session:
            since = update(GraspLogRow).where(GraspLogRow.id == log_id).values(file_since=now() - timedelta(days=days))
            session.execute(since)
            end = update(JobRow).where(JobRow.grasp_log_id == log_id)
            session.execute(end.values(status=status, finished_at=ended, reason="because" if ended else None))
        return log_id

    def prune(self) -> int:
        return prune(self.database, self.blobs, now() - AGE)

    def file(self, log_id: str) -> httpx.Response:
        answer: httpx.Response = self.client.get(f"/v1/grasp-logs/{log_id}/file")
        return answer

    def is_sound(self) -> bool:
        """Whether every file that a log refers to is there, and every other is not."""
        with self.database.read() as session:
            return set(references.all_referenced(session)) == set(self.blobs.hashes())


@pytest.fixture
def shelf(reach: Callable[..., Any], database: Database, blobs: BlobStore) -> Shelf:
    return Shelf(reach("open"), database, blobs)


@pytest.fixture
def other_content(ramp: GraspLog) -> bytes:
    return encode(replace(ramp, sensor="other"))


def test_an_old_upload_goes_and_comes_back_while_its_log_stays(shelf: Shelf, content: bytes) -> None:
    log_id = shelf.store(content, days=91)
    assert shelf.file(log_id).content == content
    assert (shelf.prune(), shelf.prune()) == (1, 0)
    gone = shelf.file(log_id)
    assert (gone.status_code, gone.json()["type"]) == (410, "/problems/file-deleted")
    log = shelf.client.get(f"/v1/grasp-logs/{log_id}").json()
    assert (log["has_file"], log["bytes"]) == (False, len(content))
    figures = shelf.client.get("/metrics").text
    assert "stiction_deleted_uploads 1.0" in figures
    assert "stiction_upload_bytes 0.0" in figures
    assert shelf.is_sound()
    (entry,) = shelf.client.get("/v1/audit?action=grasp_log.file_deleted").json()["items"]
    assert (entry["actor"], entry["subject"], entry["details"]) == ("service", log_id, {"sha256": log["sha256"]})

    again = shelf.upload(content)
    assert (again.status_code, again.json()["id"], again.json()["has_file"]) == (200, log_id, True)
    assert shelf.file(log_id).content == content
    assert shelf.prune() == 0  # its age counts from now
    assert shelf.is_sound()


def test_what_was_found_in_an_upload_serves_every_fit_without_it(
    shelf: Shelf, content: bytes, claim: Callable[[], Claim]
) -> None:
    log_id = shelf.upload(content).json()["id"]
    pipeline.run_job(shelf.database, shelf.blobs, claim())
    with shelf.database.write() as session:
        session.execute(update(GraspLogRow).values(file_since=now() - 2 * AGE))
    assert shelf.prune() == 1
    for method in ("ols", "robust"):
        job = shelf.client.request("POST", "/v1/materials/paper/fits", json={"method": method}).json()["id"]
        pipeline.run_job(shelf.database, shelf.blobs, claim())
        assert shelf.client.get(f"/v1/jobs/{job}").json()["status"] == "done"
    for result in ("stick-ratio", "events", "samples"):
        assert shelf.client.get(f"/v1/grasp-logs/{log_id}/{result}").status_code == httpx.codes.OK


@pytest.mark.parametrize(
    ("days", "status", "goes"),
    [(91, "refused", True), (91, "cancelled", True), (89, "done", False), (91, "queued", False), (91, "failed", False)],
)
def test_only_what_is_old_and_done_with_goes(
    shelf: Shelf, content: bytes, days: float, status: str, goes: bool
) -> None:
    log_id = shelf.store(content, days, status)
    assert shelf.prune() == goes
    assert (shelf.file(log_id).status_code == httpx.codes.GONE) == goes
    assert shelf.is_sound()


def test_a_file_stays_while_a_younger_log_shares_it(shelf: Shelf, content: bytes, other_content: bytes) -> None:
    old = shelf.store(content, days=91)
    alone = shelf.store(other_content, days=91)
    young = shelf.store(content, days=1, detector="strain_rate")
    assert shelf.prune() == 1
    assert [shelf.file(each).status_code for each in (old, young, alone)] == [200, 200, 410]
    third = shelf.upload(other_content, detector="strain_rate")
    assert third.status_code == httpx.codes.ACCEPTED
    assert shelf.file(alone).content == other_content  # of every log of this content
    assert shelf.is_sound()


@pytest.mark.parametrize("when", ["before", "after"])
def test_whoever_is_killed_at_it_leaves_the_rest_to_the_next(
    shelf: Shelf, content: bytes, monkeypatch: pytest.MonkeyPatch, when: str
) -> None:
    log_id, remove = shelf.store(content, days=91), shelf.blobs.remove

    def die(hashes: list[str]) -> None:
        if when == "after":
            remove(hashes)
        raise Killed

    monkeypatch.setattr(shelf.blobs, "remove", die)
    with pytest.raises(Killed):
        shelf.prune()
    assert shelf.file(log_id).status_code == httpx.codes.GONE
    monkeypatch.undo()
    assert shelf.prune() == 1
    assert shelf.is_sound()


def test_a_file_that_comes_back_before_it_is_deleted_stays(shelf: Shelf, content: bytes) -> None:
    log_id = shelf.store(content, days=91)
    with shelf.database.write() as session:
        assert uploads.mark(session, now() - AGE, 10) == 1
    assert shelf.upload(content).status_code == httpx.codes.OK
    assert shelf.prune() == 0
    assert shelf.file(log_id).content == content


def test_a_log_that_comes_after_the_mark_keeps_the_file(shelf: Shelf, content: bytes) -> None:
    log_id = shelf.store(content, days=91)
    with shelf.database.write() as session:
        uploads.mark(session, now() - AGE, 10)
        row = session.scalars(select(GraspLogRow)).one()
        other = {name: getattr(row, name) for name in GraspLogRow.__table__.columns.keys()}  # noqa: SIM118
        session.add(GraspLogRow(**other | {"id": "0" * 32, "detector": "new", "file_state": None, "file_since": now()}))
        session.flush()
        jobs.add(session, "ingest", "ols", material_id=row.material_id, grasp_log_id="0" * 32)
    assert shelf.prune() == 0
    assert shelf.file(log_id).content == content


def test_an_upload_whose_file_is_deleted_under_it_is_asked_to_come_again(
    shelf: Shelf, content: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    log_id, keep = shelf.store(content, days=91), Spool.keep

    def keep_and_lose(spool: Spool) -> str:
        kept = keep(spool)
        assert shelf.prune() == 1
        return kept

    monkeypatch.setattr(Spool, "keep", keep_and_lose)
    refused = shelf.upload(content)
    assert (refused.status_code, refused.headers["retry-after"]) == (503, "1")
    monkeypatch.undo()
    assert shelf.upload(content).status_code == httpx.codes.OK
    assert shelf.file(log_id).content == content


@ONLY_SQLITE
def test_files_of_an_object_store_go_from_there_and_from_the_cache(
    reach: Callable[..., Any], database: Database, tmp_path: Path, s3: Any, content: bytes
) -> None:
    client, blobs = reach("open"), open_blobs(tmp_path, "s3://grasps/lab", 2**20)
    client.app.state.context = replace(client.app.state.context, blobs=blobs)
    shelf = Shelf(client, database, blobs)
    log_id = shelf.store(content, days=91)
    assert len(s3.objects) == 1
    assert shelf.prune() == 1
    assert not s3.objects
    assert not [path for path in (tmp_path / "blobs").rglob("*") if path.is_file()]
    assert shelf.upload(content).status_code == httpx.codes.OK
    assert shelf.file(log_id).content == content


def test_a_server_deletes_old_uploads_by_itself(
    tmp_path: Path, database: Database, serving: Any, content: bytes, upload: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(retention, "LOOK_SECONDS", 0.02)
    settings = Settings(
        data_folder=tmp_path, database_url=database.url, keep_uploads_days=90, lease_seconds=0.5, shutdown_seconds=0
    )
    with serving(settings) as client:
        vouch_for_the_clock(database)
        log = upload(client, content).json()["id"]
        with database.write() as session:
            session.execute(update(GraspLogRow).values(file_since=now() - 2 * AGE))
            done = update(JobRow).values(status="done", finished_at=now(), runner_id=None)
            session.execute(done)
        wait_until(lambda: client.get(f"/v1/grasp-logs/{log}/file").status_code == httpx.codes.GONE, "the file to go")
        assert client.get(f"/v1/grasp-logs/{log}").status_code == httpx.codes.OK, "what is known of the log stays"


@ONLY_SQLITE
def test_a_file_that_goes_while_it_is_sent_is_sent_whole(
    shelf: Shelf, content: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = shelf.store(content, 100.0)

    class Slow(Download):
        async def __call__(self, *asgi: Any) -> None:
            assert shelf.prune() == 1
            await super().__call__(*asgi)

    monkeypatch.setattr(grasp_logs, "Download", Slow)
    assert shelf.file(log).content == content
    assert shelf.file(log).status_code == httpx.codes.GONE


@ONLY_SQLITE
def test_a_file_that_goes_before_it_is_sent_is_gone(
    shelf: Shelf, content: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = shelf.store(content, 100.0)

    def identify(path: Path) -> str:  # noqa: ARG001
        assert shelf.prune() == 1
        return "npz"

    monkeypatch.setattr(formats, "identify", identify)
    assert shelf.file(log).json()["type"] == "/problems/file-deleted"


@ONLY_SQLITE
def test_the_command_counts_and_deletes(
    shelf: Shelf, content: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def run(*options: str) -> tuple[int, str]:
        with pytest.raises(SystemExit) as ending:
            main(["blobs", "prune", "--database-url", shelf.database.url, *options])
        return int(ending.value.code or 0), capsys.readouterr().out

    monkeypatch.setenv("STICTION_DATA_FOLDER", str(tmp_path))
    log_id = shelf.store(content, days=1.5)
    assert run("--older-than", "2d", "--dry-run")[1] == "0 uploads (0 bytes) would be deleted\n"
    assert run("--older-than", "12h", "--dry-run")[1] == f"1 uploads ({len(content)} bytes) would be deleted\n"
    told = json.loads(run("--older-than", "12h", "--dry-run", "--json")[1])
    assert told == {"deleted": False, "uploads": {"files": 1, "bytes": len(content)}}
    assert shelf.file(log_id).status_code == httpx.codes.OK
    assert run("--older-than", "12h")[1] == f"deleted 1 uploads ({len(content)} bytes)\n"
    assert shelf.file(log_id).status_code == httpx.codes.GONE
    for wrong in ("90", "-1d", "1w", "", "800000d", "１d"):
        assert run("--older-than", wrong)[0] == 2
    monkeypatch.setenv("STICTION_KEEP_UPLOADS_DAYS", "1")
    for options in ([], ["--dry-run"]):
        code, told = run(*options)
        assert (code, told.splitlines()[0]) == (0, "0 uploads (0 bytes) would be deleted")


@ONLY_SQLITE
def test_the_command_deletes_by_no_clock_that_is_far_ahead(
    shelf: Shelf, content: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Four fresh uploads had gone by one that was 200 days ahead."""

    def run(*options: str) -> tuple[int, str]:
        with pytest.raises(SystemExit) as ending:
            main(["blobs", "prune", "--database-url", shelf.database.url, "--older-than", "90d", *options])
        return int(ending.value.code or 0), " ".join(capsys.readouterr().err.replace("│", " ").split())

    monkeypatch.setenv("STICTION_DATA_FOLDER", str(tmp_path))
    log_id = shelf.store(content, days=0)
    for module in (steady_clock, tables):
        monkeypatch.setattr(module, "now", lambda: now() + timedelta(days=200))
    code, told = run()
    assert (code, "--trust-clock" in told, "the newest log is of" in told) == (2, True, True)
    assert run("--delete")[0] == 2
    assert run("--dry-run")[0] == 0
    assert shelf.file(log_id).status_code == httpx.codes.OK
    assert run("--trust-clock")[0] == 0
    assert shelf.file(log_id).status_code == httpx.codes.GONE


def test_logs_of_before_have_their_files_and_those_without_stop_the_way_back(shelf: Shelf, content: bytes) -> None:
    log_id = shelf.store(content, days=91)
    migrate.downgrade(shelf.database, "0006", lose=True)
    migrate.upgrade(shelf.database)
    with shelf.database.read() as session:
        row = session.get_one(GraspLogRow, log_id)
        assert (row.file_state, row.file_since) == (None, row.created_at)
    with shelf.database.write() as session:
        session.execute(update(GraspLogRow).values(file_since=now() - 2 * AGE))
    assert shelf.prune() == 1
    with closing(Database(shelf.database.url)) as database, pytest.raises(SchemaMismatch, match="1 grasp logs have no"):
        migrate.downgrade(database, "0006")


def test_nothing_is_deleted_by_a_clock_that_jumps(
    shelf: Shelf, content: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    log_id = shelf.store(content, days=1)
    vouch_for_the_clock(shelf.database)
    kept = Retention(shelf.database, shelf.blobs, 90.0, lambda: True)
    kept._look()
    for module in (retention, steady_clock):
        monkeypatch.setattr(module, "now", lambda: now() + timedelta(days=200))
    for _ in range(3):
        kept._look()
    assert shelf.file(log_id).status_code == httpx.codes.OK


def test_old_entries_of_the_audit_trail_are_deleted_where_that_is_set(database: Database, blobs: BlobStore) -> None:
    with database.write() as session:
        for days in (31, 29):
            entry = AuditEntryRow(at=now() - timedelta(days=days), actor="service", action="x", subject="y", details={})
            session.add(entry)
    vouch_for_the_clock(database)
    for policy, left in ((None, 2), (30.0, 2)):  # one goes, and one that tells so comes
        Retention(database, blobs, None, lambda: True, audit_days=policy)._look()
        with database.read() as session:
            found = audit.list_all(session, Window("id"), AuditFilter())
        assert len(found) == left
    assert found[-1].action == "audit.deleted"


def test_an_entry_made_while_the_clock_was_behind_stays(database: Database) -> None:
    """It had gone a day after the clock was right again. One made while it was ahead keeps no other from going."""
    with database.write() as session:
        for subject, days in (("first", 500), ("ahead", -3650), ("near", 50), ("behind", 400), ("last", 1)):
            at = now() - timedelta(days=days)
            session.add(AuditEntryRow(at=at, actor="service", action="x", subject=subject, details={}))
            session.flush()
        assert audit.delete_before(session, now() - timedelta(days=365)) == 1
        assert audit.delete_before(session, now() - timedelta(days=30)) == 2
        left = audit.list_all(session, Window("id"), AuditFilter(action="x"))
    assert sorted(entry.subject for entry in left) == ["ahead", "last"]


def test_whoever_leads_looks_at_the_clock_also_where_all_is_kept(
    database: Database, blobs: BlobStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else a webhook's entry that was refused for good stopped all others, once retention had been on."""
    vouch_for_the_clock(database)
    for module in (retention, steady_clock):
        monkeypatch.setattr(module, "now", lambda: now() + timedelta(days=30))
    kept = Retention(database, blobs, None, lambda: True)
    monkeypatch.setattr(kept._thread, "start", lambda: started.append(True))
    started: list[bool] = []
    with database.read() as session:
        assert "a server last saw" in (steady_clock.doubt(session) or "")
    kept.start()
    kept._look()
    with database.read() as session:
        assert "has been watched for less than a day" in (steady_clock.doubt(session) or "")
    assert started


def test_a_process_that_comes_to_lead_does_not_go_by_its_look_of_before(
    database: Database, blobs: BlobStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The clock had jumped meanwhile, which another one had seen: it was steady for a day since."""
    later = Retention(database, blobs, None, lambda: True)
    vouch_for_the_clock(database)
    later._look()
    for module in (retention, steady_clock, clocks_of_tests):
        monkeypatch.setattr(module, "now", lambda: now() + timedelta(hours=3))
    vouch_for_the_clock(database)
    later._look()
    with database.read() as session:
        assert steady_clock.doubt(session) is None
