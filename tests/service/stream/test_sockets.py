"""Parts of a connection that go on at once, and how it is closed."""

import asyncio
from typing import Any

import pytest
from starlette.websockets import WebSocketDisconnect

from service.stream.sockets import close, until_one_ends


def test_the_first_part_to_end_ends_the_others() -> None:
    ended: list[str] = []

    async def part(name: str, seconds: float) -> None:
        try:
            await asyncio.sleep(seconds)
            ended.append(f"{name} done")
        except asyncio.CancelledError:
            ended.append(f"{name} cancelled")
            raise

    asyncio.run(until_one_ends(part("a", 60.0), part("b", 0.01), part("c", 60.0)))
    assert sorted(ended) == ["a cancelled", "b done", "c cancelled"]


def test_what_a_part_raises_is_raised_once_the_others_have_ended() -> None:
    ended: list[str] = []

    async def fail() -> None:
        raise ValueError("wrong")

    async def wait() -> None:
        try:
            await asyncio.sleep(60.0)
        finally:
            ended.append("waited")

    async def run() -> None:
        await until_one_ends(wait(), fail())

    with pytest.raises(ValueError, match="wrong"):
        asyncio.run(run())
    assert ended == ["waited"]


class Socket:
    """Notes how it is closed, or raises that it is."""

    def __init__(self, error: Exception | None = None) -> None:
        self.closed: list[tuple[int, str]] = []
        self.error = error

    async def close(self, code: int, reason: str) -> None:
        self.closed.append((code, reason))
        if self.error is not None:
            raise self.error


@pytest.mark.parametrize("error", [None, RuntimeError("closed"), WebSocketDisconnect(1006)])
def test_a_reason_has_120_bytes_at_most_and_no_half_of_a_letter(error: Exception | None) -> None:
    socket: Any = Socket(error)
    for reason in ("short", "x" * 121, "x" + "é" * 60):
        asyncio.run(close(socket, 4400, reason))
    assert socket.closed == [(4400, "short"), (4400, "x" * 120), (4400, "x" + "é" * 59)]
