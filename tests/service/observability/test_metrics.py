import time
from collections.abc import Callable

import httpx
from prometheus_client.parser import text_string_to_metric_families

from db.database import Database
from db.repositories import jobs, materials, runners
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
