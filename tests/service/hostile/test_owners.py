"""What the holder of one key may do to the material of another, and what the audit trail says of who did what."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import httpx
import pytest

from db.database import Database
from db.repositories import materials
from service.domain.access import keys

NPZ = {"content-type": "application/vnd.stiction.grasp-log+npz"}
FORBIDDEN, OK = httpx.codes.FORBIDDEN, httpx.codes.OK


@dataclass
class Lab:
    """One caller a key: who made the material, one of the same group, another, and an admin."""

    maker: Any
    friend: Any
    other: Any
    admin: Any
    log: str
    """Path of a log that the maker uploaded."""


def key_of(caller: Any) -> str:
    return str(keys.key_id(caller.headers["Authorization"].removeprefix("Bearer ")))


@pytest.fixture
def lab(reach: Callable[..., Any], make: Callable[..., str], content: bytes) -> Lab:
    maker = reach(key=make("upload", group="lab 1"))
    callers = [maker, *(reach(key=key) for key in (make("upload", group="lab 1"), make("upload"), make("admin")))]
    assert maker.request("POST", "/v1/materials", json={"name": "paper"}).status_code == httpx.codes.CREATED
    log = upload(maker, content)
    return Lab(*callers, log=f"/v1/grasp-logs/{log.raise_for_status().json()['id']}")


def upload(caller: Any, content: bytes, detector: str = "filter") -> httpx.Response:
    query = {"material": "paper", "detector": detector}
    answer: httpx.Response = caller.request("POST", "/v1/grasp-logs", params=query, content=content, headers=NPZ)
    return answer


def changes(caller: Any, lab: Lab, content: bytes) -> list[int]:
    """Answers to all that can be done to the material, each undone."""
    paper = "/v1/materials/paper"
    wishes: list[tuple[str, str, Any]] = [
        ("POST", f"{paper}/fits", {"method": "ols"}),
        ("PATCH", paper, {"description": "white"}),
        ("PUT", f"{paper}/aliases/A4", None),
        ("DELETE", f"{paper}/aliases/A4", None),
        ("PUT", f"{lab.log}/withdrawal", {"reason": "wet"}),
        ("DELETE", f"{lab.log}/withdrawal", None),
        ("PUT", f"{paper}/owners/group:guests", None),
        ("DELETE", f"{paper}/owners/group:guests", None),
        ("POST", f"{paper}/epochs", {"reason": "coated"}),
    ]
    answers = [caller.request(method, path, json=body).status_code for method, path, body in wishes]
    return [*answers, upload(caller, content, "strain_rate").status_code]


def test_owners_and_admins_change_a_material_and_nobody_else(lab: Lab, content: bytes) -> None:
    assert set(changes(lab.other, lab, content)) == {FORBIDDEN}
    answer = lab.other.request("POST", "/v1/materials/paper/fits", json={})
    assert answer.json()["type"] == "/problems/not-owner"
    for caller in (lab.maker, lab.friend, lab.admin):
        assert all(status < httpx.codes.MULTIPLE_CHOICES for status in changes(caller, lab, content))
    assert lab.other.get("/v1/materials/paper").json()["description"] == "white"


def test_a_merge_needs_both_materials(lab: Lab) -> None:
    lab.other.request("POST", "/v1/materials", json={"name": "felt"})
    for caller, target, source in ((lab.other, "felt", "paper"), (lab.maker, "paper", "felt")):
        answer = caller.request("POST", f"/v1/materials/{target}/merges", json={"source": source})
        assert (answer.status_code, answer.json()["type"]) == (FORBIDDEN, "/problems/not-owner")
    answer = lab.admin.request("POST", "/v1/materials/paper/merges", json={"source": "felt"})
    assert answer.status_code == OK


def test_owners_are_shown_added_and_removed(lab: Lab, content: bytes) -> None:
    path, own, other = "/v1/materials/paper/owners", f"key:{key_of(lab.maker)}", f"key:{key_of(lab.other)}"
    assert lab.other.get(path).json() == {"owners": ["group:lab 1", own]}
    added = lab.maker.request("PUT", f"{path}/{other}")
    assert added.json() == {"owners": sorted(["group:lab 1", own, other])}
    assert upload(lab.other, content).status_code == OK
    assert lab.friend.request("DELETE", f"{path}/{other}").status_code == httpx.codes.NO_CONTENT
    assert upload(lab.other, content).status_code == FORBIDDEN
    gone = lab.maker.request("DELETE", f"{path}/{other}")
    assert (gone.status_code, gone.json()["type"]) == (404, "/problems/unknown-owner")


@pytest.mark.parametrize("owner", ["key:000000000000", "key:x", "group:", "group: x", "robot", "key:"])
def test_an_owner_is_a_stored_key_or_a_group(lab: Lab, owner: str) -> None:
    answer = lab.maker.request("PUT", f"/v1/materials/paper/owners/{owner}")
    assert (answer.status_code, answer.json()["name"]) == (422, "owner")


def test_a_material_without_owners_is_as_before(lab: Lab, database: Database) -> None:
    """Those of before, and those made where no key is asked for."""
    with database.write() as session:
        materials.create(session, "felt", "")
    assert lab.other.request("POST", "/v1/materials/felt/fits", json={}).status_code == httpx.codes.ACCEPTED
    answer = lab.other.request("PATCH", "/v1/materials/felt", json={"name": "wool"})
    assert (answer.status_code, answer.json()["type"]) == (FORBIDDEN, "/problems/insufficient-scope")
    seized = lab.other.request("PUT", f"/v1/materials/felt/owners/key:{key_of(lab.other)}")
    assert seized.status_code == FORBIDDEN
    assert lab.admin.request("PATCH", "/v1/materials/felt", json={"name": "wool"}).status_code == OK


def test_a_log_without_material_is_withdrawn_by_an_admin(lab: Lab, content: bytes) -> None:
    sent = lab.maker.request("POST", "/v1/grasp-logs", content=content, headers=NPZ).json()["id"]
    path = f"/v1/grasp-logs/{sent}/withdrawal"
    assert lab.maker.request("PUT", path, json={"reason": "wet"}).status_code == FORBIDDEN
    assert lab.admin.request("PUT", path, json={"reason": "wet"}).status_code == OK


def test_a_log_tells_who_sent_and_who_withdrew_it(lab: Lab) -> None:
    lab.friend.request("PUT", f"{lab.log}/withdrawal", json={"reason": "wet"})
    told = lab.other.get(lab.log).json()
    assert told["uploaded_by"] == key_of(lab.maker)
    assert (told["withdrawal"]["by"], told["withdrawal"]["reason"]) == (key_of(lab.friend), "wet")


def test_the_trail_tells_each_change_and_from_where(lab: Lab, content: bytes) -> None:
    said = {"X-Request-ID": "withdrawal-1"}
    lab.friend.request("PUT", f"{lab.log}/withdrawal", json={"reason": "torn"}, headers=said)
    changes(lab.maker, lab, content)
    changes(lab.other, lab, content)
    job = lab.maker.get("/v1/jobs?limit=1").json()["items"][0]["id"]
    lab.admin.request("POST", f"/v1/jobs/{job}/cancel")
    entries = lab.admin.get("/v1/audit").raise_for_status().json()["items"]
    actors = {entry["actor"] for entry in entries}
    assert actors == {f"key:{key_of(caller)}" for caller in (lab.maker, lab.friend, lab.admin)}
    assert [entry["action"] for entry in entries[::-1]] == [
        "material.created",
        "grasp_log.uploaded",
        "grasp_log.withdrawn",
        "fit.requested",
        "material.changed",
        "alias.added",
        "alias.removed",
        "grasp_log.withdrawn",
        "grasp_log.restored",
        "owner.added",
        "owner.removed",
        "material.epoch_begun",
        "grasp_log.uploaded",
        "job.cancelled",
    ]
    withdrawn = entries[::-1][2]
    assert (withdrawn["address"], withdrawn["request_id"]) == ("10.0.0.9", "withdrawal-1")
    assert (withdrawn["subject"], withdrawn["details"]) == (lab.log.rpartition("/")[2], {"reason": "torn"})


@pytest.mark.parametrize(
    ("method", "path", "wish", "other"),
    [
        ("PATCH", "/v1/materials/paper", {"description": "smooth"}, {"description": "rough"}),
        ("PATCH", "/v1/materials/paper", {"name": "paper", "description": "smooth"}, {"name": "card"}),
        ("PUT", "/v1/materials/paper/aliases/sheet", {}, None),
        ("PUT", "LOG/withdrawal", {"reason": "wet"}, {"reason": "torn"}),
    ],
)
def test_the_trail_has_no_entry_where_nothing_changed(
    lab: Lab, method: str, path: str, wish: dict[str, str], other: dict[str, str] | None
) -> None:
    def entries_after(body: dict[str, str]) -> list[Any]:
        sent = lab.maker.request(method, path.replace("LOG", lab.log), json=body)
        assert sent.status_code in {OK, httpx.codes.CREATED}
        entries: list[Any] = lab.admin.get("/v1/audit").json()["items"]
        return entries

    first = entries_after(wish)
    assert entries_after(wish) == first
    if other is not None:
        assert len(entries_after(other)) == len(first) + 1


def test_the_trail_is_for_admins_and_comes_in_pages(lab: Lab, content: bytes) -> None:
    changes(lab.maker, lab, content)
    assert lab.maker.get("/v1/audit").status_code == FORBIDDEN
    seen, cursor = list[int](), None
    while True:
        page = lab.admin.get("/v1/audit", params={"limit": 4} | ({"cursor": cursor} if cursor else {})).json()
        seen += [entry["id"] for entry in page["items"]]
        cursor = page["next"]
        if cursor is None:
            break
    assert seen == sorted(set(seen), reverse=True)
    assert len(seen) > 8
    chosen = lab.admin.get("/v1/audit", params={"action": "owner.added", "subject": "paper"}).json()["items"]
    assert [entry["details"] for entry in chosen] == [{"owner": "group:guests"}]


def test_an_upload_that_changes_nothing_leaves_no_entry(lab: Lab, content: bytes) -> None:
    before = lab.admin.get("/v1/audit").json()["items"]
    assert upload(lab.maker, content).status_code == OK
    assert lab.admin.get("/v1/audit").json()["items"] == before


@pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
def test_where_no_key_is_asked_for_nobody_owns_anything(reach: Callable[..., Any]) -> None:
    local = reach("auto", "127.0.0.1", "127.0.0.1")
    local.request("POST", "/v1/materials", json={"name": "paper"})
    assert local.get("/v1/materials/paper/owners").json() == {"owners": []}
    assert local.request("PATCH", "/v1/materials/paper", json={"name": "card"}).status_code == OK
    assert {entry["actor"] for entry in local.get("/v1/audit").json()["items"]} == {"anybody"}


def test_the_trail_names_a_material_by_its_own_name_whatever_alias_was_used(lab: Lab) -> None:
    """Whoever looked for what was done to a material missed what was done by an alias, which may be gone since."""
    by_alias = "/v1/materials/A4"
    lab.maker.request("PUT", "/v1/materials/paper/aliases/A4")
    lab.maker.request("POST", "/v1/materials", json={"name": "papre"})
    lab.maker.request("PUT", "/v1/materials/papre/aliases/typo")
    for method, path, body in (
        ("PATCH", by_alias, {"description": "white"}),
        ("PUT", f"{by_alias}/aliases/sheet", None),
        ("DELETE", f"{by_alias}/aliases/sheet", None),
        ("PUT", f"{by_alias}/owners/group:guests", None),
        ("DELETE", f"{by_alias}/owners/group:guests", None),
        ("POST", f"{by_alias}/fits", {"method": "ols"}),
        ("POST", f"{by_alias}/merges", {"source": "typo"}),
        ("POST", f"{by_alias}/epochs", {"reason": "new lot"}),
    ):
        assert lab.maker.request(method, path, json=body).is_success, path
    entries = lab.admin.get("/v1/audit", params={"subject": "paper"}).json()["items"][::-1]
    assert [entry["action"] for entry in entries] == [
        "material.created",
        "alias.added",
        "material.changed",
        "alias.added",
        "alias.removed",
        "owner.added",
        "owner.removed",
        "fit.requested",
        "material.merged",
        "material.epoch_begun",
    ]
    assert entries[-2]["details"] == {"source": "papre"}
    assert lab.admin.get("/v1/audit", params={"subject": "A4"}).json()["items"] == []
