import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

import pytest

from service.processes import fair_queue
from service.processes.fair_queue import AdaptiveShareQueue, FairQueue, QueueFull


class Crew:
    """Starts pieces of work that hold their turn until they are told to end."""

    def __init__(self, capacity: int, kind: type[FairQueue] = FairQueue) -> None:
        self.turns = kind(capacity, "read")
        self.begun: list[str] = []
        self._ends: dict[str, asyncio.Event] = {}
        self._tasks: dict[str, asyncio.Task[None]] = {}

    async def start(self, *names: str, weight: int = 1) -> None:
        """The owner is a name's first letter."""
        for name in names:
            self._ends[name] = asyncio.Event()
            self._tasks[name] = asyncio.create_task(self._work(name, weight))
        await settled()

    async def end(self, name: str) -> None:
        self._ends[name].set()
        await self._tasks[name]
        await settled()

    async def cancel(self, name: str) -> None:
        self._tasks[name].cancel()
        await settled()

    async def _work(self, name: str, weight: int) -> None:
        async with self.turns.turn(name[0], weight):
            self.begun.append(name)
            await self._ends[name].wait()


async def settled() -> None:
    for _ in range(10):
        await asyncio.sleep(0)


def run(do: Callable[[], Coroutine[Any, Any, None]]) -> None:
    asyncio.run(do())


def test_an_owner_takes_half_of_the_room_and_leaves_the_rest_to_others() -> None:
    async def check() -> None:
        crew = Crew(4)
        await crew.start("a1", "a2", "a3", "b1")
        assert crew.begun == ["a1", "a2", "b1"]
        await crew.end("a1")
        assert crew.begun[3:] == ["a3"]

    run(check)


def test_owners_take_turns_however_many_one_of_them_has_waiting() -> None:
    async def check() -> None:
        crew = Crew(1)
        await crew.start("a1", "a2", "a3", "a4", "b1", "c1", "b2")
        for name in ("a1", "a2", "b1", "c1", "a3", "b2"):
            await crew.end(name)
        assert crew.begun == ["a1", "a2", "b1", "c1", "a3", "b2", "a4"]

    run(check)


def test_who_needs_much_room_is_not_overtaken_by_those_who_need_little() -> None:
    async def check() -> None:
        crew = Crew(8)
        await crew.start("a1", "b1", weight=3)
        await crew.start("c1", weight=4)
        await crew.start("d1", weight=2)
        assert crew.begun == ["a1", "b1"]
        await crew.end("a1")
        assert crew.begun[2:] == ["c1"]
        await crew.end("b1")
        assert crew.begun[3:] == ["d1"]

    run(check)


def test_work_that_needs_more_than_a_share_takes_the_share() -> None:
    async def check() -> None:
        crew = Crew(8)
        await crew.start("a1", weight=1000)
        await crew.start("b1", weight=4)
        await crew.start("b2", weight=1)
        assert crew.begun == ["a1", "b1"]

    run(check)


def test_who_gives_up_waiting_leaves_its_place_and_who_gives_up_working_its_room() -> None:
    async def check() -> None:
        crew = Crew(1)
        await crew.start("a1", "b1", "c1")
        await crew.cancel("b1")
        await crew.cancel("a1")
        assert crew.begun == ["a1", "c1"]

    run(check)


def test_a_turn_that_comes_as_its_owner_gives_up_goes_to_the_next() -> None:
    async def check() -> None:
        crew = Crew(1)
        await crew.start("a1", "b1", "c1")
        crew._ends["a1"].set()
        await asyncio.sleep(0)  # the room is handed on, and b1 has not run yet
        await crew.cancel("b1")
        assert crew.begun == ["a1", "c1"]

    run(check)


@pytest.mark.parametrize("owners", ["aaaa", "abcd"])
def test_too_many_who_wait_are_refused_at_once(monkeypatch: pytest.MonkeyPatch, owners: str) -> None:
    monkeypatch.setattr(fair_queue, "MOST_WAITING_OF_ONE", 2)
    monkeypatch.setattr(fair_queue, "MOST_WAITING", 2 if owners == "abcd" else 100)

    async def check() -> None:
        crew = Crew(1)
        *let_in, last = (f"{owner}{number}" for number, owner in enumerate(owners))
        await crew.start(*let_in)
        with pytest.raises(QueueFull, match="2 wait to be read already"):
            await crew._work(last, 1)
        for name in let_in:
            await crew.end(name)
        assert crew.begun == let_in

    run(check)


def test_nobody_waits_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fair_queue, "WAIT_SECONDS", 0.01)

    async def check() -> None:
        crew = Crew(1)
        await crew.start("a1")
        with pytest.raises(QueueFull, match=r"not read within 0\.01 s"):
            await crew._work("b1", 1)
        await crew.end("a1")
        await crew.start("c1")
        assert crew.begun == ["a1", "c1"]

    run(check)


def test_of_what_lasts_as_long_as_one_likes_some_is_left_for_the_next() -> None:
    async def check() -> None:
        crew = Crew(16, AdaptiveShareQueue)
        for owner in "abcd":
            await crew.start(*(f"{owner}{k}" for k in range(10)))
        assert [sum(name[0] == owner for name in crew.begun) for owner in "abcd"] == [8, 4, 2, 1]
        await crew.start("e1")
        assert crew.begun[-1] == "e1"
        await crew.start("f1")
        await crew.end("a1")
        assert crew.begun[-1] == "f1"
        await crew.end("a2")
        assert crew.begun[-1] == "f1"  # who waits has as much as is left
        await crew.start("g1")
        assert crew.begun[-1] == "g1"

    run(check)
