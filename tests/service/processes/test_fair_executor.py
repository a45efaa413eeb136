"""Threads for what nobody waits for, of which nobody has all."""

import subprocess
import sys
import textwrap
from collections import deque
from concurrent.futures import Future, wait
from threading import Event

import pytest

from service.processes import fair_executor
from service.processes.fair_executor import FairExecutor


def held(executor: FairExecutor) -> Event:
    """What lets the thread go on, which is at work until then."""
    begun, may_end = Event(), Event()

    def hold() -> None:
        begun.set()
        may_end.wait(30.0)

    executor.of("somebody").submit(hold)
    begun.wait(30.0)
    return may_end


def done(order: list[str], asked: list[tuple[str, str]], cancelled: tuple[str, ...] = ()) -> list[Future[None]]:
    """Work of owners, each of a name, that is all asked for before any of it begins."""
    executor = FairExecutor()
    may_end = held(executor)
    futures = [executor.of(owner).submit(order.append, name) for owner, name in asked]
    for future, (_, name) in zip(futures, asked, strict=True):
        if name in cancelled:
            assert future.cancel()
    may_end.set()
    wait(futures, 30.0)
    return futures


def test_owners_have_their_turns_one_after_the_other_and_each_in_its_order() -> None:
    order: list[str] = []
    done(order, [*(("greedy", f"g{k}") for k in range(4)), ("honest", "h0"), ("honest", "h1"), ("third", "t0")])
    assert order == ["g0", "h0", "t0", "g1", "h1", "g2", "g3"]


def test_what_is_cancelled_is_not_done() -> None:
    order: list[str] = []
    futures = done(order, [("a", "a0"), ("a", "a1"), ("a", "a2")], cancelled=("a1",))
    assert order == ["a0", "a2"]
    assert futures[1].cancelled()


def test_an_error_is_that_of_who_asked_and_the_next_one_goes_on() -> None:
    executor = FairExecutor()
    failed = executor.of("a").submit(int, "none")
    assert executor.of("a").submit(int, "12", base=3).result(30.0) == 5
    with pytest.raises(ValueError, match="none"):
        failed.result(30.0)


def test_another_does_not_wait_for_what_takes_long_and_its_owner_does() -> None:
    executor = FairExecutor(threads=2)
    may_end = held(executor)
    next_of_it = executor.of("somebody").submit(int, "1")
    assert [executor.of("another").submit(int, number).result(30.0) for number in "23"] == [2, 3]
    assert not next_of_it.done()
    may_end.set()
    assert next_of_it.result(30.0) == 1


def test_owners_whose_work_takes_long_leave_a_thread_to_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fair_executor, "LONG_SECONDS", 0.0)
    executor, has_begun, may_end = FairExecutor(threads=2), Event(), Event()

    def last() -> bool:
        has_begun.set()
        return may_end.wait(30.0)

    for owner in ("long", "as long"):
        executor.of(owner).submit(int).result(30.0)
    begun = [executor.of(owner).submit(last) for owner in ("long", "as long")]
    assert has_begun.wait(30.0)
    assert [executor.of(f"short {number}").submit(int, number).result(30.0) for number in "12"] == [1, 2]
    assert sum(future.running() for future in begun) == 1
    may_end.set()
    assert [future.result(30.0) for future in begun] == [True, True]


def test_what_waits_keeps_no_process_from_its_end() -> None:
    waits = """
        import threading
        from service.processes.fair_executor import FairExecutor
        executor, begun = FairExecutor(), threading.Event()
        for _ in range(3):
            executor.of("a").submit(lambda: (begun.set(), threading.Event().wait()))
        begun.wait()
    """
    subprocess.run([sys.executable, "-c", textwrap.dedent(waits)], check=True, timeout=30.0)


def test_work_is_long_from_a_second_of_cpu_time_on() -> None:
    """An owner whose last piece was short again is not kept from all threads but one."""
    executor = FairExecutor(2)
    executor._waiting["me"] = deque()
    executor._served.add("another")
    executor._note("another", 1.01)
    for seconds, may_go in ((0.99, True), (1.01, False), (0.5, True)):
        executor._note("me", seconds)
        assert (executor._next() == "me") is may_go
