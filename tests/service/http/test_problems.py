import asyncio
import re
from pathlib import Path

import httpx
import pytest
from fastapi import FastAPI

from db.errors import NotFound, StorageUnavailable
from service.http import errors, problems
from service.http.middleware.request_middleware import RequestMiddleware
from service.http.problems import PROBLEM_TYPES, Problem

DOCUMENTED = dict(
    re.findall(r"^\| `/problems/([\w-]+)` \| (\d+)", (Path(__file__).parents[3] / "docs/problems.md").read_text(), re.M)
)


def test_each_type_is_documented_with_its_status_and_nothing_else_is() -> None:
    assert {name: str(kind.status) for name, kind in PROBLEM_TYPES.items()} == DOCUMENTED


@pytest.mark.parametrize(
    ("method", "path", "kind", "allow"),
    [
        ("GET", "/v1/nothing", "unknown-route", None),
        ("GET", "/v1/materials/", "unknown-route", None),
        ("DELETE", "/v1/materials", "method-not-allowed", "GET, HEAD, POST"),
        ("PUT", "/v1/grasp-logs", "method-not-allowed", "GET, HEAD, POST"),
        ("POST", "/v1/jobs/1", "method-not-allowed", "GET, HEAD"),
    ],
)
def test_what_the_framework_refuses_is_a_problem_too(
    client: httpx.Client, method: str, path: str, kind: str, allow: str | None
) -> None:
    response = client.request(method, path)
    assert response.headers["content-type"] == "application/problem+json"
    assert response.headers.get("allow") == allow
    problem = response.json()
    assert problem["type"] == f"/problems/{kind}"
    assert problem["status"] == response.status_code == PROBLEM_TYPES[kind].status
    assert problem["title"] == PROBLEM_TYPES[kind].title
    assert problem["instance"] == path


async def answer_to(error: Exception) -> httpx.Response:
    app = FastAPI()
    app.add_middleware(RequestMiddleware)
    errors.install(app)

    @app.get("/")
    def fail() -> None:
        raise error

    transport = httpx.ASGITransport(app, raise_app_exceptions=False)
    async with httpx.AsyncClient(transport=transport, base_url="http://stiction") as client:
        return await client.get("/")


@pytest.mark.parametrize(
    ("error", "kind", "detail"),
    [
        (RuntimeError("a secret path"), "internal-error", "an unexpected error; the server's log has it"),
        (StorageUnavailable("database: disk full"), "storage-unavailable", "database: disk full"),
        (NotFound("blob", "00"), "file-missing", "blob is 00; allowed: its copy from a backup, put back"),
        (NotFound("idea", "00"), "internal-error", "idea is 00; allowed: the name of a stored idea"),
        (NotFound("job", "00"), "unknown-job", "job is 00; allowed: the id of a stored job"),
        (Problem(problems.NOT_READY, "wait"), "not-ready", "wait"),
    ],
    ids=lambda value: type(value).__name__,
)
def test_errors_have_their_types_and_secrets_stay_inside(error: Exception, kind: str, detail: str) -> None:
    response = asyncio.run(answer_to(error))
    assert response.headers["content-type"] == "application/problem+json"
    assert response.status_code == PROBLEM_TYPES[kind].status
    assert (response.json()["type"], response.json()["detail"]) == (f"/problems/{kind}", detail)


def test_an_outage_is_logged_in_a_line_a_request(caplog: pytest.LogCaptureFixture) -> None:
    asyncio.run(answer_to(StorageUnavailable("database: disk full\n[SQL: INSERT …]")))
    (record,) = (each for each in caplog.records if each.name == "service.http.errors")
    assert (record.getMessage(), record.exc_info) == ("storage unavailable: database: disk full", None)
