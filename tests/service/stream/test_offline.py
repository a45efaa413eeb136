"""A live stream without network and detector: its access key ends, and its log is stored."""

import asyncio
import json
from collections.abc import Callable
from contextlib import nullcontext
from threading import Event
from types import SimpleNamespace
from typing import Any

import pytest

from db.database import Database
from db.repositories import access_keys
from service.domain.access import keys
from service.domain.access.principal import Principal
from service.domain.errors import KeyEnded
from service.processes.fair_threads import SHORT_AT_ONCE, FairThreads
from service.settings import Settings
from service.stream import connection
from service.stream.sessions import Streams

OPENING = {"type": "open", "position": [[[0.0, 0.0, 0.0]]], "grid": [1, 1], "element_area": 1e-6, "keep": True}


class NoDetectors(Streams):
    """Sessions that nobody detects anything in."""

    async def call(self, *_: Any, **_options: bool) -> Any:
        return {}


class Socket:
    """A client that says what it has to say, and then waits; notes what it is answered, and the code of its end."""

    def __init__(self, said: list[dict[str, Any]], at_opened: Callable[[], None]) -> None:
        self._said, self._at_opened, self.code = iter(said), at_opened, 0
        self.answers: list[dict[str, Any]] = []

    async def receive(self) -> dict[str, str]:
        message = next(self._said, None)
        if message is None:
            await asyncio.Event().wait()
        return {"type": "websocket.receive", "text": json.dumps(message)}

    async def send_text(self, text: str) -> None:
        answer = json.loads(text)
        self.answers.append(answer)
        if answer["type"] == "opened":
            self._at_opened()

    async def close(self, code: int, _reason: str) -> None:
        self.code = code


def code_of_end(database: Database, key_id: str, *said: dict[str, Any]) -> int:
    """With what a stream is closed whose key is revoked once it is open."""

    def revoke() -> None:
        with database.write() as session:
            access_keys.revoke(session, key_id)

    def store(*_: Any) -> Any:
        with database.read() as session:
            keys.check_not_ended(session, key_id)

    async def served() -> int:
        socket: Any = Socket([OPENING, *said], revoke)
        principal = Principal(key_id, None, is_admin=False)
        serving = connection.serve(socket, context_of(database), NoDetectors(), principal, store)
        await asyncio.wait_for(serving, 20.0)
        return int(socket.code)

    return asyncio.run(served())


def context_of(database: Database) -> Any:
    """Stores whose blobs are files of no name."""
    blobs = SimpleNamespace(spool=lambda: nullcontext(SimpleNamespace(path=None)))
    threads = {"threads": FairThreads(), "store_threads": FairThreads()}
    return SimpleNamespace(database=database, settings=Settings(), blobs=blobs, **threads)


def test_a_stream_ends_with_its_key(
    database: Database, make: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connection, "KEY_SECONDS", 0.05)
    assert code_of_end(database, str(keys.key_id(make("upload")))) == 4401


def test_a_log_that_may_not_be_stored_any_more_ends_its_stream(database: Database, make: Callable[..., str]) -> None:
    with pytest.raises(KeyEnded), database.read() as session:
        keys.check_not_ended(session, str(keys.key_id(make(expires_at=keys.NO_KEY.created_at))))
    finish = {"type": "finish", "store": True}
    assert code_of_end(database, str(keys.key_id(make("upload"))), finish) == 4401


def test_who_stores_many_streams_leaves_room_for_what_is_quick(database: Database) -> None:
    """His own as well as that of others: a slow store holds one of his streams at a time."""
    is_there, begun, finish = Event(), [], {"type": "finish", "store": True}

    def store(*_: Any) -> Any:
        begun.append(1)
        is_there.wait(20.0)
        return {"id": "a log"}

    async def served() -> list[Any]:
        context, principal = context_of(database), Principal(None, None, is_admin=False)
        sockets: list[Any] = [Socket([OPENING, finish], lambda: None) for _ in range(SHORT_AT_ONCE)]
        streams = [
            asyncio.ensure_future(connection.serve(socket, context, NoDetectors(), principal, store))
            for socket in sockets
        ]
        while not begun:
            assert not streams[0].done()
            await asyncio.sleep(0.001)
        for owner in (principal.share, "another"):
            assert await context.store_threads.run(owner, lambda: len(begun)) == 1
        is_there.set()
        await asyncio.gather(*streams)
        return [socket.answers[-1] for socket in sockets]

    stored = asyncio.run(asyncio.wait_for(served(), 60.0))
    assert stored == [{"type": "finished", "grasp_log": {"id": "a log"}, "findings": []}] * SHORT_AT_ONCE
