from collections.abc import Callable
from typing import Any

import httpx
import pytest

from tests.service.grasps import another_grasp

Upload = Callable[..., httpx.Response]
Wait = Callable[[httpx.Client, str], dict[str, Any]]


def test_a_material_is_found_by_its_old_name(client: httpx.Client, material: str) -> None:
    path = f"/v1/materials/{material}"
    new = f"{material} renamed"
    changed = client.patch(path, json={"name": new, "description": "brown"})
    assert changed.status_code == httpx.codes.OK
    assert changed.json() | {"created_at": None} == {
        "name": new,
        "aliases": [material],
        "description": "brown",
        "created_at": None,
        "grasp_logs": 0,
        "withdrawn_grasp_logs": 0,
        "models": {},
        "recommended": None,
    }
    assert client.get(path).json() == changed.json()
    assert client.patch(path, json={}).json() == changed.json()
    assert client.post("/v1/materials", json={"name": material}).status_code == httpx.codes.CONFLICT


def test_an_alias_comes_and_goes(client: httpx.Client, material: str) -> None:
    path = f"/v1/materials/{material}/aliases/other%20{material}"
    for _ in range(2):
        assert client.put(path).json()["aliases"] == [f"other {material}"]
    removed = client.delete(path)
    assert (removed.status_code, removed.content) == (httpx.codes.NO_CONTENT, b"")
    again = client.delete(path)
    assert (again.status_code, again.json()["type"]) == (404, "/problems/unknown-alias")


@pytest.mark.parametrize(
    ("method", "path", "body", "status", "kind"),
    [
        ("PATCH", "materials/felt", {}, 404, "unknown-material"),
        ("PATCH", "materials/{}", {"name": "ü"}, 422, "invalid-request"),
        ("PATCH", "materials/{}", {"name": "fitted"}, 409, "material-exists"),
        ("PUT", "materials/{}/aliases/fitted", None, 409, "material-exists"),
        ("PUT", "materials/{}/aliases/%20", None, 422, "invalid-request"),
        ("PUT", "materials/{}/aliases/felt%20", None, 422, "invalid-request"),
        ("DELETE", "materials/{}/aliases/felt%20", None, 404, "unknown-alias"),
        ("PUT", "materials/felt/aliases/x", None, 404, "unknown-material"),
        ("DELETE", "materials/{0}/aliases/{0}", None, 404, "unknown-alias"),
        ("POST", "materials/{}/merges", {"source": "felt"}, 404, "unknown-material"),
        ("POST", "materials/{0}/merges", {"source": "{0}"}, 422, "invalid-request"),
        ("POST", "materials/{}/merges", {}, 422, "invalid-request"),
        ("POST", "materials/felt/epochs", {"reason": "coated"}, 404, "unknown-material"),
        ("POST", "materials/{}/epochs", {"reason": "coated", "first_grasp_log": "0"}, 422, "invalid-request"),
        ("POST", "materials/{}/epochs", {"reason": ""}, 422, "invalid-request"),
        ("PUT", "grasp-logs/nothing/withdrawal", {"reason": "wet"}, 404, "unknown-grasp-log"),
        ("PUT", "grasp-logs/nothing/withdrawal", {"reason": ""}, 422, "invalid-request"),
        ("DELETE", "grasp-logs/nothing/withdrawal", None, 404, "unknown-grasp-log"),
    ],
)
@pytest.mark.usefixtures("fitted")
def test_what_cannot_be_is_refused(
    client: httpx.Client, material: str, method: str, path: str, body: dict[str, str] | None, status: int, kind: str
) -> None:
    filled = {name: value.format(material) for name, value in body.items()} if body is not None else None
    answer = client.request(method, f"/v1/{path.format(material)}", json=filled)
    assert (answer.status_code, answer.json()["type"]) == (status, f"/problems/{kind}"), answer.text


def test_a_log_is_withdrawn_and_the_model_follows(
    client: httpx.Client, material: str, content: bytes, upload: Upload, wait: Wait
) -> None:
    logs = [upload(client, another_grasp(content, number), material=material).json() for number in (0, 1)]
    for log in logs:
        wait(client, log["job"]["id"])
    path = f"/v1/grasp-logs/{logs[0]['id']}"
    answer = client.put(f"{path}/withdrawal", json={"reason": "wet"}).json()
    assert answer["grasp_log"]["withdrawal"]["reason"] == "wet"
    assert answer["counts_instead"] is None
    assert client.get(path).json()["withdrawal"] == answer["grasp_log"]["withdrawal"]
    assert [wait(client, job["id"])["status"] for job in answer["jobs"]] == ["done", "done"]  # by each of its methods
    found = client.get(f"/v1/materials/{material}").json()
    assert (found["grasp_logs"], found["withdrawn_grasp_logs"], found["models"]["ols"]["outdated"]) == (2, 1, False)
    samples = client.get(path).json()["detection"]["samples"]
    assert found["models"]["ols"]["n"] == samples
    restored = client.delete(f"{path}/withdrawal").json()
    assert restored["grasp_log"]["withdrawal"] is None
    for job in restored["jobs"]:
        wait(client, job["id"])
    assert client.get(f"/v1/materials/{material}").json()["models"]["ols"]["n"] == 2 * samples


def test_an_epoch_begins_and_the_model_follows(
    client: httpx.Client, material: str, content: bytes, upload: Upload, wait: Wait
) -> None:
    logs = [upload(client, another_grasp(content, number), material=material).json() for number in (0, 1)]
    for log in logs:
        wait(client, log["job"]["id"])
    body = {"reason": "coated", "first_grasp_log": logs[1]["id"]}
    answer = client.post(f"/v1/materials/{material}/epochs", json=body).json()
    assert (answer["withdrawn"], answer["material"]["withdrawn_grasp_logs"]) == (1, 1)
    assert [wait(client, job["id"])["status"] for job in answer["jobs"]] == ["done", "done"]
    first = client.get(f"/v1/grasp-logs/{logs[0]['id']}").json()
    assert first["withdrawal"]["reason"] == "coated"
    assert client.get(f"/v1/materials/{material}").json()["models"]["ols"]["n"] == first["detection"]["samples"]


def test_whoever_withdraws_a_copy_that_a_merge_left_behind_is_told_which_log_counts(
    client: httpx.Client, content: bytes, upload: Upload
) -> None:
    for name in ("glass", "glas"):
        client.post("/v1/materials", json={"name": name}).raise_for_status()
    counting, left_behind = (upload(client, content, material=name).json()["id"] for name in ("glass", "glas"))
    client.post("/v1/materials/glass/merges", json={"source": "glas"}).raise_for_status()
    path = f"/v1/grasp-logs/{left_behind}/withdrawal"
    assert client.put(path, json={"reason": "wet"}).json()["counts_instead"] == counting
    assert client.delete(path).json()["counts_instead"] == counting
    assert f'href="/logs/{counting}"' in client.get(f"/logs/{left_behind}").text
    assert "left this log behind" not in client.get(f"/logs/{counting}").text
