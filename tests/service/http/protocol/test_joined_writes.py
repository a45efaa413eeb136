"""What is written together leaves together, in order, and never later than a close."""

import asyncio
import socket
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from types import SimpleNamespace
from typing import cast

import pytest

from service.http.protocol import joined_writes
from service.http.protocol.joined_writes import JoinedWrites
from tests.waiting import wait_until


class Sent:
    """A transport that notes what it is told."""

    def __init__(self) -> None:
        self.told: list[bytes | str] = []
        self.is_closed = False

    def write(self, data: bytes) -> None:
        self.told.append(data)

    def get_write_buffer_size(self) -> int:
        return 5

    def get_extra_info(self, _name: str) -> None:
        return None

    def is_closing(self) -> bool:
        return self.is_closed

    def __getattr__(self, name: str) -> object:
        return lambda: self.told.append(name)


def told(*steps: str) -> list[bytes | str]:
    """What the transport is told when ``steps`` are taken: bytes to write, ``turn`` of the loop, or a method's name."""

    async def take() -> list[bytes | str]:
        sent = Sent()
        joined = JoinedWrites(cast(asyncio.Transport, sent), asyncio.get_running_loop())
        for step in steps:
            if step == "turn":
                await asyncio.sleep(0)
            elif hasattr(JoinedWrites, step) or step == "pause_reading":
                getattr(joined, step)()
            else:
                joined.write(step.encode())
        return sent.told

    return asyncio.run(take())


def test_what_is_written_in_one_turn_is_sent_in_one_piece() -> None:
    assert told("head", "body", "turn", "next", "turn") == [b"headbody", b"next"]


def test_nothing_is_overtaken_by_the_end() -> None:
    assert told("head", "body", "close", "turn") == [b"headbody", "close"]
    assert told("head", "write_eof", "turn") == [b"head", "write_eof"]
    assert told("head", "abort", "turn") == ["abort"]
    assert told("head", "pause_reading", "turn") == ["pause_reading", b"head"]


def test_a_long_body_does_not_gather_in_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(joined_writes, "MOST_WAITING_BYTES", 5)
    assert told("head", "body", "more", "turn") == [b"headbody", b"more"]


def test_nothing_is_sent_to_a_client_that_has_gone_since() -> None:
    async def told_when_it_goes() -> list[bytes | str]:
        sent = Sent()
        JoinedWrites(cast(asyncio.Transport, sent), asyncio.get_running_loop()).write(b"answer")
        sent.is_closed = True
        await asyncio.sleep(0)
        return sent.told

    assert asyncio.run(told_when_it_goes()) == []


@pytest.mark.parametrize(
    ("unsent", "unacknowledged", "slowest", "expected"),
    [
        ([0], [], 0.0, ["close"]),
        ([9, 7, 2, 0], [5, 5, 5], 0.0, ["close"]),
        ([9, 9, 9, 0], [5, 4, 3], 0.0, ["close"]),  # of what the system had taken
        ([9, 7, 7], [5, 5, 5], 0.0, ["close", "abort"]),
        ([9, 7, 5, 0], [5, 5, 5], 2e4, ["close"]),
        ([9, 7, 6], [5, 5, 5], 2e4, ["close", "abort"]),
    ],
    ids=["nothing", "read", "read slowly", "read no more", "fast enough", "too slowly"],
)
def test_who_does_not_read_the_last_bytes_is_let_go(
    unsent: list[int],
    unacknowledged: list[int],
    slowest: float,
    expected: list[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two bytes a look are asked for by ``slowest``."""
    of_system = iter(unacknowledged)
    monkeypatch.setattr(joined_writes, "UNREAD_SECONDS", 1e-4)
    monkeypatch.setattr(joined_writes, "SLOWEST_READ", slowest)
    monkeypatch.setattr(joined_writes, "_unacknowledged", lambda _: next(of_system))

    async def told_after_closing() -> list[bytes | str]:
        sent, looks = Sent(), iter(unsent)
        sent.get_write_buffer_size = lambda: next(looks)  # type: ignore[method-assign]
        JoinedWrites(cast(asyncio.Transport, sent), asyncio.get_running_loop()).close()
        for _ in range(2 * len(unsent)):
            await asyncio.sleep(0.001)
        assert next(looks, None) is None
        return sent.told

    assert asyncio.run(told_after_closing()) == expected


def read_all(connection: socket.socket) -> None:
    while connection.recv(2**20):
        pass


@pytest.mark.skipif(sys.platform != "linux", reason="this system does not tell what a client has read")
def test_what_the_system_keeps_of_what_a_client_does_not_read_is_known() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server, socket.create_connection(server.getsockname()) as client:
        connection, _ = server.accept()
        transport = cast(asyncio.Transport, SimpleNamespace(get_extra_info=lambda _: connection))
        with connection:
            assert joined_writes._unacknowledged(transport) == 0
            connection.setblocking(False)
            with suppress(BlockingIOError):
                while connection.send(bytes(2**20)):
                    pass
            assert joined_writes._unacknowledged(transport) > 0
            read = threading.Thread(target=read_all, args=[client])
            read.start()
            wait_until(lambda: joined_writes._unacknowledged(transport) == 0, "the client to read")
        read.join()


def test_what_waits_counts_as_not_sent() -> None:
    async def waiting() -> list[int]:
        joined = JoinedWrites(cast(asyncio.Transport, Sent()), asyncio.get_running_loop())
        joined.writelines([b"he", b"ad"])
        sizes = [joined.get_write_buffer_size()]
        await asyncio.sleep(0)
        return [*sizes, joined.get_write_buffer_size()]

    assert asyncio.run(waiting()) == [9, 5]


def test_who_reads_as_fast_as_more_is_written_is_kept_until_it_stops() -> None:
    soon, later = list[Callable[[], None]](), list[Callable[[], None]]()
    loop = SimpleNamespace(call_soon=soon.append, call_later=lambda _, look, least: later.append(partial(look, least)))
    sent = Sent()
    joined = JoinedWrites(cast(asyncio.Transport, sent), cast(asyncio.AbstractEventLoop, loop))
    joined.watch()
    for _ in range(3):
        joined.write(bytes(int(joined_writes.UNREAD_SECONDS * joined_writes.SLOWEST_READ)))
        soon.pop()()
        later.pop()()  # as many bytes wait as before: so many were read
        assert "abort" not in sent.told
    later.pop()()
    assert sent.told[-1] == "abort"
