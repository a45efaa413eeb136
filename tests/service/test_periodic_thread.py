import asyncio
import threading

import pytest

from service.periodic_thread import PeriodicThread

SOON = 10.0


def test_a_step_is_done_again_and_again_until_it_is_stopped() -> None:
    thrice, count = threading.Event(), 0

    def step() -> None:
        nonlocal count
        count += 1
        if count == 3:
            thrice.set()

    thread = PeriodicThread("test", 0.001, step)
    thread.start()
    assert thrice.wait(SOON)
    asyncio.run(thread.stop())
    after = count
    assert not threading.Event().wait(0.02)
    assert count == after


def test_a_step_that_sleeps_is_woken_when_it_is_to_end() -> None:
    begun, woken = threading.Event(), list[bool]()

    def step() -> None:
        begun.set()
        woken.append(thread.sleep(SOON))

    thread = PeriodicThread("test", 0.001, step)
    thread.start()
    assert begun.wait(SOON)
    asyncio.run(thread.stop())
    assert (woken, thread.is_stopping) == ([True], True)


def test_a_step_that_fails_is_logged_and_comes_again(caplog: pytest.LogCaptureFixture) -> None:
    again, failures = threading.Event(), iter([ValueError("nobody thought of it")])

    def step() -> None:
        for failure in failures:
            raise failure
        again.set()

    thread = PeriodicThread("test", 0.001, step)
    thread.start()
    assert again.wait(SOON)
    asyncio.run(thread.stop())
    assert "a step failed" in caplog.text
    assert "nobody thought of it" in caplog.text


def test_what_never_began_is_stopped_at_once() -> None:
    thread = PeriodicThread("test", SOON, lambda: None)
    asyncio.run(asyncio.wait_for(thread.stop(), SOON))
    assert thread.is_stopping
