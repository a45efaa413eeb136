"""Calls to the process beside the server."""

import asyncio
import os
import signal
import threading
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

import pytest

from service.processes.side_process import ProcessEnded, SideProcess


@asynccontextmanager
async def running() -> AsyncIterator[SideProcess]:
    process = await SideProcess.start()
    yield process
    await process.stop()


def with_process(body: Callable[[SideProcess], Awaitable[None]]) -> None:
    async def run() -> None:
        async with running() as process:
            await body(process)

    asyncio.run(run())


def test_calls_are_answered_in_their_order_with_results_or_errors() -> None:
    async def body(process: SideProcess) -> None:
        found = await asyncio.gather(
            process.call(os.getpid),
            process.call(int, "x"),
            process.call(len, bytes(3_000_000)),
            process.call(bytes, 3_000_000),
            return_exceptions=True,
        )
        assert found[0] != os.getpid()
        assert isinstance(found[1], ValueError)
        assert found[2:] == [3_000_000, bytes(3_000_000)]

    with_process(body)


def test_an_interrupt_meant_for_the_server_ends_no_call() -> None:
    async def body(process: SideProcess) -> None:
        process_id = await process.call(os.getpid)
        for number in (signal.SIGINT, signal.SIGTERM):
            os.kill(process_id, number)
            assert await process.call(os.getpid) == process_id

    with_process(body)


def test_who_waits_no_longer_takes_nobody_elses_answer() -> None:
    async def body(process: SideProcess) -> None:
        first, second = (asyncio.create_task(process.call(len, "x" * k)) for k in (1, 2))
        await asyncio.sleep(0)
        first.cancel()
        assert await second == 2

    with_process(body)


def test_a_process_that_ends_is_told_to_all_who_wait_and_who_come_later() -> None:
    async def body(process: SideProcess) -> None:
        end = process.call(signal.raise_signal, signal.SIGKILL)
        first, *lost = await asyncio.gather(
            process.call(time.sleep, 0.0), end, process.call(time.sleep, 0.0), return_exceptions=True
        )
        assert first is None
        assert [type(each) for each in lost] == [ProcessEnded, ProcessEnded]
        with pytest.raises(ProcessEnded):
            await process.call(os.getpid)

    with_process(body)


def test_who_is_cancelled_is_so_once_the_process_has_answered_however_often() -> None:
    async def body(process: SideProcess) -> None:
        cancelled, other = (asyncio.create_task(process.call(time.sleep, 0.2)) for _ in range(2))
        for _ in range(3):
            await asyncio.sleep(0.01)
            cancelled.cancel()
        assert not cancelled.done()
        await asyncio.wait({cancelled, other}, return_when=asyncio.FIRST_COMPLETED)
        assert cancelled.cancelled()
        await other

    with_process(body)


def test_no_call_waits_for_one_that_is_long_and_those_wait_for_each_other() -> None:
    async def body(process: SideProcess) -> None:
        long = [asyncio.create_task(process.call(time.sleep, 0.5, is_long=True)) for _ in range(2)]
        assert await process.call(len, "abc") == 3
        assert not any(each.done() for each in long)
        await long[0]
        assert not long[1].done()
        await long[1]

    with_process(body)


@pytest.mark.parametrize("is_long", [False, True])
def test_an_answer_that_cannot_be_sent_ends_the_process_and_leaves_nobody_waiting(is_long: bool) -> None:
    async def body(process: SideProcess) -> None:
        answer = asyncio.create_task(process.call(threading.Lock, is_long=is_long))
        done, _ = await asyncio.wait({answer}, timeout=20.0)
        assert done
        assert isinstance(answer.exception(), ProcessEnded)

    with_process(body)
