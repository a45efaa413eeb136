"""How long a body is waited for, in a loop whose clock jumps to what comes next."""

import asyncio
import time
from collections.abc import Iterator
from typing import Any

import pytest
from starlette.middleware.exceptions import ExceptionMiddleware
from starlette.types import Message, Receive, Scope, Send

from service.http.middleware.request_middleware import BODY_SECONDS, SLOWEST_BODY, RequestMiddleware

SECOND_EARNED = b"x" * int(SLOWEST_BODY)
SCOPE = {"type": "http", "method": "POST", "path": "/", "query_string": b"", "headers": [], "scheme": "http"}


class JumpingLoop(asyncio.SelectorEventLoop):
    """Where nobody waits: its clock goes on to the next thing that is to happen."""

    def __init__(self) -> None:
        self.now = 0.0
        super().__init__()
        self._wait, self._selector.select = self._selector.select, self._jump  # type: ignore[attr-defined,has-type]

    def time(self) -> float:
        return self.now

    def _jump(self, timeout: float | None = None) -> Any:
        self.now += timeout or 0.0
        return self._wait(0.0)


@pytest.fixture
def loop(monkeypatch: pytest.MonkeyPatch) -> Iterator[JumpingLoop]:
    made = JumpingLoop()
    monkeypatch.setattr(time, "monotonic", made.time)
    yield made
    made.close()


async def _read(_scope: Scope, receive: Receive, send: Send) -> None:
    while (await receive()).get("more_body"):
        pass
    ending = await receive()
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": str(ending["type"]).encode()})


def sent(loop: JumpingLoop, pauses: list[float], body: bytes) -> list[Message]:
    """What the application answers to a body whose parts come after pauses; the end comes an hour later."""
    parts = iter(pauses)
    answers: list[Message] = []

    async def receive() -> Message:
        pause = next(parts, None)
        await asyncio.sleep(3600.0 if pause is None else pause)
        if pause is None:
            return {"type": "http.disconnect"}
        message = {"type": "http.request", "body": body}
        return message | {"more_body": True} if parts.__length_hint__() else message  # what is not told is no more

    async def send(message: Message) -> None:
        answers.append(message)

    loop.run_until_complete(RequestMiddleware(ExceptionMiddleware(_read))(dict(SCOPE), receive, send))
    return answers


def test_a_body_at_the_slowest_pace_is_waited_for(loop: JumpingLoop) -> None:
    answers = sent(loop, [0.99] * 200, SECOND_EARNED)
    assert answers[0]["status"] == 200
    assert loop.now == pytest.approx(198.0 + 3600.0)


def test_once_it_is_whole_the_end_of_the_connection_may_take_its_time(loop: JumpingLoop) -> None:
    assert sent(loop, [0.0], b"")[1]["body"] == b"http.disconnect"


def test_what_is_slower_uses_patience_up(loop: JumpingLoop) -> None:
    """Each part costs 1.6 s and earns 1: after 31 of them 1.4 s are left."""
    assert sent(loop, [1.6] * 200, SECOND_EARNED)[0]["status"] == 408
    assert loop.now == pytest.approx(31 * 1.6 + (BODY_SECONDS - 31 * 0.6))
