"""Room for answers that hold much: of each client its share, until the answer is sent."""

import asyncio
from contextlib import asynccontextmanager
from types import SimpleNamespace
from typing import Any

from service.domain.access.principal import Principal
from service.http import context, long_answers
from service.http.descriptions import description_of, problems
from service.http.problems import INVALID_REQUEST, INVALID_SAMPLES, NO_MODEL
from service.http.schemas.problems import ProblemOut
from service.processes.fair_queue import FairQueue


def test_room_is_taken_when_it_is_asked_for_and_held_to_the_end() -> None:
    said: list[str] = []

    class Answers:
        @asynccontextmanager
        async def turn(self, owner: str) -> Any:
            said.append(f"in {owner}")
            yield
            said.append(f"out {owner}")

    async def answer() -> None:
        here: Any = SimpleNamespace(answers=Answers())
        held = asynccontextmanager(long_answers._room)(here, Principal("key"))
        async with held as take:
            assert said == []
            await long_answers._room_taken(take)
            said.append("sent")

    asyncio.run(answer())
    assert said == ["in key", "sent", "out key"]


def test_problems_of_one_status_are_described_together_in_their_order() -> None:
    told = description_of(INVALID_SAMPLES, NO_MODEL, INVALID_REQUEST)
    assert list(told) == [409, 422]
    assert told[422] == (
        "Nothing follows from the samples (`/problems/invalid-samples`); "
        "A value in the request is not allowed (`/problems/invalid-request`)"
    )
    assert problems(NO_MODEL) == {409: {"description": told[409], "model": ProblemOut}}


def let_in(queue: FairQueue, owners: list[str]) -> int:
    """How many of those who ask are let in while none of them leaves."""

    async def run() -> int:
        inside, end = list[str](), asyncio.Event()

        async def stay(owner: str) -> None:
            async with queue.turn(owner):
                inside.append(owner)
                await end.wait()

        async with asyncio.TaskGroup() as group:
            for owner in owners:
                group.create_task(stay(owner))
            await asyncio.sleep(0.02)
            count = len(inside)
            end.set()
        assert len(inside) == len(owners)
        return count

    return asyncio.run(run())


def test_routes_and_long_bodies_have_four_turns_one_of_each_client() -> None:
    for room in (context._turns_of_routes, context._turns_of_bodies):
        assert let_in(room(), ["a"] * 5) == 1
        assert let_in(room(), list("abcdef")) == 4


def test_sixteen_long_answers_are_sent_at_once() -> None:
    assert let_in(context._room_for_answers(), [str(k) for k in range(20)]) == 16
