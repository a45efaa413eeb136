"""Work that one client has done for it, and that takes long, leaves threads to look-ups, other clients and pages."""

import asyncio
import gzip
import threading
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest

from db import blobs
from db.repositories import jobs
from service.domain.uploads import upload
from service.http import bodies

pytestmark = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)

NPZ = {"content-type": "application/vnd.stiction.grasp-log+npz"}
MANY = 50
"""Requests at once, more than there are threads of any kind."""

TIMEOUT = 30.0
"""s after which a test has failed; nothing waits for so long otherwise."""


@dataclass
class Block:
    """Takes the place of something that takes long: does not end before it is told to."""

    begun: int = 0
    one_has_begun: threading.Event = field(default_factory=threading.Event)
    may_end: threading.Event = field(default_factory=threading.Event)

    def wait(self) -> None:
        self.begun += 1
        self.one_has_begun.set()
        self.may_end.wait(TIMEOUT)


@pytest.fixture
def attacker(reach: Callable[..., Any]) -> Any:
    return reach("open")


@pytest.fixture
def honest(attacker: Any) -> Any:
    """Somebody else at the same application."""
    return replace(attacker, address="10.0.0.8")


def beside(block: Block, attack: Callable[[], Awaitable[Any]], *asked: Callable[[], Awaitable[Any]]) -> list[int]:
    """What is answered while the attack is in the block: the status of each question."""

    async def ask() -> list[int]:
        attacks = [asyncio.ensure_future(attack()) for _ in range(MANY)]
        try:
            while not block.one_has_begun.is_set():
                await asyncio.sleep(0.001)
            return [(await asyncio.wait_for(question(), TIMEOUT / 6)).status_code for question in asked]
        finally:
            block.may_end.set()
            await asyncio.gather(*attacks, return_exceptions=True)

    return asyncio.run(ask())


def look_up(caller: Any) -> Callable[[], Awaitable[Any]]:
    """Of a material that is not known: what is in memory is not read for it."""
    return lambda: caller._request("GET", "/v1/materials/paper/friction?fn=1")


def send(caller: Any, content: bytes, **headers: str) -> Callable[[], Awaitable[Any]]:
    return lambda: caller._request("POST", "/v1/grasp-logs", content=content, headers=NPZ | headers)


@pytest.fixture
def file(attacker: Any, content: bytes) -> str:
    """The path of a stored file."""
    return f"/v1/grasp-logs/{asyncio.run(send(attacker, content)()).json()['id']}/file"


@pytest.fixture
def hashing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Block:
    """Reading a file of this test's store through; the server that all tests share reads its own from time to time."""
    block, whole = Block(), blobs._hash

    def slowly(path: Path) -> str:
        if path.is_relative_to(tmp_path):
            block.wait()
        return whole(path)

    monkeypatch.setattr(blobs, "_hash", slowly)
    return block


@pytest.mark.parametrize("headers", [{}, {"range": "bytes=0-0"}])
@pytest.mark.parametrize("method", ["HEAD", "GET"])
def test_files_that_are_compared_with_their_hash(
    attacker: Any, honest: Any, file: str, content: bytes, hashing: Block, method: str, headers: dict[str, str]
) -> None:
    answered = beside(
        hashing,
        lambda: attacker._request(method, file, headers=headers),
        look_up(honest),
        send(honest, content),
        look_up(attacker),
    )
    assert answered == [404, 200, 404]


def test_bodies_that_are_unpacked(attacker: Any, honest: Any, content: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    block, really = Block(), upload.unpack

    def unpack(packed: Any, *more: Any) -> None:
        if packed.size < 100:
            block.wait()
        really(packed, *more)

    monkeypatch.setattr(upload, "unpack", unpack)
    packed = gzip.compress(content)
    hostile = send(attacker, gzip.compress(b"no log"), **{"content-encoding": "gzip"})
    asked = look_up(honest), send(honest, content), send(honest, packed, **{"content-encoding": "gzip"})
    assert beside(block, hostile, *asked) == [404, 202, 200]


def test_dear_lists(attacker: Any, honest: Any, content: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    block = Block()
    monkeypatch.setattr(jobs, "list_all", lambda *_: block.wait() or [])  # type: ignore[func-returns-value]
    asked = look_up(honest), send(honest, content), lambda: honest._request("GET", "/v1/materials")
    assert beside(block, lambda: attacker._request("GET", "/v1/jobs"), *asked) == [404, 202, 200]


def test_long_json(attacker: Any, honest: Any, content: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    block, parse = Block(), bodies._parse_long

    def slowly(body: bytes) -> Any:
        if b"hostile" in body:
            block.wait()
        return parse(body)

    monkeypatch.setattr(bodies, "_parse_long", slowly)

    def recognise(caller: Any, name: str) -> Callable[[], Awaitable[Any]]:
        return lambda: caller._request("POST", "/v1/recognise", json={"grasp_log": name, "materials": ["x" * 70_000]})

    asked = look_up(honest), send(honest, content), recognise(honest, "honest")
    assert beside(block, recognise(attacker, "hostile"), *asked) == [404, 202, 422]
    assert block.begun == MANY, "one after the other, all were parsed in the end"


@pytest.mark.parametrize("path", ["{file}", "/v1/jobs"])
def test_who_has_gone_gives_up_its_place(
    attacker: Any, file: str, path: str, hashing: Block, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(jobs, "list_all", lambda *_: hashing.wait() or [])  # type: ignore[func-returns-value]
    scope = {"type": "http", "method": "GET", "path": path.format(file=file), "query_string": b"", "headers": []}
    scope |= {"scheme": "http", "client": (attacker.address, 50000), "server": (attacker.server, 80)}

    async def ask() -> list[Any]:
        sent: list[Any] = []
        has_gone = asyncio.Event()

        async def receive() -> Any:
            await has_gone.wait()
            return {"type": "http.disconnect"}

        async def send(message: Any) -> None:
            sent.append(message)

        before = [asyncio.ensure_future(attacker._request("GET", scope["path"])) for _ in range(2)]
        try:
            while not hashing.one_has_begun.is_set():
                await asyncio.sleep(0.001)
            asked = asyncio.ensure_future(attacker.app(scope, receive, send))
            await asyncio.sleep(0.01)
            has_gone.set()
            await asyncio.wait_for(asked, TIMEOUT / 6)
        finally:
            hashing.may_end.set()
            await asyncio.gather(*before)
        return sent

    assert asyncio.run(ask())[0]["status"] == 400, "nobody reads it"
    assert hashing.begun == 2, "not for who has gone"
