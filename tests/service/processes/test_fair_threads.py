"""Threads of which nobody has all."""

import asyncio
import gc
import threading
from collections.abc import Callable
from contextvars import ContextVar

import pytest

from service.processes.fair_threads import SHORT_AT_ONCE, FairThreads

ABOUT: ContextVar[str] = ContextVar("ABOUT")


SHORT, LONG = False, True


def begun(*asked: tuple[str, bool]) -> list[str]:
    """Who has a thread, of owners whose work, short or long, does not end, in the order in which it began."""
    owners, may_end = list[str](), threading.Event()

    def work(owner: str) -> None:
        owners.append(owner)
        may_end.wait(30.0)

    async def ask() -> list[str]:
        threads = FairThreads()
        tasks = [asyncio.create_task(threads.run(owner, work, owner, is_long=is_long)) for owner, is_long in asked]
        try:
            await asyncio.sleep(0.05)
            return list(owners)
        finally:
            may_end.set()
            await asyncio.gather(*tasks)
            threads.stop()

    return asyncio.run(ask())


def test_an_owner_has_half_of_them() -> None:
    assert begun(*[("a", SHORT)] * (SHORT_AT_ONCE + 1), ("b", SHORT)) == ["a"] * (SHORT_AT_ONCE // 2) + ["b"]


def test_an_owner_has_one_long_piece_at_once_and_short_ones_beside_it() -> None:
    assert begun(("a", LONG), ("a", LONG), ("b", SHORT), ("a", SHORT)) == ["a", "b", "a"]


def test_two_have_long_pieces_at_once_and_who_waits_for_one_keeps_nobody_from_short_ones() -> None:
    assert begun(*((owner, LONG) for owner in "abc"), *((owner, SHORT) for owner in "abcd")) == list("ababcd")


def test_results_errors_and_what_the_log_is_about_are_those_of_the_caller() -> None:
    def fail() -> None:
        raise ValueError(ABOUT.get())

    async def ask(do: Callable[[], object]) -> object:
        ABOUT.set("a request")
        return await FairThreads().run("a", do)

    assert asyncio.run(ask(ABOUT.get)) == "a request"
    with pytest.raises(ValueError, match="a request"):
        asyncio.run(ask(fail))


def test_what_fails_after_its_client_has_gone_is_told_to_nobody() -> None:
    has_begun, may_end, told = threading.Event(), threading.Event(), list[object]()

    def fail() -> None:
        has_begun.set()
        may_end.wait(30.0)
        raise ValueError

    async def ask() -> None:
        asyncio.get_running_loop().set_exception_handler(lambda _, context: told.append(context))
        task = asyncio.create_task(FairThreads().run("a", fail))
        await asyncio.to_thread(has_begun.wait)
        task.cancel()
        asyncio.get_running_loop().call_later(0.01, may_end.set)
        await asyncio.wait({task})
        del task
        gc.collect()
        await asyncio.sleep(0)

    asyncio.run(ask())
    assert told == []


def test_who_is_cancelled_gives_up_its_place_and_is_done_no_earlier_than_what_has_begun() -> None:
    did, has_begun, may_end = list[str](), threading.Event(), threading.Event()

    def work() -> None:
        has_begun.set()
        may_end.wait(30.0)
        did.append("work")

    async def ask() -> None:
        threads = FairThreads()
        first, second = (asyncio.create_task(threads.run("a", work, is_long=True)) for _ in range(2))
        await asyncio.to_thread(has_begun.wait)
        first.cancel()
        second.cancel()
        await asyncio.wait({second})
        assert not first.done()
        may_end.set()
        await asyncio.wait({first})
        assert first.cancelled()

    asyncio.run(ask())
    assert did == ["work"]
