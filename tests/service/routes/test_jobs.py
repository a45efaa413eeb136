from typing import Any

import httpx


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
