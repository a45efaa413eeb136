from collections.abc import Callable
from typing import Any
from urllib.parse import quote

import httpx
import pytest
from sqlalchemy import update

from db.blobs import BlobStore
from db.database import Database
from db.repositories import jobs, materials, runners
from db.tables import DetectionRow
from service.domain.sensors import RECONSTRUCTED
from service.jobs import pipeline
from slipcore import GraspLog
from stiction_client.container import encode

NPZ = "application/vnd.stiction.grasp-log+npz"
GEL = {"young_modulus": 2.5e5, "poisson_ratio": 0.48, "thickness": 4e-3, "marker_depth": 5e-4}


@pytest.mark.parametrize("name", ["Gel Sight", "a/b", "hand/left/", "?#%2F"])
def test_a_sensor_is_described_before_or_after_its_first_log(client: httpx.Client, name: str) -> None:
    path = f"/v1/sensors/{quote(name, safe='')}"
    unknown = client.get(path)
    assert (unknown.status_code, unknown.json()["type"]) == (404, "/problems/unknown-sensor")
    thick = client.put(path, json={"young_modulus": 1e6, "poisson_ratio": 0.49})
    assert thick.json()["gel"] == {
        "young_modulus": 1e6,
        "poisson_ratio": 0.49,
        "thickness": None,
        "marker_depth": 0.0,
    }
    assert client.put(path, json=GEL).json() == {"name": name, "gel": GEL}
    assert client.get(path).json()["gel"] == GEL
    assert {"name": name, "gel": GEL} in client.get("/v1/sensors").json()["items"]
    told = client.get("/v1/audit", params={"subject": name}).json()["items"]
    assert [entry["action"] for entry in told] == ["sensor.described"] * 2
    assert told[0]["details"] == GEL


@pytest.mark.parametrize(
    "change",
    [
        {"young_modulus": 0.25},
        {"poisson_ratio": 0.51},
        {"thickness": 0.0},
        {"marker_depth": 4e-3},
        {"marker_depth": -1e-3},
        {"hardness": 20.0},
        {"young_modulus": None},
    ],
)
def test_an_impossible_gel_is_refused(client: httpx.Client, change: dict[str, Any]) -> None:
    refused = client.put("/v1/sensors/other", json=GEL | change)
    assert (refused.status_code, refused.json()["type"]) == (422, "/problems/invalid-request")


def test_one_key_describes_a_sensor_for_all_and_only_an_admin_does_so_again(
    reach: Callable[..., Any], make: Callable[..., str]
) -> None:
    first, other, admin = (reach(key=make(scope)) for scope in ("upload", "upload", "admin"))
    path = "/v1/sensors/shared"
    assert first.request("PUT", path, json=GEL).status_code == httpx.codes.OK
    assert other.request("PUT", path, json=GEL).status_code == httpx.codes.OK  # as it is already
    for caller in (first, other):
        refused = caller.request("PUT", path, json=GEL | {"poisson_ratio": 0.0})
        assert (refused.status_code, refused.json()["type"]) == (403, "/problems/insufficient-scope")
    assert admin.request("GET", path).json()["gel"] == GEL
    softer = GEL | {"young_modulus": 2e5}
    assert admin.request("PUT", path, json=softer).json()["gel"] == softer


def test_a_log_that_is_sent_again_once_its_sensor_is_described_anew_is_looked_at_again(
    client: httpx.Client, material: str, ramp: GraspLog, upload: Any, wait: Any
) -> None:
    few = ramp.displacement[60::15, 2:6, 2:6]  # 2 frames, 16 markers: forces of more take seconds
    content = encode(GraspLog(ramp.time[60::15], ramp.position[2:6, 2:6], few, ramp.element_area))

    def sent(gel: dict[str, float] | None) -> tuple[bool, list[str]]:
        """Whether there is something to do, and what is found then."""
        if gel is not None:
            client.put(f"/v1/sensors/{material}", json=gel).raise_for_status()
        log = upload(client, content, material=material, sensor=material).raise_for_status().json()
        wait(client, log["job"]["id"])
        found = client.get(f"/v1/grasp-logs/{log['id']}").json()["detection"]["findings"]
        return log["job"]["status"] == "queued", [each["name"] for each in found]

    assert sent(None)[0]
    assert sent(None)[0] is False
    is_new, found = sent(GEL)
    assert is_new
    assert "reconstructed forces" in found
    assert sent(GEL) == (False, found)  # described as it was
    assert sent(GEL | {"young_modulus": 1e6})[0]


def test_models_of_a_log_that_is_looked_at_again_are_outdated_meanwhile(
    reach: Callable[..., Any], database: Database, blobs: BlobStore, content: bytes
) -> None:
    lab = reach("open")
    lab.request("POST", "/v1/materials", json={"name": "paper"})

    def upload() -> Any:
        query, headers = {"material": "paper", "sensor": "gel"}, {"content-type": NPZ}
        answer = lab.request("POST", "/v1/grasp-logs", params=query, content=content, headers=headers)
        return answer.raise_for_status().json()

    log = upload()["id"]
    with database.write() as session:
        claim = jobs.claim(session, runners.add(session, "host:1"))
    assert claim is not None
    pipeline.run_job(database, blobs, claim)
    by_gel = {"name": RECONSTRUCTED, "evidence": "", "remedy": ""}
    with database.write() as session:  # as if it had come without forces
        session.execute(update(DetectionRow).where(DetectionRow.grasp_log_id == log).values(findings=[by_gel]))
    assert upload()["job"]["status"] == "done"
    lab.request("PUT", "/v1/sensors/gel", json=GEL).raise_for_status()
    again = upload()
    assert (again["id"], again["job"]["status"], again["detection"]) == (log, "queued", None)
    with database.read() as session:
        models = materials.get(session, "paper").models
    assert [stored.outdated for stored in models] == [True, True]
    answer = lab.request("GET", "/v1/materials/paper/friction", params={"fn": 0.05}).raise_for_status().json()
    assert "the model is outdated" in answer["warning"]
