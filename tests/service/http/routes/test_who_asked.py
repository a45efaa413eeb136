from collections.abc import Callable
from typing import Any

import pytest

from db.database import Database
from db.records import Detection, SampleSummary
from db.repositories import access_keys, detections, grasp_logs
from service.domain.access import keys

NPZ = "application/vnd.stiction.grasp-log+npz"
DETECTION = Detection("filter", 1e-6, 0.1, 60, 3, 4, 3, 4, 4, 0.05, "1" * 64)
SAMPLES = SampleSummary(120, None, 1e-6, 0.41, (0.0, 0.01), (0.01, 0.09), "2" * 64)

Principal = tuple[str, Any]


@pytest.fixture
def newcomer(reach: Callable[..., Any], database: Database) -> Callable[[], Principal]:
    """The id of a new key, and who asks with it."""

    def new() -> Principal:
        key_id, text = keys.new_key()
        with database.write() as session:
            access_keys.add(session, key_id, "robot", "admin", keys.digest(text))
        return key_id, reach(key=text)

    return new


def send(client: Any, content: bytes) -> Any:
    return client.request(
        "POST", "/v1/grasp-logs?material=paper", content=content, headers={**client.headers, "content-type": NPZ}
    )


def test_a_log_tells_who_sent_it_and_its_job_who_asked_for_it(
    newcomer: Callable[[], Principal], content: bytes
) -> None:
    (first_id, first), (second_id, second) = newcomer(), newcomer()
    first.request("POST", "/v1/materials", json={"name": "paper"})
    sent = send(first, content)
    assert (sent.status_code, sent.json()["uploaded_by"], sent.json()["job"]["requested_by"]) == (
        202,
        first_id,
        first_id,
    )
    second.request("POST", f"/v1/jobs/{sent.json()['job']['id']}/cancel")
    again = send(second, content)
    assert (again.json()["uploaded_by"], again.json()["job"]["requested_by"]) == (first_id, second_id)
    assert second.get(f"/v1/grasp-logs/{sent.json()['id']}").json()["uploaded_by"] == first_id
    assert second.get(f"/v1/jobs/{sent.json()['job']['id']}").json()["requested_by"] == second_id


def test_a_log_without_a_key_is_nobodys(reach: Callable[..., Any], content: bytes) -> None:
    here = reach("open")
    here.request("POST", "/v1/materials", json={"name": "paper"})
    sent = send(here, content).json()
    assert (sent["uploaded_by"], sent["job"]["requested_by"]) == (None, None)


def test_fits_tell_who_asked_for_them(newcomer: Callable[[], Principal], database: Database, content: bytes) -> None:
    (sender_id, sender), (curator_id, curator) = newcomer(), newcomer()
    for name in ("paper", "papre"):
        sender.request("POST", "/v1/materials", json={"name": name})
    log_id = send(sender, content).json()["id"]
    with database.write() as session:
        detections.add(session, log_id, DETECTION, SAMPLES)
        assert grasp_logs.get(session, log_id).uploaded_by == sender_id
    asked = curator.request("POST", "/v1/materials/paper/fits", json={"method": "bayes"}).json()
    assert asked["requested_by"] == curator_id
    for method, path, body in (
        ("POST", "/v1/materials/paper/merges", {"source": "papre"}),
        ("POST", "/v1/materials/paper/epochs", {"reason": "coated"}),
        ("PUT", f"/v1/grasp-logs/{log_id}/withdrawal", {"reason": "wet"}),
        ("DELETE", f"/v1/grasp-logs/{log_id}/withdrawal", None),
    ):
        found = curator.request(method, path, json=body).json()
        assert {job["requested_by"] for job in found["jobs"]} <= {curator_id}, path
    assert found["jobs"]
