import asyncio
import threading

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


def test_what_never_began_is_stopped_at_once() -> None:
    thread = PeriodicThread("test", SOON, lambda: None)
    asyncio.run(asyncio.wait_for(thread.stop(), SOON))
    assert thread.is_stopping
