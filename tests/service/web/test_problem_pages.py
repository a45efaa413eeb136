"""Which problems a browser is shown as a page, and what of their answer stays."""

import asyncio
from typing import Any

import httpx
import pytest
from fastapi import FastAPI
from fastapi.responses import JSONResponse, PlainTextResponse, StreamingResponse

from service.web.problem_pages import ProblemPages

HTML = "text/html,application/xhtml+xml"


def ask(path: str, method: str = "GET", accept: str = HTML, status: int = 404) -> httpx.Response:
    app = FastAPI(openapi_url=None)
    app.add_middleware(ProblemPages)

    @app.get("/{rest:path}")
    @app.post("/{rest:path}")
    @app.put("/{rest:path}")
    def answer(rest: str) -> Any:
        if rest == "plain":
            return PlainTextResponse("fine")
        problem = {
            "type": "/problems/x",
            "title": "Not there",
            "status": status,
            "detail": f"no {rest}",
            "request_id": "r",
        }
        headers = {"retry-after": "7", "x-secret": "y", "allow": "GET", "www-authenticate": "Bearer"}
        if rest == "streamed":
            body = JSONResponse(problem).body
            parts = iter([body[:10], body[10:]])
            return StreamingResponse(parts, status, headers, media_type="application/problem+json")
        return JSONResponse(problem, status, headers, media_type="application/problem+json")

    async def request() -> httpx.Response:
        transport = httpx.ASGITransport(app)
        async with httpx.AsyncClient(transport=transport, base_url="http://stiction") as client:
            return await client.request(method, path, headers={"accept": accept})

    return asyncio.run(request())


@pytest.mark.parametrize("path", ["/nothing", "/streamed"])
@pytest.mark.parametrize("method", ["GET", "POST"])
def test_a_browser_is_shown_a_page_with_the_headers_that_say_what_to_do(path: str, method: str) -> None:
    answer = ask(path, method)
    assert (answer.status_code, answer.headers["content-type"]) == (404, "text/html; charset=utf-8")
    assert f"no {path[1:]}" in answer.text
    kept = {name: answer.headers.get(name) for name in ("retry-after", "allow", "www-authenticate", "x-secret")}
    assert kept == {"retry-after": "7", "allow": "GET", "www-authenticate": "Bearer", "x-secret": None}


@pytest.mark.parametrize(
    ("path", "method", "accept"),
    [
        ("/v1/nothing", "GET", HTML),
        ("/healthz", "GET", HTML),
        ("/metrics", "GET", HTML),
        ("/openapi.json", "GET", HTML),
        ("/readyz", "GET", HTML),
        ("/nothing", "PUT", HTML),
        ("/nothing", "GET", "application/json"),
        ("/nothing", "GET", "*/*"),
    ],
)
def test_a_program_is_told_json(path: str, method: str, accept: str) -> None:
    answer = ask(path, method, accept)
    assert (answer.status_code, answer.headers["content-type"]) == (404, "application/problem+json")
    assert answer.headers["x-secret"] == "y"


def test_what_is_no_problem_stays_as_it_is() -> None:
    answer = ask("/plain")
    assert (answer.status_code, answer.text) == (200, "fine")
    assert ask("/healthzz").headers["content-type"].startswith("text/html")


def test_who_lacks_a_key_is_led_to_the_login_and_back() -> None:
    answer = ask("/logs/a?x=1&y=ä", status=401)
    assert answer.status_code == 303
    assert answer.headers["location"] == "/login?next=%2Flogs%2Fa%3Fx%3D1%26y%3D%25C3%25A4"
    assert ask("/logs", status=401).headers["location"] == "/login?next=%2Flogs"
    assert ask("/logs", "POST", status=401).status_code == 401
