"""However many requests of an address come at once, one of them begins in a round of the event loop."""

import asyncio
from itertools import groupby

import pytest
from starlette.types import Receive, Scope, Send

from service.http.fair_starts import FairStarts


async def nothing(*_: object) -> None:
    raise AssertionError("neither read nor answered")


def begun(addresses: str, cancelled: int | None = None, kind: str = "http") -> list[str]:
    """Who began in each round of the event loop, of requests that came in this order in one round."""
    order: list[str] = []

    async def note(scope: Scope, receive: Receive, send: Send) -> None:  # noqa: ARG001
        order.append(scope["client"][0])

    async def check() -> None:
        starts = FairStarts(note)
        asked = [
            asyncio.ensure_future(starts({"type": kind, "client": (address, 1)}, nothing, nothing))
            for address in addresses
        ]
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


def test_who_has_gone_begins_nothing_and_holds_nobody_up() -> None:
    assert "".join(begun("aaab", cancelled=1)).count("a") == 2


def test_the_start_of_the_server_takes_no_turn() -> None:
    seen: list[str] = []

    async def note(scope: Scope, receive: Receive, send: Send) -> None:  # noqa: ARG001
        seen.append(scope["type"])

    asyncio.run(FairStarts(note)({"type": "lifespan"}, nothing, nothing))
    assert seen == ["lifespan"]
