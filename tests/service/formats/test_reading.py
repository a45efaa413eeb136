import asyncio
import os
import signal
import tempfile
import time
from collections.abc import Awaitable, Callable
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from db.errors import StorageUnavailable
from service import formats
from service.formats import parquet, reading
from service.formats.reading import Readers, convert, rewrite
from service.processes import spawned
from service.processes.fair_queue import QueueFull
from slipcore import GraspLog, InvalidInput
from stiction_client.container import encode

HOSTILE = Path(__file__).parents[2] / "data/hostile"
TABLE = b"time,marker,x,y\n" + b"".join(b"%d,%d,%d,%d\n" % (k // 9, k % 9, k % 3, k % 9 // 3) for k in range(90))


def with_readers(seconds: float, do: Callable[[Readers], Awaitable[Any]]) -> Any:
    async def run() -> Any:
        readers = Readers(seconds)
        try:
            return await do(readers)
        finally:
            await readers.stop()

    return asyncio.run(run())


@pytest.fixture(autouse=True)
def executors(monkeypatch: pytest.MonkeyPatch) -> list[ProcessPoolExecutor]:
    """Those that were made for readers."""
    made: list[ProcessPoolExecutor] = []
    start = spawned.process

    def process(prepare: Callable[[], None] | None = None) -> ProcessPoolExecutor:
        made.append(start(prepare))
        return made[-1]

    monkeypatch.setattr(spawned, "process", process)
    return made


def running(executors: list[ProcessPoolExecutor]) -> list[Any]:
    found = [process for each in executors for process in dict(getattr(each, "_processes", None) or {}).values()]
    return [process for process in found if process.is_alive()]


def test_a_reader_that_dies_takes_only_its_file_with_it(
    ramp: GraspLog, tmp_path: Path, executors: list[ProcessPoolExecutor]
) -> None:
    source, other, target = (tmp_path / name for name in ("source", "other", "target"))
    os.mkfifo(source)  # the reader waits for its bytes
    parquet.write(ramp, other)

    async def lose_one(readers: Readers) -> Any:
        lost = asyncio.ensure_future(readers.convert(source, target, "tracked markers", {}, "a key"))
        waiting = asyncio.ensure_future(readers.convert(other, target, "parquet", {}, "a key"))
        while (pipe := opened(source)) is None:
            await asyncio.sleep(0.01)
        for process in running(executors):
            process.kill()
        with pytest.raises(InvalidInput, match="such that its tracked markers reader died of it"):
            await lost
        os.close(pipe)
        return await waiting

    described = with_readers(60.0, lose_one)
    assert (described.format, described.frames, described.grid) == ("parquet", len(ramp), ramp.grid)
    assert target.read_bytes() == encode(ramp)


def opened(pipe: Path) -> int | None:
    """The pipe's other end, once somebody reads it: it has no bytes, and no end."""
    try:
        return os.open(pipe, os.O_WRONLY | os.O_NONBLOCK)
    except OSError:
        return None


def unpack(pipe: Path, ends: str) -> None:
    """In a reader's process: leave a file where files for a while belong, as a library would."""
    Path(tempfile.mkdtemp(), "unpacked").write_bytes(b"x" * 1000)
    if ends != "well":
        pipe.open("rb").read(1)
    if ends == "by an error":
        raise ValueError("what it was")


@pytest.mark.parametrize("ends", ["well", "by an error", "by being given up", "by its death"])
def test_what_a_reader_unpacked_goes_with_it(tmp_path: Path, executors: list[ProcessPoolExecutor], ends: str) -> None:
    """In a folder of the server's own, which a start clears: nobody else removes files of a process that was ended."""
    pipe, folder = tmp_path / "pipe", tmp_path / "unpacked"
    os.mkfifo(pipe)

    async def run() -> None:
        readers = Readers(60.0, make_folder=lambda: folder.mkdir() or folder)
        reading = asyncio.ensure_future(readers.derive(partial(unpack, pipe, ends), "zip"))
        while ends != "well" and (end := opened(pipe)) is None:
            await asyncio.sleep(0.01)
        if ends != "well":
            assert len([*folder.rglob("unpacked")]) == 1
        if ends == "by an error":
            os.close(end)
        elif ends == "by being given up":
            reading.cancel()
        elif ends == "by its death":
            for process in running(executors):
                process.kill()
        with suppress(ValueError, InvalidInput, asyncio.CancelledError):
            await reading
        while folder.exists():
            await asyncio.sleep(0.01)
        await readers.stop()

    asyncio.run(asyncio.wait_for(run(), 20.0))
    assert not folder.exists()


def test_a_reader_that_was_lost_between_two_files_is_no_fault_of_the_second(
    ramp: GraspLog, tmp_path: Path, executors: list[ProcessPoolExecutor]
) -> None:
    source, target = tmp_path / "source", tmp_path / "target"
    parquet.write(ramp, source)

    async def lose_between(readers: Readers) -> Any:
        await readers.convert(source, target, "parquet", {})
        for process in running(executors):
            process.kill()
            process.join()
        return await readers.convert(source, target, "parquet", {})

    assert with_readers(60.0, lose_between).frames == len(ramp)


def test_a_reader_that_hangs_between_two_files_does_not_keep_the_second(
    ramp: GraspLog, tmp_path: Path, executors: list[ProcessPoolExecutor], monkeypatch: pytest.MonkeyPatch
) -> None:
    source, target = tmp_path / "source", tmp_path / "target"
    parquet.write(ramp, source)

    async def stop_between(readers: Readers) -> Any:
        await readers.convert(source, target, "parquet", {})
        (hung,) = running(executors)
        os.kill(hung.pid, signal.SIGSTOP)
        with monkeypatch.context() as patched:
            patched.setattr(reading, "START_SECONDS", 0.2)
            chosen = readers._choose("")
            assert chosen is not None
            readers._idle.pop(chosen).timer.cancel()
            assert not await reading._runs(chosen)
        hung.join()
        return await readers.convert(source, target, "parquet", {})

    assert with_readers(60.0, stop_between).frames == len(ramp)


def test_a_file_that_is_late_by_the_clock_alone_is_to_come_again(
    tmp_path: Path, executors: list[ProcessPoolExecutor]
) -> None:
    source, target = tmp_path / "source", tmp_path / "target"
    os.mkfifo(source)  # nobody writes to it: a process that waits takes no CPU

    async def wait(readers: Readers) -> None:
        with pytest.raises(QueueFull, match=r"not read within 0.4 s by a machine that is busy"):
            await readers.convert(source, target, "tracked markers", {})
        assert not running(executors)

    with_readers(0.1, wait)


def test_a_small_file_is_read_where_its_process_has_little_of_a_core(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As beside others, or while kernels are compiled elsewhere: here it waits for its file for longer than it has."""
    monkeypatch.setattr(reading, "LEAST_SECONDS", 2.0)
    pipe, target = tmp_path / "pipe", tmp_path / "target"
    os.mkfifo(pipe)

    async def read(readers: Readers) -> Any:
        reading_ = asyncio.create_task(readers.convert(pipe, target, "tracked markers", {}))
        while (opened_pipe := opened(pipe)) is None:
            await asyncio.sleep(0.01)
        await asyncio.sleep(2.2)
        os.write(opened_pipe, TABLE)
        os.close(opened_pipe)
        return await reading_

    assert with_readers(60.0, read).frames == 10


def test_what_a_reader_refuses_is_told_as_it_is(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(b"time,marker,x,y\n0,1,2\n")

    async def refuse(readers: Readers) -> None:
        with pytest.raises(InvalidInput, match="line 2 is of 3 cells"):
            await readers.convert(source, tmp_path / "target", "tracked markers", {})

    with_readers(60.0, refuse)
    assert not formats.FORMATS["tracked markers"].plain


def test_a_file_that_keeps_its_library_busy_for_ever_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Found by mutation; the C library goes round in it and answers to nothing."""
    monkeypatch.setattr(reading, "LEAST_SECONDS", 0.5)
    monkeypatch.setattr(reading, "MOST_BY_CLOCK", 100.0)  # the machine may be busy

    async def read(readers: Readers) -> None:
        with pytest.raises(InvalidInput, match=r"file is not read within 0.53 s of CPU"):
            await readers.convert(HOSTILE / "endless-hdf5", tmp_path / "target", "hdf5", {})

    with_readers(60.0, read)


@pytest.mark.parametrize("name", ["npz", "parquet", "mcap"])
def test_a_disk_that_takes_nothing_is_not_the_files_fault(content: bytes, tmp_path: Path, name: str) -> None:
    source, target = tmp_path / "source", tmp_path / "gone" / "target"
    source.write_bytes(content)
    with pytest.raises(StorageUnavailable, match="blob folder: "):
        convert(source, target, "npz", {}) if name == "npz" else rewrite(source, target, name)


def test_readers_work_beside_each_other_and_one_key_has_half_of_them(ramp: GraspLog, tmp_path: Path) -> None:
    first, second, other, target = (tmp_path / name for name in ("first", "second", "other", "target"))
    for pipe in (first, second):
        os.mkfifo(pipe)
    parquet.write(ramp, other)

    async def crowd(readers: Readers) -> Any:
        endless = [
            asyncio.create_task(readers.convert(pipe, target, "tracked markers", {}, "hostile"))
            for pipe in (first, second)
        ]
        while (opened_first := opened(first)) is None:
            await asyncio.sleep(0.01)
        answer = await readers.convert(other, target, "parquet", {}, "honest")
        assert opened(second) is None
        for task in endless:
            task.cancel()
        await asyncio.gather(*endless, return_exceptions=True)
        os.close(opened_first)
        return answer

    assert with_readers(60.0, crowd).frames == len(ramp)


def test_a_client_that_is_gone_gives_its_reader_back_at_once(
    ramp: GraspLog, tmp_path: Path, executors: list[ProcessPoolExecutor]
) -> None:
    source, other, target = (tmp_path / name for name in ("source", "other", "target"))
    os.mkfifo(source)
    parquet.write(ramp, other)

    async def go(readers: Readers) -> Any:
        left = asyncio.create_task(readers.convert(source, target, "tracked markers", {}))
        while (pipe := opened(source)) is None:
            await asyncio.sleep(0.01)
        (process,) = running(executors)
        left.cancel()
        with pytest.raises(asyncio.CancelledError):
            await left
        async with asyncio.timeout(10.0):
            while process.is_alive():  # the pool's own thread waits for its end, too, and may be the one that is told
                await asyncio.sleep(0.01)
        os.close(pipe)
        return await readers.convert(other, target, "parquet", {})

    assert with_readers(60.0, go).frames == len(ramp)


def test_a_reader_without_work_ends_after_a_while(
    ramp: GraspLog, tmp_path: Path, executors: list[ProcessPoolExecutor], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reading, "IDLE_SECONDS", 0.2)
    source, target = tmp_path / "source", tmp_path / "target"
    parquet.write(ramp, source)

    async def rest(readers: Readers) -> Any:
        assert not executors
        await readers.convert(source, target, "parquet", {})
        (process,) = running(executors)
        deadline = time.monotonic() + 30.0
        while process.is_alive():
            assert time.monotonic() < deadline
            await asyncio.sleep(0.05)
        return await readers.convert(source, target, "parquet", {})

    assert with_readers(60.0, rest).frames == len(ramp)


def test_a_large_log_is_read_in_a_process_and_a_small_one_here(
    content: bytes, ramp: GraspLog, tmp_path: Path, executors: list[ProcessPoolExecutor]
) -> None:
    source = tmp_path / "source"
    source.write_bytes(content)

    async def read(readers: Readers) -> None:
        assert (await readers.describe(source, "npz", len(content))).frames == len(ramp)
        assert not executors
        assert (await readers.describe(source, "npz", readers._most_here)).frames == len(ramp)
        assert len(executors) == 1
        source.write_bytes(content[:-100])
        with pytest.raises(InvalidInput, match="not a complete zip"):
            await readers.describe(source, "npz", readers._most_here)

    with_readers(60.0, read)


def test_who_loses_a_reader_does_not_take_the_one_that_another_key_has_warm(
    ramp: GraspLog, tmp_path: Path, executors: list[ProcessPoolExecutor]
) -> None:
    source, other, target = (tmp_path / name for name in ("source", "other", "target"))
    os.mkfifo(source)
    parquet.write(ramp, other)

    async def lose(readers: Readers) -> None:
        await readers.convert(other, target, "parquet", {}, "honest")
        lost = asyncio.create_task(readers.convert(source, target, "tracked markers", {}, "hostile"))
        while (pipe := opened(source)) is None:
            await asyncio.sleep(0.01)
        await readers.convert(other, target, "parquet", {}, "honest")
        assert len(executors) == 2
        lost.cancel()
        await asyncio.gather(lost, return_exceptions=True)
        os.close(pipe)
        await readers.convert(other, target, "parquet", {}, "third")
        await readers.convert(other, target, "parquet", {}, "fourth")
        assert len(executors) == 3, "as many as may be: the fourth takes one that is warm"

    with_readers(60.0, lose)


@pytest.mark.parametrize("cpu", [0.06, 0.0])
def test_a_file_is_waited_for_as_long_as_it_may_take_and_no_longer(monkeypatch: pytest.MonkeyPatch, cpu: float) -> None:
    """By CPU, or by four times as long of the clock; what nobody waits for any more is not begun."""
    looks = iter([1.0, *[1.0 + cpu] * 1000])
    monkeypatch.setattr(reading, "_cpu_seconds", lambda _: next(looks))

    async def wait() -> asyncio.Future[int]:
        never: asyncio.Future[int] = asyncio.get_running_loop().create_future()
        with pytest.raises(TimeoutError if cpu else QueueFull):
            await reading._within(0.05, never, 7)
        done: asyncio.Future[int] = asyncio.get_running_loop().create_future()
        done.set_result(3)
        assert await reading._within(0.05, done, 7) == 3
        return never

    assert asyncio.run(wait()).cancelled()
