"""However many requests of an address come at once, one of them begins in a round of the event loop."""

import asyncio
import time
from contextlib import nullcontext
from itertools import count, groupby, pairwise
from types import SimpleNamespace

import pytest
from starlette.requests import HTTPConnection
from starlette.types import Message, Receive, Scope, Send

from service.http.middleware.authentication import Authenticator
from service.http.middleware.fair_starts import FairStarts
from service.settings import Settings


async def nothing(*_: object) -> None:
    raise AssertionError("neither read nor answered")


class Known(Authenticator):
    """Takes what is sent for a key that was one before."""

    def __init__(self) -> None:
        super().__init__(Settings(access="keys"))

    def starts_as(self, connection: HTTPConnection) -> str:
        assert connection.client is not None
        return connection.headers.get("authorization", connection.client.host)


def begun(clients: str, cancelled: int | None = None, kind: str = "http") -> list[str]:
    """Who began in each round of the event loop, of requests that came in this order in one round.

    A small letter is an address, a capital one a key that is sent from there.
    """
    order: list[str] = []

    async def note(scope: Scope, receive: Receive, send: Send) -> None:  # noqa: ARG001
        order.append(scope["who"])

    def scope_of(who: str) -> Scope:
        headers = [(b"authorization", who.encode())] if who.isupper() else []
        return {"type": kind, "client": (who.lower(), 1), "headers": headers, "who": who}

    async def check() -> None:
        starts = FairStarts(note, Known())
        asked = [asyncio.ensure_future(starts(scope_of(who), nothing, nothing)) for who in clients]
        while not all(each.done() for each in asked):
            order.append("-")
            await asyncio.sleep(0)
            if cancelled is not None:
                asked[cancelled].cancel()

    asyncio.run(check())
    return ["".join(group) for is_round, group in groupby(order, lambda name: name == "-") if not is_round]


@pytest.mark.parametrize("kind", ["http", "websocket"])
def test_one_request_of_each_address_begins_in_a_round(kind: str) -> None:
    rounds = begun("aaaab", kind=kind)
    assert sorted(rounds[0]) == ["a", "b"], "who came last waits for nobody's others"
    assert rounds[1:] == ["a"] * 3


def test_who_has_a_key_does_not_wait_for_others_at_the_same_address() -> None:
    rounds = begun("aaaA")
    assert sorted(rounds[0]) == ["A", "a"]
    assert rounds[1:] == ["a"] * 2


def test_a_round_that_lasts_longer_than_the_time_to_wait_begins_no_second_one(monkeypatch: pytest.MonkeyPatch) -> None:
    seconds = count(step=60.0)
    monkeypatch.setattr("service.http.middleware.fair_starts.time", SimpleNamespace(monotonic=lambda: next(seconds)))
    assert begun("aaa") == ["a"] * 3


def test_who_has_gone_begins_nothing_and_holds_nobody_up() -> None:
    assert "".join(begun("aaab", cancelled=1)).count("a") == 2


def test_the_start_of_the_server_takes_no_turn() -> None:
    seen: list[str] = []

    async def note(scope: Scope, receive: Receive, send: Send) -> None:  # noqa: ARG001
        seen.append(scope["type"])

    asyncio.run(FairStarts(note, Known())({"type": "lifespan"}, nothing, nothing))
    assert seen == ["lifespan"]


def test_a_client_whose_request_took_long_to_begin_waits_for_as_long() -> None:
    """Were the next one begun at once, all that came in one round would be, in that round."""
    began: list[float] = []

    async def slow(scope: Scope, receive: Receive, send: Send) -> None:  # noqa: ARG001
        began.append(time.monotonic())
        time.sleep(0.02)

    async def check() -> None:
        starts = FairStarts(slow, Known())
        scope = {"type": "http", "client": ("a", 1), "headers": []}
        await asyncio.gather(*(starts(scope, nothing, nothing) for _ in range(4)))

    asyncio.run(check())
    assert min(after - before for before, after in pairwise(began)) >= 0.04


@pytest.mark.parametrize("waits", [0, 1, 3])
@pytest.mark.parametrize("ends", ["well", "by an error", "by being given up"])
def test_a_request_goes_on_from_its_first_wait_to_its_end(waits: int, ends: str) -> None:
    seen: list[object] = []
    patience = asyncio.Timeout(None)

    async def request(scope: Scope, receive: Receive, send: Send) -> None:
        try:
            seen.extend([await receive() for _ in range(waits)])
            if ends == "by an error":
                raise LookupError("what was asked for")
            await send({"type": "end"})
        except asyncio.CancelledError:
            seen.append(scope["path"])
            raise

    async def receive() -> Message:
        await asyncio.sleep(0)
        return {"type": "body"}

    async def send(message: Message) -> None:
        seen.append(message)
        if ends == "by being given up":
            patience.reschedule(0.0)
            await asyncio.Event().wait()

    async def check() -> None:
        scope = {"type": "http", "client": ("a", 1), "headers": [], "path": "/given-up"}
        async with patience:
            await FairStarts(request, Known())(scope, receive, send)

    error = {"well": None, "by an error": LookupError, "by being given up": TimeoutError}[ends]
    with pytest.raises(error) if error else nullcontext():
        asyncio.run(check())
    last = {"well": [{"type": "end"}], "by an error": [], "by being given up": [{"type": "end"}, "/given-up"]}[ends]
    assert seen == waits * [{"type": "body"}] + last
