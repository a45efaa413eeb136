import time
from collections.abc import Callable
from http.cookies import SimpleCookie
from typing import Any

import pytest
from starlette import requests
from starlette.formparsers import MultiPartParser
from starlette.requests import cookie_parser

from db.database import Database
from db.repositories import access_keys, browser_sessions
from service.domain.access import keys
from service.http import sessions
from service.http.middleware import authentication
from tests.service.web.conftest import HTML

pytestmark = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
OWN = {"origin": "http://10.0.0.5"}


def log_in(caller: Any, key: str, **headers: str) -> Any:
    return caller.request("POST", "/login", data={"key": key, "next": "/?sort=-name"}, headers=headers or OWN)


@pytest.fixture
def caller(reach: Any) -> Any:
    """A browser on another machine, of which a key is asked."""
    found = reach("keys")
    found.headers |= HTML
    return found


@pytest.fixture
def cookie(caller: Any, make: Callable[..., str]) -> str:
    """The cookie of a session whose key may upload."""
    return str(log_in(caller, make("upload")).headers["set-cookie"].partition(";")[0])


def test_who_has_no_key_is_led_to_the_login_and_back(caller: Any, make: Callable[..., str]) -> None:
    answer = caller.get("/?sort=-name")
    assert (answer.status_code, answer.headers["location"]) == (303, "/login?next=%2F%3Fsort%3D-name")
    assert 'name="next" value="/?sort=-name"' in caller.get(answer.headers["location"]).text
    answer = log_in(caller, make())
    assert (answer.status_code, answer.headers["location"]) == (303, "/?sort=-name")
    page = caller.get("/", headers={"cookie": answer.headers["set-cookie"].partition(";")[0]})
    assert page.status_code == 200
    assert "Log out" in page.text


def test_programs_are_refused_as_ever(caller: Any) -> None:
    for headers in ({"accept": "application/json"}, {"accept": "*/*"}):
        answer = caller.get("/", headers=headers)
        assert (answer.status_code, answer.headers["content-type"]) == (401, "application/problem+json")
    assert caller.get("/v1/materials").headers["content-type"] == "application/problem+json"


def test_the_cookie_is_no_key_and_is_kept_from_scripts_and_other_sites(
    caller: Any, make: Callable[..., str], database: Database
) -> None:
    key = make()
    found = SimpleCookie(log_in(caller, key).headers["set-cookie"])[sessions.COOKIE]
    assert (found["httponly"], found["samesite"], found["path"], found["secure"]) == (True, "strict", "/", "")
    assert key not in found.value
    with database.read() as session:
        assert browser_sessions.find_key(session, found.value) is None
        assert browser_sessions.find_key(session, keys.digest(found.value)) is not None


def test_a_key_has_a_bounded_number_of_sessions_and_loses_the_oldest(
    caller: Any, make: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sessions, "MOST_OF_A_KEY", 2)
    key = make()
    cookies = [log_in(caller, key).headers["set-cookie"].partition(";")[0] for _ in range(3)]
    assert [caller.get("/", headers={"cookie": each}).status_code for each in cookies] == [303, 200, 200]


def test_over_tls_the_cookie_goes_over_tls_only(caller: Any, make: Callable[..., str]) -> None:
    caller.server = "10.0.0.5"
    answer = caller.request(
        "POST", "https://10.0.0.5/login", data={"key": make()}, headers={"origin": "https://10.0.0.5"}
    )
    assert "Secure" in answer.headers["set-cookie"]


@pytest.mark.parametrize("key", ["", "nonsense", "stiction_0123456789ab_" + "0" * 64])
def test_what_is_no_key_begins_no_session(caller: Any, key: str) -> None:
    answer = log_in(caller, key)
    assert answer.status_code == 401
    assert "set-cookie" not in answer.headers
    assert "unknown, revoked, expired or garbled" in answer.text


@pytest.mark.parametrize("kind", ["application/x-www-form-urlencoded", "Application/X-WWW-Form-Urlencoded ; charset=x"])
@pytest.mark.parametrize(
    ("body", "status", "told"),
    [(b"&" * 8_000, 400, "the form has more than 100 fields"), (b"key=" + b"x" * 40_000, 413, "more than 32768 bytes")],
)
def test_a_form_that_takes_long_to_read_is_not_read(
    caller: Any, body: bytes, status: int, told: str, kind: str
) -> None:
    """Anybody may send it: 30 connections of 256 kB of separators kept others waiting for 24 s."""
    headers = OWN | {"content-type": kind, "accept": "application/json"}
    answer = caller.request("POST", "/login", content=body, headers=headers)
    assert answer.status_code == status
    assert told in answer.json()["detail"]


def test_a_form_of_parts_is_not_read(caller: Any, make: Callable[..., str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 490 empty ones each takes its time, and anybody may send them."""
    monkeypatch.setattr(MultiPartParser, "__init__", None)
    answer = caller.request("POST", "/login", files=[("key", (None, make()))] * 100, headers=OWN)
    assert answer.status_code == 401
    assert "set-cookie" not in answer.headers


def test_a_long_form_is_read_as_a_short_one(caller: Any, make: Callable[..., str]) -> None:
    key, others = "".join(f"%{letter:02X}" for letter in make().encode()), "".join(f"&x{n}" for n in range(90))
    body = f"key={key}&next=%2Fjobs%3Fa=%C3%A4+b{others}"
    headers = OWN | {"content-type": "application/x-www-form-urlencoded"}
    for padding in ("", "&pad=" + "+" * 2_000):
        answer = caller.request("POST", "/login", content=body + padding, headers=headers)
        assert answer.headers["location"] == "/jobs?a=%C3%A4%20b"
        assert "set-cookie" in answer.headers


@pytest.mark.parametrize("path", ["//elsewhere.org/", "/\\elsewhere.org", "https://elsewhere.org", "javascript:1", ""])
def test_the_login_leads_nowhere_else(caller: Any, make: Callable[..., str], path: str) -> None:
    answer = caller.request("POST", "/login", data={"key": make(), "next": path}, headers=OWN)
    assert answer.headers["location"] == "/"


@pytest.mark.parametrize(
    "headers", [{"origin": "http://elsewhere.org"}, {"sec-fetch-site": "cross-site"}, {"origin": "null"}, {}]
)
@pytest.mark.parametrize("path", ["/login", "/logout", "/materials", "/jobs/0/cancel", "/practice"])
def test_a_form_of_another_site_changes_nothing(
    caller: Any, make: Callable[..., str], cookie: str, path: str, headers: dict[str, str]
) -> None:
    data = {"key": make(), "name": "paper"}
    answer = caller.request("POST", path, data=data, headers={**headers, "cookie": cookie})
    assert answer.status_code == 403
    assert "set-cookie" not in answer.headers
    assert "The request is of another site" in answer.text


def test_a_session_may_do_what_its_key_may_and_the_change_is_the_keys(caller: Any, cookie: str) -> None:
    answer = caller.request("POST", "/materials", data={"name": "paper"}, headers={**OWN, "cookie": cookie})
    assert answer.status_code == 303
    own = caller.get("/v1/materials/paper/owners", headers={"cookie": cookie}).json()["owners"]
    assert own[0].startswith("key:")
    assert caller.get("/v1/audit", headers={"cookie": cookie}).status_code == 403  # that is for admins


def test_a_session_of_a_key_that_may_only_read_changes_nothing(caller: Any, make: Callable[..., str]) -> None:
    cookie = log_in(caller, make("read")).headers["set-cookie"].partition(";")[0]
    answer = caller.request("POST", "/materials", data={"name": "paper"}, headers={**OWN, "cookie": cookie})
    assert answer.status_code == 403
    assert "may only read" in caller.get("/upload", headers={"cookie": cookie}).text


@pytest.mark.parametrize("path", ["/v1/materials/paper/friction?fn=0.05", "/v1/materials", "/healthz", "/login", "/"])
@pytest.mark.parametrize("end", ['"', ""])
def test_of_cookies_none_but_the_services_own_is_read(
    caller: Any, cookie: str, path: str, end: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Some versions of Python take seconds to unquote those of 16 kB (CVE-2024-7592)."""
    read: list[str] = []
    monkeypatch.setattr(requests, "cookie_parser", lambda sent: read.append(sent) or cookie_parser(sent))
    quoted = 'a="' + 5000 * '\\"' + end
    for sent in (quoted, f"{sessions.COOKIE}={quoted}", f"{quoted}; {cookie};b={quoted}"):
        caller.get(path, headers={"cookie": sent})
    assert set(read) == {cookie}


@pytest.mark.parametrize("sent", ["{}", "a=1; {}", "{};b=2", 'a="x; y" ;\t{} ', "x{};{}"])
def test_a_session_goes_on_beside_other_cookies(caller: Any, cookie: str, sent: str) -> None:
    assert caller.get("/", headers={"cookie": sent.replace("{}", cookie)}).status_code == 200


@pytest.mark.parametrize("sent", ["x{}", "{}!", "a=1,{}", '"{}"'])
def test_what_only_looks_like_a_sessions_cookie_is_none(caller: Any, cookie: str, sent: str) -> None:
    assert caller.get("/", headers={"cookie": sent.replace("{}", cookie)}).status_code == 303


def test_logging_out_ends_the_session_at_once(caller: Any, cookie: str) -> None:
    assert caller.get("/", headers={"cookie": cookie}).status_code == 200
    answer = caller.request("POST", "/logout", headers={**OWN, "cookie": cookie})
    assert (answer.status_code, answer.headers["location"]) == (303, "/login")
    assert caller.get("/", headers={"cookie": cookie}).status_code == 303


def test_a_session_ends_with_its_key(
    caller: Any, make: Callable[..., str], database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    key = make()
    headers = {"cookie": log_in(caller, key).headers["set-cookie"].partition(";")[0]}
    assert caller.get("/", headers=headers).status_code == 200
    with database.write() as session:
        access_keys.revoke(session, str(keys.key_id(key)))
    soon = time.monotonic() + authentication.KEPT_SECONDS + 0.1
    monkeypatch.setattr(authentication.time, "monotonic", lambda: soon)
    assert caller.get("/", headers=headers).status_code == 303


def test_a_key_in_the_header_counts_before_the_cookie(caller: Any, make: Callable[..., str], cookie: str) -> None:
    headers = {"cookie": cookie, "authorization": f"Bearer {make('admin')}"}
    assert caller.get("/v1/audit", headers=headers).status_code == 200
