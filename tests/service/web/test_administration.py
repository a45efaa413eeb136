import re
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest

from db.database import Database
from db.records import Actor
from db.repositories import access_keys, audit
from service.domain.access import keys
from tests.service.web.conftest import HOSTILE

pytestmark = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)

PAGES = ["/keys", "/audit"]


@pytest.fixture
def record(database: Database) -> Callable[..., None]:
    """Add entries to the audit trail."""

    def add(*subjects: str, actor: str = "command:root", **details: Any) -> None:
        with database.write() as session:
            for subject in subjects:
                audit.add(session, Actor(actor, "10.0.0.9"), "material.created", subject, details)

    return add


def subjects(page: str) -> list[str]:
    """To what the listed entries were done, in their order."""
    return re.findall(r'data-label="To what" dir="auto">([^<]*)<', page)


@pytest.mark.parametrize("path", PAGES)
@pytest.mark.parametrize("scope", ["read", "upload"])
def test_others_than_admins_see_neither_keys_nor_audit(session_of: Any, path: str, scope: str) -> None:
    caller = session_of(scope)
    answer = caller.get(path)
    assert answer.status_code == 403
    assert answer.headers["content-type"] == "text/html; charset=utf-8"
    assert f'href="{path}"' not in caller.get("/sensors").text


@pytest.mark.parametrize("path", PAGES)
def test_who_has_no_key_is_led_to_the_login(reach: Any, path: str) -> None:
    answer = reach("keys").get(path, headers={"accept": "text/html"})
    assert (answer.status_code, answer.headers["location"]) == (303, f"/login?next=%2F{path[1:]}")
    assert f'href="{path}"' not in reach("keys").get("/login").text


@pytest.mark.parametrize("path", PAGES)
def test_where_no_key_is_asked_for_they_are_anybodys(browser: Any, path: str) -> None:
    assert browser.get(path).status_code == 200
    assert f'href="{path}"' in browser.get("/sensors").text


def test_keys_are_listed_with_what_they_may_and_never_their_digests(
    session_of: Any, make: Callable[..., str], database: Database
) -> None:
    now = datetime.now(UTC)
    valid = make("upload", group="cell 3", expires_at=now + timedelta(days=1))
    expired, revoked = make("read", expires_at=now - timedelta(days=1)), make("read")
    with database.write() as session:
        access_keys.revoke(session, str(keys.key_id(revoked)))
    page = session_of("admin").get("/keys").text
    rows = {text: page.partition(f"<code>{keys.key_id(text)}</code>")[2] for text in (valid, expired, revoked)}
    rows = {text: row.partition("</tr>")[0] for text, row in rows.items()}
    assert all(told in rows[valid] for told in ("upload", "cell 3", "valid", f"{now + timedelta(days=1):%Y-%m-%d}"))
    assert "expired" in rows[expired]
    assert all(told in rows[revoked] for told in ("revoked", "never"))
    assert not any(text in page or keys.digest(text) in page for text in rows)


def test_the_audit_trail_comes_in_parts_that_lead_on(browser: Any, record: Any, elements: Any) -> None:
    record(*(f"m{number:03}" for number in range(120)), because="wet")
    seen, path = [], "/audit?actor=command%3Aroot"
    while path:
        page = browser.get(path).text
        seen += subjects(page)
        links = [given["href"] for tag, given in elements(page).found if tag == "a"]
        path = next((link for link in links if "cursor=" in link), "")
    assert seen == [f"m{number:03}" for number in reversed(range(120))]
    assert "because: wet" in page


@pytest.mark.parametrize(
    ("query", "found"),
    [
        ("actor=service", ["rubber"]),
        ("subject=paper", ["paper"]),
        ("action=job.cancelled", []),
        ("action=material.created", ["rubber", "paper"]),
    ],
)
def test_the_audit_trail_is_filtered_as_the_api_does(browser: Any, record: Any, query: str, found: list[str]) -> None:
    record("paper", actor="key:0123456789ab")
    record("rubber", actor="service")
    assert [entry["subject"] for entry in browser.get(f"/v1/audit?{query}").json()["items"]] == found
    assert subjects(browser.get(f"/audit?{query}").text) == found


def test_a_cursor_of_elsewhere_is_refused_by_a_page(browser: Any) -> None:
    answer = browser.get("/audit?cursor=nonsense")
    assert (answer.status_code, "cursor is nonsense" in answer.text) == (422, True)


@pytest.mark.parametrize("typed", HOSTILE)
def test_what_somebody_typed_is_text_in_the_audit_trail(browser: Any, record: Any, elements: Any, typed: str) -> None:
    record(typed[:200], reason=typed)
    page = elements(browser.get("/audit").text)
    assert page.foreign() == []
    assert typed[:200] in page.text
    assert elements(browser.get("/audit", params={"subject": typed[:200]}).text).foreign() == []
