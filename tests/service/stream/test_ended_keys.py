"""A live stream whose access key ends, without network and detector."""

import asyncio
import json
from collections.abc import Callable
from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import pytest

from db.database import Database
from db.repositories import access_keys
from service.domain import keys
from service.domain.errors import KeyEnded
from service.domain.principal import Principal
from service.processes.fair_threads import FairThreads
from service.settings import Settings
from service.stream import connection
from service.stream.sessions import Streams

OPENING = {"type": "open", "position": [[[0.0, 0.0, 0.0]]], "grid": [1, 1], "element_area": 1e-6, "keep": True}


class NoDetectors(Streams):
    """Sessions that nobody detects anything in."""

    async def call(self, *_: Any) -> Any:
        return {}


class Socket:
    """A client that says what it has to say, and then waits; notes with which code it is closed."""

    def __init__(self, said: list[dict[str, Any]], at_opened: Callable[[], None]) -> None:
        self._said, self._at_opened, self.code = iter(said), at_opened, 0

    async def receive(self) -> dict[str, str]:
        message = next(self._said, None)
        if message is None:
            await asyncio.Event().wait()
        return {"type": "websocket.receive", "text": json.dumps(message)}

    async def send_text(self, text: str) -> None:
        assert json.loads(text)["type"] == "opened"
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

    def spool() -> Any:
        return nullcontext(SimpleNamespace(path=None))

    async def served() -> int:
        socket: Any = Socket([OPENING, *said], revoke)
        blobs = SimpleNamespace(spool=spool)
        threads = {"threads": FairThreads(), "store_threads": FairThreads()}
        context: Any = SimpleNamespace(database=database, settings=Settings(), blobs=blobs, **threads)
        principal = Principal(key_id, None, is_admin=False)
        await asyncio.wait_for(connection.serve(socket, context, NoDetectors(), principal, store), 20.0)
        return int(socket.code)

    return asyncio.run(served())


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
