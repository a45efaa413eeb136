import asyncio
import logging
from typing import Any

import httpx
import pytest
from fastapi import APIRouter
from fastapi.responses import HTMLResponse

from service.http.access import READ
from service.http.middleware import request_middleware
from service.observability.logs import ABOUT

Reach = Any
pytestmark = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)


@pytest.fixture
def client(reach: Reach) -> Any:
    """An application with two routes more: one that fails, one that reads its body and tells its request's id."""
    client, router = reach("open"), APIRouter()

    @router.get("/v1/fail", dependencies=[READ])
    def fail() -> None:
        raise RuntimeError("a secret path")

    @router.get("/v1/told", dependencies=[READ])
    def told() -> object:
        return ABOUT.get()["request_id"]

    client.app.include_router(router)
    return client


@pytest.mark.parametrize("given", ["a", "3f1c-9A.e_", "x" * 128])
def test_an_id_that_was_given_is_kept_and_told(client: Any, given: str) -> None:
    answer = client.get("/v1/told", headers={"X-Request-ID": given})
    assert (answer.headers["x-request-id"], answer.json()) == (given, given)
    assert client.get("/v1/nothing", headers={"X-Request-ID": given}).json()["request_id"] == given
    assert not ABOUT.get()


@pytest.mark.parametrize("given", ["", "a b", "x" * 129, "a\tb", 'a"b', "ü".encode(), "<script>"])
def test_any_other_id_is_replaced(client: Any, given: Any) -> None:
    ids = {client.get("/v1/told", headers={"X-Request-ID": given}).headers["x-request-id"] for _ in range(2)}
    assert len(ids) == 2
    assert all(len(each) == 32 and each.isalnum() for each in ids)


def test_a_failure_is_told_by_its_id_and_kept_to_the_log(client: Any, caplog: pytest.LogCaptureFixture) -> None:
    answer = client.get("/v1/fail", headers={"X-Request-ID": "failing"})
    assert (answer.status_code, answer.headers["x-request-id"]) == (500, "failing")
    assert answer.json() == {
        "type": "/problems/internal-error",
        "title": "The service failed",
        "status": 500,
        "detail": "an unexpected error; the server's log has it",
        "instance": "/v1/fail",
        "request_id": "failing",
    }
    (record,) = [each for each in caplog.records if each.levelno >= logging.ERROR]
    assert record.getMessage() == "request failed"
    assert "a secret path" in caplog.text


@pytest.mark.parametrize("path", ["/healthz", "/v1/materials", "/v1/nothing", "/v1/fail", "/docs", "/openapi.json"])
def test_every_answer_has_the_headers_that_protect_it(client: Any, path: str) -> None:
    answer = client.get(path)
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert answer.headers["cache-control"] == "no-store"
    assert "strict-transport-security" not in answer.headers
    is_page = path == "/docs"
    assert answer.headers.get("referrer-policy") == ("same-origin" if is_page else None)
    policy = answer.headers.get("content-security-policy", "")
    assert policy.startswith("default-src 'none'") == ("frame-ancestors 'none'" in policy) == is_page
    assert "unsafe" not in policy
    assert "http" not in policy


def test_a_page_that_says_nothing_of_its_own_may_load_nothing(client: Any) -> None:
    router = APIRouter()
    router.get("/v1/page", dependencies=[READ], response_class=HTMLResponse)(lambda: "<p>")
    client.app.include_router(router)
    assert client.get("/v1/page").headers["content-security-policy"] == request_middleware.NOTHING


def test_only_over_tls_is_tls_asked_for(client: Any) -> None:
    answer = client.get("https://10.0.0.5/healthz")
    assert answer.headers["strict-transport-security"] == "max-age=31536000"


@pytest.mark.parametrize("path", ["/v1/materials/%00", "/v1/materials/a%00b/fits", "/v1/materials?search=%00", "/%00"])
def test_a_nul_is_refused_before_any_database_sees_it(client: Any, path: str) -> None:
    answer = client.get(path)
    assert (answer.status_code, answer.json()["type"]) == (400, "/problems/bad-request")


def test_headers_are_bounded(client: Any) -> None:
    answer = client.get("/healthz", headers={"X-Large": "x" * request_middleware.MOST_HEADER_BYTES})
    assert (answer.status_code, answer.json()["type"]) == (431, "/problems/headers-too-large")


@pytest.mark.parametrize(("path", "kind"), [("/v1/materials", "application/json"), ("/v1/grasp-logs", "text/csv")])
def test_a_body_that_does_not_come_is_given_up(
    client: Any, path: str, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(request_middleware, "BODY_SECONDS", 0.05)

    async def trickle() -> Any:
        yield b"{"
        await asyncio.sleep(30.0)

    answer: httpx.Response = client.request("POST", path, content=trickle(), headers={"Content-Type": kind})
    assert (answer.status_code, answer.json()["type"]) == (408, "/problems/request-timeout")
    assert answer.headers["connection"] == "close"
