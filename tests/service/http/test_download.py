"""Files as answers: the parts that are asked for, and an end that always comes."""

import asyncio
from pathlib import Path
from typing import Any

import httpx
import pytest
from fastapi import FastAPI, Request

from service.http import errors
from service.http.download import Download, checked_within
from service.http.middleware.head_requests import HeadRequests
from service.http.middleware.request_middleware import RequestMiddleware

CONTENT = bytes(range(100))


class Server:
    """Serves one file, and counts how often it was closed."""

    def __init__(self, path: Path) -> None:
        self.closed, self.ages = 0, list[float]()
        self.app = FastAPI()
        self.app.add_middleware(RequestMiddleware)
        self.app.add_middleware(HeadRequests)
        errors.install(self.app)

        @self.app.get("/file")
        def file(request: Request) -> Any:
            self.ages.append(checked_within(request))
            return Download(path, self.close, headers={"etag": '"tag"'})

        @self.app.post("/file")
        def take() -> str:
            return "taken"

    def close(self) -> None:
        self.closed += 1

    def ask(self, method: str = "GET", **headers: str) -> httpx.Response:
        async def request() -> httpx.Response:
            transport = httpx.ASGITransport(self.app, raise_app_exceptions=False)
            async with httpx.AsyncClient(transport=transport, base_url="http://stiction") as client:
                return await client.request(method, "/file", headers=headers)

        return asyncio.run(request())


@pytest.fixture
def server(tmp_path: Path) -> Server:
    (tmp_path / "file").write_bytes(CONTENT)
    return Server(tmp_path / "file")


@pytest.mark.parametrize(
    ("asked", "part"),
    [
        ("bytes=0-9", slice(0, 10)),
        ("Bytes= 90-", slice(90, 100)),
        ("bytes=-5", slice(95, 100)),
        ("bytes=50-1000", slice(50, 100)),
        ("bytes=99-99", slice(99, 100)),
    ],
)
def test_a_part_is_sent_with_where_it_is_from(server: Server, asked: str, part: slice) -> None:
    answer = server.ask(range=asked)
    assert (answer.status_code, answer.content) == (206, CONTENT[part])
    assert answer.headers["content-range"] == f"bytes {part.start}-{part.stop - 1}/100"
    assert (server.closed, server.ages) == (1, [60.0])


@pytest.mark.parametrize("asked", ["lines=0-9", "bytes=9", "bytes=a-b", "bytes 0-9", ""])
def test_what_says_nothing_of_bytes_is_passed_over(server: Server, asked: str) -> None:
    answer = server.ask(range=asked)
    assert (answer.status_code, answer.content) == (200, CONTENT)
    assert server.closed == 1


@pytest.mark.parametrize(
    ("asked", "status", "told", "length"),
    [
        (
            "bytes=100-",
            416,
            "the header Range begins behind the end of the file; allowed: within its length",
            "bytes */100",
        ),
        ("bytes=5-2", 400, "the header Range ends before it begins; allowed: such as bytes=0-1023", None),
    ],
)
def test_a_part_that_is_not_there_is_a_problem(
    server: Server, asked: str, status: int, told: str, length: str | None
) -> None:
    answer = server.ask(range=asked)
    assert (answer.status_code, answer.headers["content-type"]) == (status, "application/problem+json")
    assert answer.json()["detail"] == f"GET /file: {told}"
    assert answer.headers.get("content-range") == length
    assert answer.headers.get("etag") is None
    assert server.closed == 1


def test_a_whole_file_is_compared_with_its_hash_each_time(server: Server) -> None:
    answer = server.ask()
    assert (answer.status_code, answer.content, answer.headers["content-length"]) == (200, CONTENT, "100")
    assert (server.closed, server.ages) == (1, [0.0])


def test_a_head_has_the_length_and_no_body(server: Server) -> None:
    answer = server.ask("HEAD")
    assert (answer.status_code, answer.content, answer.headers["content-length"]) == (200, b"", "100")
    assert (server.closed, server.ages) == (1, [60.0])
    part = server.ask("HEAD", range="bytes=0-9")
    assert (part.status_code, part.content, part.headers["content-length"]) == (206, b"", "10")
    assert server.ask("POST").json() == "taken"
    assert server.ask("DELETE").status_code == 405


def test_a_file_that_is_gone_is_closed_all_the_same(server: Server, tmp_path: Path) -> None:
    (tmp_path / "file").unlink()
    assert server.ask().status_code == 500
    assert server.closed == 1
