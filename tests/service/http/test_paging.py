import base64
import json
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import pytest
from fastapi import Request, Response

from db.database import Database
from db.paging import Window
from db.repositories import sensors
from service.http.paging import Page, link_next
from service.http.problems import Problem

Reach = Any
ONLY_SQLITE = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)


@pytest.fixture
def client(reach: Reach) -> Any:
    client = reach("open")
    for name in "abcde":
        client.request("POST", "/v1/materials", json={"name": name})
    return client


@pytest.mark.parametrize("sort", ["name", "-name", "created_at", "-created_at"])
def test_next_leads_through_the_list_by_body_and_by_header(client: Any, sort: str) -> None:
    path, names = f"/v1/materials?limit=2&sort={sort}", ""
    while path:
        answer = client.get(path)
        assert answer.status_code == 200, answer.text
        names += "".join(item["name"] for item in answer.json()["items"])
        if len(names) == 2:
            client.request("POST", "/v1/materials", json={"name": "0" if sort == "name" else "z"})
        link, after = answer.links.get("next"), answer.json()["next"]
        assert (link is None) == (after is None)
        path = link["url"] if link else ""
    expected = "edcba" if sort.startswith("-") else "abcde"
    assert names == {"-name": expected, "created_at": expected + "z"}.get(sort, expected)


def test_the_list_of_sensors_goes_on_behind_any_name_that_is_stored(reach: Reach, database: Database) -> None:
    """Earlier versions took unprintable ones, and refused their own cursor: nobody saw what came after."""
    names = ["a", "b\x7f", "b\u200b", "c\n", "d"]
    with database.write() as session:
        for name in names:
            sensors.find_or_add(session, name)
    client, path, found = reach("open"), "/v1/sensors?limit=1", list[str]()
    while path:
        answer = client.get(path)
        assert answer.status_code == 200, answer.text
        found += [item["name"] for item in answer.json()["items"]]
        path = answer.links["next"]["url"] if "next" in answer.links else ""
    assert sorted(found) == sorted(names)


def encoded(*held: object) -> str:
    return base64.urlsafe_b64encode(json.dumps(held).encode()).decode()


@pytest.mark.parametrize(
    ("sort", "cursor"),
    [
        ("name", "?"),
        ("name", "ü"),
        ("name", base64.urlsafe_b64encode(b"\xff").decode()),
        ("name", encoded("name", "a")),
        ("name", encoded("-name", "a", 1)),
        ("name", encoded("name", 1, 1)),
        ("name", encoded("name", "a\0", 1)),
        ("name", encoded("name", "a\ud800", 1)),
        ("name", encoded("name", "a", "1")),
        ("name", encoded("name", "a", True)),
        ("name", encoded("name", "a", -1)),
        ("name", encoded("name", "a", 2**31)),
        ("created_at", encoded("created_at", "2026-01-01T00:00:00", 1)),
        ("created_at", encoded("created_at", "yesterday", 1)),
        ("created_at", encoded("created_at", None, 1)),
        ("-id", encoded("-id", 1e300, 1)),
        ("name", base64.urlsafe_b64encode(b"5").decode()),
        ("name", base64.urlsafe_b64encode(b"[" * 700).decode()),
    ],
)
def test_a_cursor_that_no_answer_gave_is_refused(sort: str, cursor: str) -> None:
    with pytest.raises(Problem, match=f"cursor is .*; allowed: `next` of an answer sorted by {sort}"):
        Page(sort, 10, cursor).window()


@ONLY_SQLITE
@pytest.mark.parametrize(
    ("query", "name"),
    [
        ("limit=0", "limit"),
        ("limit=1001", "limit"),
        ("sort=colour", "sort"),
        ("cursor=x", "cursor"),
        ("search=" + "x" * 101, "search"),
    ],
)
def test_a_wish_that_cannot_be_is_refused_by_name(reach: Reach, query: str, name: str) -> None:
    answer = reach("open").get(f"/v1/materials?{query}")
    assert (answer.status_code, answer.json()["name"]) == (422, name)


@dataclass(frozen=True)
class Entry:
    """Of a list."""

    id: int
    name: str
    created_at: datetime


ENTRIES = [Entry(number, "cab"[number], datetime(2026, 1, 1 + number, tzinfo=UTC)) for number in range(3)]


def test_one_entry_more_than_a_page_shows_that_there_is_another() -> None:
    assert Page("-name", 2, None).window() == Window("name", descending=True, limit=3)
    assert Page("name", 3, None).cut(ENTRIES) == (ENTRIES, None)
    assert Page("name", 3, None).cut([]) == ([], None)


@pytest.mark.parametrize(
    ("sort", "value"),
    [("name", "a"), ("-name", "a"), ("created_at", ENTRIES[1].created_at), ("-id", 1)],
)
def test_a_cursor_leads_on_after_the_last_entry_of_its_page(sort: str, value: object) -> None:
    shown, cursor = Page(sort, 2, None).cut(ENTRIES)
    assert shown == ENTRIES[:2]
    assert cursor is not None
    window = Page(sort, 5, cursor).window()
    assert (window.after, window.limit, window.descending) == ((value, 1), 6, sort.startswith("-"))


@pytest.mark.parametrize("identity", [0, 2**31 - 1])
def test_an_id_is_any_of_the_database(identity: int) -> None:
    assert Page("name", 1, encoded("name", "a", identity)).window().after == ("a", identity)


def test_a_moment_of_another_zone_is_the_same_moment() -> None:
    after = Page("created_at", 1, encoded("created_at", "2026-01-01T02:00:00+02:00", 1)).window().after
    assert after == (datetime(2026, 1, 1, tzinfo=UTC), 1)


def test_the_next_page_is_told_in_a_header_with_all_else_that_was_asked() -> None:
    scope = {
        "type": "http",
        "server": ("a", 80),
        "path": "/v1/materials",
        "query_string": b"limit=2&cursor=old",
        "headers": [],
    }
    response = Response()
    assert link_next(Request(scope), response, "new=") == "new="
    assert response.headers["link"] == '</v1/materials?limit=2&cursor=new%3D>; rel="next"'
    last = Response()
    assert link_next(Request(scope), last, None) is None
    assert "link" not in last.headers
