import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from types import SimpleNamespace
from typing import Any

import httpx
import pytest
from prometheus_client import generate_latest
from prometheus_client.parser import text_string_to_metric_families

from db.database import Database
from db.repositories import jobs, materials, runners
from service.observability import metrics
from service.observability.metrics import Metrics


def read(text: str) -> dict[tuple[str, ...], float]:
    """Value of each sample, by its name and the values of its labels."""
    return {
        (sample.name, *sample.labels.values()): sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }


def test_requests_are_told_by_the_path_of_their_route(client: httpx.Client, material: str) -> None:
    before = read(client.get("/metrics").text)
    for name in (material, "no such", "nor such"):
        client.get(f"/v1/materials/{name}")
    client.get("/nowhere")
    after = read(client.get("/metrics").text)
    route = ("stiction_request_seconds_count", "GET", "/v1/materials/{name}")

    def more(*key: str) -> float:
        return after.get(key, 0.0) - before.get(key, 0.0)

    assert (more(*route, "200"), more(*route, "404")) == (1.0, 2.0)
    assert more("stiction_request_seconds_count", "GET", "none", "404") == 1.0
    assert not [key for key in after if "no such" in " ".join(key)]


def test_jobs_are_told_with_their_stages_and_each_once(client: httpx.Client, material: str, content: bytes) -> None:
    headers = {"content-type": "application/vnd.stiction.grasp-log+npz"}
    before = read(client.get("/metrics").text)
    job = client.post("/v1/grasp-logs", params={"material": material}, content=content, headers=headers).json()["job"]
    while client.get(f"/v1/jobs/{job['id']}").json()["finished_at"] is None:
        time.sleep(0.02)
    for _ in range(2):
        after = read(client.get("/metrics").text)
        for key in [
            ("stiction_job_seconds_count", "ingest", "done"),
            ("stiction_job_stage_seconds_count", "ingest", "slip_state"),
            ("stiction_job_stage_seconds_count", "ingest", "friction_model"),
            ("stiction_grasp_logs",),
        ]:
            assert after[key] - before.get(key, 0.0) == 1.0, key
    assert after[("stiction_upload_bytes",)] - before[("stiction_upload_bytes",)] == len(content)
    assert after[("stiction_jobs", "queued")] == after[("stiction_jobs", "running")] == 0.0


def test_jobs_that_wait_and_run_are_counted_and_those_of_before_are_not(database: Database) -> None:
    with database.write() as session:
        material = materials.create(session, "paper", "")
        for _ in range(4):
            jobs.add(session, "fit", "ols", material_id=material.id)
        runner = runners.add(session, "host:1")
        claim = jobs.claim(session, runner)
        assert claim is not None
        jobs.finish(session, claim, "done")
        jobs.claim(session, runner)
    found = read(Metrics().expose(database).decode())
    assert (found["stiction_jobs", "queued"], found["stiction_jobs", "running"]) == (2.0, 1.0)
    assert ("stiction_job_seconds_count", "fit", "done") not in found


def test_metrics_need_a_key_from_elsewhere(reach: Callable[..., object]) -> None:
    assert reach().get("/metrics").status_code == httpx.codes.UNAUTHORIZED  # type: ignore[attr-defined]


def ended(job_id: str, at: datetime, took: float, **seconds: float) -> Any:
    return SimpleNamespace(
        id=job_id, kind="fit", status="done", seconds=seconds, finished_at=at, created_at=at - timedelta(seconds=took)
    )


class Ends:
    """Jobs that have ended by now, asked for in place of the database; and what it is asked since when."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.jobs, self.asked, self.now = list[Any](), list[datetime](), datetime(2026, 3, 1, 12, 0, tzinfo=UTC)
        monkeypatch.setattr(metrics, "now", lambda: self.now)
        monkeypatch.setattr(metrics.jobs, "ended_since", self.since)
        monkeypatch.setattr(metrics.jobs, "count_unfinished", lambda _: {"queued": 3, "running": 2})

    def since(self, _: Any, moment: datetime) -> list[Any]:
        self.asked.append(moment)
        return [job for job in self.jobs if job.finished_at >= moment]


def follow(told: Metrics) -> dict[tuple[str, ...], float]:
    session: Any = None
    told._follow_jobs(session)
    return read(generate_latest(told.registry).decode())


def test_each_job_that_ends_is_counted_once_though_it_is_seen_a_minute_long(monkeypatch: pytest.MonkeyPatch) -> None:
    ends = Ends(monkeypatch)
    begin, told = ends.now, Metrics()
    for minute in range(4):
        ends.now = begin + timedelta(minutes=minute)
        ends.jobs.append(ended(str(minute), ends.now, 2.0, frames=0.25))
        found = follow(told)
        assert found["stiction_job_seconds_count", "fit", "done"] == minute + 1
    assert found["stiction_job_seconds_sum", "fit", "done"] == 8.0
    assert found["stiction_job_stage_seconds_sum", "fit", "frames"] == 1.0
    assert (found["stiction_jobs", "queued"], found["stiction_jobs", "running"]) == (3.0, 2.0)
    assert ends.asked == [begin, begin, begin, begin + timedelta(minutes=1)]


def test_a_job_that_is_seen_late_is_counted_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    ends = Ends(monkeypatch)
    told, begin = Metrics(), ends.now
    ends.now = begin + timedelta(minutes=2)
    ends.jobs.append(ended("a", ends.now, 2.0))
    follow(told)
    ends.jobs.append(ended("b", begin + timedelta(seconds=61), 2.0))
    assert follow(told)["stiction_job_seconds_count", "fit", "done"] == 2.0


def test_a_clock_that_is_ahead_hides_no_later_job(monkeypatch: pytest.MonkeyPatch) -> None:
    ends = Ends(monkeypatch)
    told = Metrics()
    ends.jobs.append(ended("ahead", ends.now + timedelta(hours=1), 2.0))
    follow(told)
    ends.jobs.append(ended("right", ends.now + timedelta(seconds=1), 2.0))
    assert follow(told)["stiction_job_seconds_count", "fit", "done"] == 2.0


def test_a_job_that_ended_before_it_was_stored_took_no_time(monkeypatch: pytest.MonkeyPatch) -> None:
    ends = Ends(monkeypatch)
    ends.jobs.append(ended("a", ends.now, -5.0))
    assert follow(Metrics())["stiction_job_seconds_sum", "fit", "done"] == 0.0
