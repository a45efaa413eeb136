"""What a page of another site, or a proxy that strangers come through, gets of a service that asks nobody for a key."""

import asyncio
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any

import httpx
import pytest

from service.cli import main
from service.cli.exit_codes import INPUT_REFUSED
from service.serving import configuration
from service.settings import Settings
from tests import forking

Reach = Callable[..., Any]
ONLY_SQLITE = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
LOCAL = ("auto", "127.0.0.1", "127.0.0.1")
PROXY_HEADERS = (
    *("Forwarded", "Forwarded-For", "Via", "X-Forwarded", "X-Forwarded-For", "X-Forwarded-Host", "X-Forwarded-Proto"),
    *("X-Forward-For", "X-Real-IP", "X-Client-IP", "X-Cluster-Client-IP", "X-Remote-Addr", "X-Remote-IP", "Client-IP"),
    *("X-Original-Forwarded-For", "X-Original-Host", "X-Original-URL", "X-Rewrite-URL", "X-Originating-IP"),
    *("X-ProxyUser-IP", "True-Client-IP", "CF-Connecting-IP", "CF-Connecting-IPv6", "CF-Ray", "CDN-Loop"),
    *("Fastly-Client-IP", "Fly-Client-IP", "X-Envoy-External-Address", "X-Amzn-Trace-Id", "X-Azure-ClientIP"),
    "X-AppEngine-User-IP",
)
CHANGES = (
    ("POST", "/v1/materials"),
    ("POST", "/v1/grasp-logs"),
    ("POST", "/v1/materials/paper/fits"),
    ("POST", "/v1/jobs/x/cancel"),
    ("PATCH", "/v1/materials/paper"),
    ("PUT", "/v1/grasp-logs/x/withdrawal"),
    ("DELETE", "/v1/materials/paper/aliases/x"),
)
FROM_ELSEWHERE = (
    {"Sec-Fetch-Site": "cross-site"},
    {"Sec-Fetch-Site": "same-site"},
    {"Sec-Fetch-Site": "cross-site", "Origin": "http://127.0.0.1"},
    {"Origin": "https://evil.example"},
    {"Origin": "null"},
    {"Origin": "http://127.0.0.1:3000"},
    {"Origin": "http://127.0.0.1.evil.example"},
    {"Origin": "file://"},
    {"Origin": ""},
)
FROM_HERE = (
    {},
    {"Sec-Fetch-Site": "same-origin", "Origin": "http://127.0.0.1"},
    {"Sec-Fetch-Site": "none"},
    {"Origin": "http://127.0.0.1"},
    {"Origin": "http://127.0.0.1:80"},
)


@ONLY_SQLITE
@pytest.mark.parametrize("access", ["auto", "open"])
def test_a_page_of_another_site_changes_nothing(reach: Reach, access: str) -> None:
    local = reach(access, *LOCAL[1:])
    for headers, (method, path) in product(FROM_ELSEWHERE, CHANGES):
        answer = local.request(method, path, json={"name": "paper"}, headers=headers)
        assert answer.status_code == httpx.codes.FORBIDDEN, (headers, path)
        assert answer.json()["type"] == "/problems/cross-site-request"
    assert local.get("/v1/materials").json()["items"] == []


@ONLY_SQLITE
def test_a_page_of_another_site_opens_no_stream(reach: Reach) -> None:
    local = reach(*LOCAL)
    for headers in FROM_ELSEWHERE:
        local.headers = headers
        assert local.open_stream("/v1/stream").status_code == httpx.codes.FORBIDDEN, headers


@ONLY_SQLITE
def test_programs_and_the_services_own_pages_are_let_in(reach: Reach) -> None:
    local = reach(*LOCAL)
    for number, headers in enumerate(FROM_HERE):
        local.headers = {"Host": "127.0.0.1", **headers}
        made = local.request("POST", "/v1/materials", json={"name": f"paper {number}"})
        assert made.status_code == httpx.codes.CREATED, headers
        assert local.open_stream("/v1/stream").status_code == httpx.codes.SWITCHING_PROTOCOLS, headers


@ONLY_SQLITE
def test_reading_and_keys_go_by_what_they_did_before(reach: Reach, make: Callable[..., str]) -> None:
    elsewhere = {"Sec-Fetch-Site": "cross-site", "Origin": "https://evil.example"}
    assert reach(*LOCAL).get("/v1/materials", headers=elsewhere).status_code == httpx.codes.OK
    with_key = reach(*LOCAL, key=make("upload"))
    made = with_key.request("POST", "/v1/materials", json={"name": "paper"}, headers=elsewhere)
    assert made.status_code == httpx.codes.CREATED


@ONLY_SQLITE
def test_a_body_needs_a_type_that_no_form_sends(reach: Reach, content: bytes) -> None:
    local = reach(*LOCAL)
    paths = ("/v1/grasp-logs", "/v1/materials", "/v1/grasp-force", "/v1/recognise")
    types = (None, "text/plain", "application/x-www-form-urlencoded", "multipart/form-data")
    for path, sent in product(paths, types):
        answer = local.request("POST", path, content=content, headers={} if sent is None else {"Content-Type": sent})
        assert (answer.status_code, answer.json()["type"]) == (415, "/problems/unsupported-format"), (path, sent)
        assert answer.json()["name"] == "content type"


@ONLY_SQLITE
def test_who_comes_through_a_proxy_is_asked_for_a_key(reach: Reach, make: Callable[..., str]) -> None:
    local, with_key = reach(*LOCAL), reach(*LOCAL, key=make())
    for header in PROXY_HEADERS:
        local.headers = {header: "127.0.0.1"}
        answer = local.get("/v1/materials")
        assert (answer.status_code, answer.json()["type"]) == (401, "/problems/key-required"), header
        assert "passed a proxy" in answer.json()["detail"]
        assert local.open_stream("/v1/stream").status_code == httpx.codes.UNAUTHORIZED, header
        assert with_key.get("/v1/materials", headers=local.headers).status_code == httpx.codes.OK


def seen_address(settings: Settings, forwarded_for: str) -> str:
    """The address that the application gets to see of a caller on this machine."""
    seen: list[str] = []

    async def note(scope: Any, receive: Any, send: Any) -> None:  # noqa: ARG001
        seen.append(scope["client"][0])

    served = configuration(settings)
    served.app = note
    served.load()
    headers = [(b"x-forwarded-for", forwarded_for.encode())]
    scope = {"type": "http", "client": ("127.0.0.1", 1), "headers": headers, "scheme": "http"}
    asyncio.run(served.loaded_app(scope, None, None))  # type: ignore[arg-type]
    return seen[0]


@pytest.mark.parametrize(
    ("trusted", "expected"), [("", "127.0.0.1"), ("127.0.0.1", "10.0.0.9"), ("10.0.0.7", "127.0.0.1")]
)
def test_only_a_proxy_that_is_named_says_for_whom_it_asks(
    monkeypatch: pytest.MonkeyPatch, trusted: str, expected: str
) -> None:
    monkeypatch.setenv("FORWARDED_ALLOW_IPS", "*")
    assert seen_address(Settings(trusted_proxies=trusted), "10.0.0.9") == expected


def test_a_start_that_is_refused_says_why_in_a_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("STICTION_DATA_FOLDER", str(tmp_path))
    monkeypatch.setenv("STICTION_WORKERS", "0")
    assert forking.exit_code(main, ["serve", "--host", "0.0.0.0", "--port", "0"]) == INPUT_REFUSED == 3
    told = capfd.readouterr().err
    assert (
        "host is 0.0.0.0, access is auto, and there are no keys; allowed: make one with `stiction keys create`" in told
    )
    assert "Traceback" not in told
