import asyncio
import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import pytest

from stiction_client import AsyncFrictionClient, ConnectionFailed, FrictionClient

TIMEOUT = 0.3
"""s"""

Heads = Callable[..., str]


@pytest.fixture
def slow_heads() -> Iterator[Heads]:
    """A service that sends an answer by the pieces that it is given, each after a pause, on one connection each."""
    servers: list[socket.socket] = []

    def serve(*answers: tuple[float, list[bytes]]) -> str:
        server = socket.create_server(("127.0.0.1", 0))
        servers.append(server)
        threading.Thread(target=accept, args=(server, answers), daemon=True).start()
        return f"http://127.0.0.1:{server.getsockname()[1]}"

    def accept(server: socket.socket, answers: tuple[tuple[float, list[bytes]], ...]) -> None:
        while True:
            try:
                connection, _ = server.accept()
            except OSError:  # the test is over
                return
            threading.Thread(target=answer, args=(connection, answers), daemon=True).start()

    def answer(connection: socket.socket, answers: tuple[tuple[float, list[bytes]], ...]) -> None:
        with connection:
            try:
                for pause, pieces in answers:
                    connection.recv(65536)
                    for piece in pieces:
                        time.sleep(pause)
                        connection.sendall(piece)
            except OSError:  # the client has gone
                pass

    yield serve
    for server in servers:
        server.close()


@pytest.fixture(params=["waiting", "awaiting"])
def call(request: pytest.FixtureRequest) -> Callable[..., list[Any]]:
    """What either client gets who asks for materials by these names one after the other."""

    def waiting(url: str, names: list[str]) -> list[Any]:
        with FrictionClient(url, timeout=TIMEOUT) as client:
            return [client.material(name).name for name in names]

    async def awaiting(url: str, names: list[str]) -> list[Any]:
        async with AsyncFrictionClient(url, timeout=TIMEOUT) as client:
            return [(await client.material(name)).name for name in names]

    if request.param == "waiting":
        return waiting
    return lambda url, names: asyncio.run(awaiting(url, names))


def whole(material: Any) -> list[bytes]:
    body = json.dumps(material).encode()
    return [b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n" % len(body), body]


DRIP = [b"HTTP/1.1 200 OK\r\nX-Slow: ", *[b"x"] * 200]


@pytest.mark.usefixtures("quick")
def test_a_head_that_drips_is_a_broken_connection(slow_heads: Heads, call: Any) -> None:
    """Each byte came in time, and a planner waited for as many as a head may have."""
    began = time.monotonic()
    with pytest.raises(ConnectionFailed, match=r"not whole in time|ReadTimeout"):
        call(slow_heads((0.02, DRIP)), ["paper"])
    assert time.monotonic() - began < 8 * TIMEOUT  # three attempts


@pytest.mark.usefixtures("quick")
def test_so_it_is_on_a_connection_that_is_kept(slow_heads: Heads, call: Any, answers: SimpleNamespace) -> None:
    """The second attempt goes by a new one."""
    began = time.monotonic()
    url = slow_heads((0.0, whole(answers.material)), (0.02, DRIP))
    assert call(url, ["paper"] * 2) == ["paper"] * 2
    assert time.monotonic() - began < 8 * TIMEOUT


def test_a_body_has_its_own_time_after_its_head(slow_heads: Heads, call: Any, answers: SimpleNamespace) -> None:
    url = slow_heads((0.7 * TIMEOUT, whole(answers.material)))
    assert call(url, ["paper"]) == ["paper"]
