"""What lists leave out by what was asked, and in which order they come, of rows as they are stored."""

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from sqlalchemy import update

from db.database import Database
from db.records import Actor, NewGraspLog
from db.repositories import audit, grasp_logs, jobs, materials
from db.tables import GraspLogRow, JobRow

pytestmark = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
THEN = datetime(2026, 1, 1, tzinfo=UTC)


@pytest.fixture
def ids(database: Database) -> dict[str, str]:
    """Four logs with a job each, an hour apart: of two materials, two sensors, and one of each status."""
    found: dict[str, str] = {}
    told = [("a", "paper", "left", "queued"), ("b", "paper", "right", "done"), ("c", "felt", "left", "cancelled"),
            ("d", None, "left", "done")]  # fmt: skip
    with database.write() as session:
        of = {name: materials.create(session, name, "").id for name in ("paper", "felt")}
        for hours, (name, material, sensor, status) in enumerate(told):
            key = of.get(material or "")
            content = f"{hours:064x}"
            log = grasp_logs.add(session, NewGraspLog(content, 9, "npz", "filter", key, sensor, 82, 2.75, (8, 9)))
            job = jobs.add(session, "ingest", "auto", material_id=key, grasp_log_id=log)
            at = THEN + timedelta(hours=hours)
            session.execute(update(GraspLogRow).where(GraspLogRow.id == log).values(created_at=at))
            ended = {} if status == "queued" else {"finished_at": at, "reason": None if status == "done" else "no"}
            changes: dict[str, Any] = {"status": status, "created_at": at, **ended}
            session.execute(update(JobRow).where(JobRow.id == job).values(**changes))
            found[log], found[job] = name, name
        grasp_logs.withdraw(session, next(log for log, name in found.items() if name == "b"), "wrong")
    return found


@pytest.mark.parametrize(
    ("query", "names"),
    [
        ("", "dcba"),
        ("?sort=created_at", "abcd"),
        ("?material=paper", "ba"),
        ("?material=felt", "c"),
        ("?sensor=left", "dca"),
        ("?sensor=left&material=paper", "a"),
        ("?sensor=none", ""),
        ("?status=done", "db"),
        ("?status=queued", "a"),
        ("?withdrawn=true", "b"),
        ("?withdrawn=false", "dca"),
        ("?limit=2", "dc"),
    ],
)
def test_logs_are_listed_newest_first_and_only_those_asked_for(
    reach: Callable[..., Any], ids: dict[str, str], query: str, names: str
) -> None:
    answer = reach("open").get(f"/v1/grasp-logs{query}")
    assert answer.status_code == 200, answer.text
    assert "".join(ids[item["id"]] for item in answer.json()["items"]) == names
    assert (answer.json()["next"] is not None) == (query == "?limit=2")


@pytest.mark.parametrize(
    ("query", "names"),
    [("", "dcba"), ("?sort=created_at", "abcd"), ("?status=done", "db"), ("?status=running", ""), ("?limit=1", "d")],
)
def test_jobs_are_listed_newest_first_and_only_those_asked_for(
    reach: Callable[..., Any], ids: dict[str, str], query: str, names: str
) -> None:
    items = reach("open").get(f"/v1/jobs{query}").json()["items"]
    assert "".join(ids[item["id"]] for item in items) == names


def test_a_log_is_told_as_it_is_stored(reach: Callable[..., Any], ids: dict[str, str]) -> None:
    log_id = next(each for each, name in ids.items() if name == "b")
    told = reach("open").get(f"/v1/grasp-logs/{log_id}").json()
    shown = ("material", "sensor", "frames", "duration", "grid", "format", "bytes", "has_file", "uploaded_by")
    assert [told[name] for name in shown] == ["paper", "right", 82, 2.75, [8, 9], "npz", 9, True, None]
    assert (told["withdrawal"]["reason"], told["withdrawal"]["by"]) == ("wrong", None)
    assert (told["job"]["status"], told["job"]["material"], told["detection"]) == ("done", "paper", None)
    for part in ("stick-ratio", "events", "samples"):
        problem = reach("open").get(f"/v1/grasp-logs/{log_id}/{part}").json()
        assert (problem["status"], problem["type"]) == (409, "/problems/not-ready")
    wrong = reach("open").get(f"/v1/grasp-logs/{log_id}/file?format=csv").json()
    assert wrong["detail"] == "format is csv; allowed: npz, parquet, mcap"


@pytest.mark.parametrize(
    ("query", "subjects"),
    [
        ("", ["felt", "paper", "paper"]),
        ("?actor=key:a", ["paper", "paper"]),
        ("?action=material.changed", ["felt", "paper"]),
        ("?subject=paper", ["paper", "paper"]),
        ("?subject=paper&action=material.created", ["paper"]),
        ("?subject=none", []),
        ("?limit=1", ["felt"]),
    ],
)
def test_the_trail_is_listed_newest_first_and_only_what_is_asked_for(
    reach: Callable[..., Any], database: Database, query: str, subjects: list[str]
) -> None:
    with database.write() as session:
        audit.add(session, Actor("key:a", "10.0.0.9", "r"), "material.created", "paper", {"x": 1})
        audit.add(session, Actor("key:a"), "material.changed", "paper")
        audit.add(session, Actor("anybody"), "material.changed", "felt")
    items = reach("open").get(f"/v1/audit{query}").json()["items"]
    assert [item["subject"] for item in items] == subjects
    if items and items[-1]["action"] == "material.created":
        first = items[-1]
        assert (first["actor"], first["address"], first["request_id"], first["details"]) == (
            "key:a", "10.0.0.9", "r", {"x": 1}
        )  # fmt: skip


def test_owners_are_added_once_and_removed_without_a_word(reach: Callable[..., Any], database: Database) -> None:
    with database.write() as session:
        materials.create(session, "paper", "")
    client, path = reach("open"), "/v1/materials/paper/owners"
    for _ in range(2):
        answer = client.request("PUT", f"{path}/group:lab 1")
        assert (answer.status_code, answer.json()) == (200, {"owners": ["group:lab 1"]})
    removed = client.request("DELETE", f"{path}/group:lab 1")
    assert (removed.status_code, removed.content) == (204, b"")
    assert client.request("DELETE", f"{path}/group:lab 1").json()["type"] == "/problems/unknown-owner"
    for wrong in ("lab", "key:xyz", "group: lab", "key:0123456789abc", f"group:{'a' * 101}"):
        assert client.request("PUT", f"{path}/{wrong}").status_code == 422
    assert client.request("PUT", f"{path}/group:{'a' * 100}").status_code == 200
