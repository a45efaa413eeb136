"""Pages of live streams, in process."""

import asyncio
from typing import Any

import pytest
from starlette.requests import HTTPConnection

from db.database import Database
from db.repositories import access_keys
from service.domain.access import keys
from service.http.middleware import authentication
from service.http.problems import STORAGE_UNAVAILABLE, Problem
from service.stream.messages import Open
from service.stream.sessions import Session
from tests.service.web.conftest import HOSTILE


@pytest.fixture
def streaming(browser: Any) -> Any:
    """Make a session with this sensor and material known, whose frames nobody sends."""

    def begin(sensor: str, material: str | None = None) -> str:
        session = Session("ab12", Open(b"", (8, 9), 1e-6, sensor=sensor, material=material), None, "somebody", 1234)
        browser.app.state.context.streams._sessions[session.id] = session
        return f"/live/{session.id}"

    return begin


def test_without_streams_the_page_says_how_to_begin_one(browser: Any) -> None:
    page = browser.get("/live")
    assert page.status_code == 200
    assert "stiction stream LOG" in page.text


def test_a_stream_is_listed_with_its_sensor_and_has_a_page(browser: Any, streaming: Any, elements: Any) -> None:
    path = streaming("gripper 7", "paper")
    listed = elements(browser.get("/live").text)
    assert path in [given.get("href") for _, given in listed.found]
    assert "gripper 7" in listed.text
    assert "1,234" in listed.text.replace("\u202f", ",").replace(" ", ",")
    shown = elements(browser.get(path).text)
    assert f"{path}/frames" in [given.get("data-frames") for _, given in shown.found]
    assert "/materials/paper" in [given.get("href") for _, given in shown.found]


@pytest.mark.parametrize("typed", HOSTILE)
def test_what_a_sensor_is_called_is_text(browser: Any, streaming: Any, elements: Any, typed: str) -> None:
    path = streaming(typed, typed)
    for page in (browser.get("/live"), browser.get(path)):
        assert page.status_code == 200
        assert elements(page.text).foreign() == []


def test_a_stream_that_has_ended_is_told_of_by_a_page(browser: Any) -> None:
    page = browser.get("/live/nothing")
    assert page.status_code == 404
    assert "may have ended" in page.text


def test_nobody_watches_without_a_key(reach: Any, make: Any) -> None:
    path = "/live/nothing/frames"
    assert reach("keys").open_stream(path).status_code == 401
    assert reach("keys", key=make("read")).open_stream(path).status_code == 101


def test_who_watches_may_do_so_as_long_as_the_key_lasts(
    reach: Any, make: Any, database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(authentication, "KEPT_SECONDS", -1.0)  # each look asks the database
    text = make("read")
    app = reach("keys").app
    headers = [(b"authorization", f"Bearer {text}".encode())]
    scope = {"type": "websocket", "path": "/live/a/frames", "headers": headers, "client": ("10.0.0.9", 1), "app": app}
    connection = HTTPConnection(scope)

    def may() -> bool:
        return asyncio.run(app.state.authenticator.still_admits(connection))

    assert may()
    monkeypatch.setattr(authentication.Authenticator, "_identify", unavailable)
    assert may()  # while nobody can say otherwise
    monkeypatch.undo()
    monkeypatch.setattr(authentication, "KEPT_SECONDS", -1.0)
    with database.write() as session:
        access_keys.revoke(session, str(keys.key_id(text)))
    assert not may()


async def unavailable(*_: Any) -> None:
    raise Problem(STORAGE_UNAVAILABLE, "the database is away")
