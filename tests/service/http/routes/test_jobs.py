import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import httpx
import pytest

from service.settings import Settings


@pytest.fixture
def idle(
    serving: Callable[[Settings], AbstractContextManager[httpx.Client]], new_url: Callable[..., str], tmp_path: Path
) -> Iterator[httpx.Client]:
    """A server without workers on each database: what is queued stays so."""
    with serving(Settings(data_folder=tmp_path, database_url=new_url(tmp_path), workers=0)) as client:
        client.post("/v1/materials", json={"name": "paper"}).raise_for_status()
        yield client


def test_a_job_tells_what_each_stage_took(client: httpx.Client, fitted: dict[str, Any]) -> None:
    job = client.get(f"/v1/jobs/{fitted['job']['id']}").json()
    assert job == fitted["job"]
    assert (job["kind"], job["status"], job["stage"], job["reason"]) == ("ingest", "done", None, None)
    assert (job["grasp_log"], job["material"], job["model_version"]) == (fitted["id"], "fitted", 1)
    assert list(job["seconds"]) == ["frames", "slip_state", "samples", "friction_model", "material"]
    assert all(0.0 < seconds < 60.0 for seconds in job["seconds"].values())
    assert job["created_at"] < job["finished_at"]
    assert job["finished_at"].endswith("Z")


def test_an_unknown_job_is_named(client: httpx.Client) -> None:
    response = client.get("/v1/jobs/nothing")
    assert response.status_code == httpx.codes.NOT_FOUND
    assert response.json()["type"] == "/problems/unknown-job"
    assert response.json()["value"] == "nothing"


def test_who_waits_for_a_job_is_answered_at_its_end(client: httpx.Client, upload: Any, content: bytes) -> None:
    client.post("/v1/materials", json={"name": "awaited"}).raise_for_status()
    job = upload(client, content, material="awaited").json()["job"]
    assert job["status"] == "queued"
    begin = time.monotonic()
    while (found := client.get(f"/v1/jobs/{job['id']}", params={"wait": 10.0}).json())["finished_at"] is None:
        assert time.monotonic() - begin < 60.0
    assert found["status"] == "done"
    assert client.get("/v1/materials/awaited").json()["models"]["ols"]["version"] == 1


def test_who_waits_is_answered_in_time_and_of_an_end_elsewhere(idle: httpx.Client) -> None:
    job = idle.post("/v1/materials/paper/fits", json={"method": "ols"}).json()["id"]
    begin = time.monotonic()
    assert idle.get(f"/v1/jobs/{job}", params={"wait": 0.4}).json()["status"] == "queued"
    assert 0.4 <= time.monotonic() - begin < 5.0
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(idle.get, f"/v1/jobs/{job}", params={"wait": 10.0})
        time.sleep(0.1)
        idle.post(f"/v1/jobs/{job}/cancel").raise_for_status()
        assert waiting.result(9.0).json()["status"] == "cancelled"
    for wrong in (-1, 10.5, "nan", "x"):
        assert idle.get(f"/v1/jobs/{job}", params={"wait": wrong}).json()["type"] == "/problems/invalid-request", wrong
    assert idle.get("/v1/jobs/nothing", params={"wait": 5}).status_code == httpx.codes.NOT_FOUND


def test_jobs_are_listed_newest_first_by_status(idle: httpx.Client) -> None:
    ids = [idle.post("/v1/materials/paper/fits", json={"method": "ols"}).json()["id"] for _ in range(3)]
    idle.post(f"/v1/jobs/{ids[1]}/cancel").raise_for_status()
    listed = [job["id"] for job in idle.get("/v1/jobs").json()["items"]]
    assert listed == ids[::-1]
    queued = idle.get("/v1/jobs", params={"status": "queued", "limit": 1}).json()["items"]
    assert [(job["id"], job["status"], job["deaths"]) for job in queued] == [(ids[2], "queued", 0)]
    for wrong in ({"status": "asleep"}, {"limit": 0}):
        assert idle.get("/v1/jobs", params=wrong).json()["type"] == "/problems/invalid-request"


def test_a_job_is_cancelled_once_and_for_all(idle: httpx.Client, upload: Callable[..., Any], content: bytes) -> None:
    log = upload(idle, content, material="paper").json()
    for _ in range(2):
        cancelled = idle.post(f"/v1/jobs/{log['job']['id']}/cancel").raise_for_status().json()
        assert (cancelled["status"], cancelled["reason"]) == ("cancelled", "cancelled by request")
    assert idle.get(f"/v1/grasp-logs/{log['id']}").json()["job"] == cancelled
    assert idle.post("/v1/jobs/nothing/cancel").json()["type"] == "/problems/unknown-job"
    again = upload(idle, content, material="paper")
    assert (again.status_code, again.json()["job"]["status"]) == (200, "queued")


def test_a_job_that_has_ended_cannot_be_cancelled(client: httpx.Client, fitted: dict[str, Any]) -> None:
    response = client.post(f"/v1/jobs/{fitted['job']['id']}/cancel")
    assert (response.status_code, response.json()["type"]) == (409, "/problems/job-ended")
    assert response.json()["value"] == "done"


def test_a_nul_character_is_refused_where_no_text_can_have_one(idle: httpx.Client) -> None:
    for method, path in (
        ("GET", "/v1/jobs/a%00b"),
        ("GET", "/v1/materials/%00/friction?fn=1"),
        ("GET", "/v1/grasp-logs/%00"),
        ("POST", "/v1/grasp-logs?material=%00"),
        ("POST", "/v1/grasp-logs?sensor=a%00"),
    ):
        response = idle.request(method, path, content=b"")
        assert response.is_client_error, path
        assert response.json()["type"] in {"/problems/bad-request", "/problems/invalid-request"}
