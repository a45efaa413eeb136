"""Read uploads: small logs of our own formats in a thread, large ones and other people's formats in processes.

Such a process may take so much memory and time and no more, and if a library crashes on a hostile file, it takes only
that process with it. Of another format comes a Stiction container, so that nothing after it needs the library again.
"""

import asyncio
import os
import resource
import shutil
import tempfile
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple, TypeVar, cast

from db.blobs import disk_errors_named
from db.errors import StorageUnavailable
from service import formats
from service.formats import writing
from service.processes import limits, spawned
from service.processes.fair_queue import FairQueue, QueueFull
from service.processes.fair_threads import FairThreads
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog
from slipcore.method_choice import recommended_method
from stiction_client import container

MEMORY_BYTES = 2 * 2**30
"""Address space that a reader may take beyond what it has when it starts: eight times what it may read of a file."""

LIBRARIES = ("h5py", "pyarrow.parquet", "rosbags.typesys")
"""What readers import first, where it is installed: it takes address space of its own."""

LEAST_SECONDS, SLOWEST = 5.0, 1e6
"""s of CPU that any file may take, and bytes that earn it another; a table of markers, the slowest to read, does 3e6 a
second. A damaged file can keep a library busy for ever."""

MOST_BY_CLOCK = 4.0
"""How many times longer by the clock it may take: on a busy machine a process has a part of a core, which is no fault
of its file."""

WATCH_SECONDS = 0.1
"""s between two looks at what a file has taken."""

START_SECONDS = 60.0
"""s by the clock in which a process has to answer, before it is given a file: imports take it 1 s of CPU."""

IDLE_SECONDS = 60.0
"""s that a process without work is kept."""

WORKING_FACTOR = 6
"""Bytes that reading takes at its height for each byte of the unpacked log: up to 4.3 of NPZ and 6 of Tac3D, both in
single precision, and 1.6 of an NPZ in double precision as the client writes it."""

SHORT_BYTES = 2**20
"""Of an unpacked log that is read in some ms."""

Result = TypeVar("Result")
FormatSettings = Mapping[str, float | str | Path | None]


@dataclass(frozen=True, slots=True)
class Description:
    """What the service notes of a log: name of its ``format``, ``duration`` in s, ``method`` of detection for it."""

    format: str
    sensor: str
    frames: int
    duration: float
    grid: tuple[int, int]
    method: str


def describe(name: str, log: GraspLog) -> Description:
    """A log of this format in a few numbers."""
    duration = float(log.time[-1] - log.time[0])
    return Description(name, log.sensor, len(log), duration, log.grid, recommended_method(log))


def read_plain(path: Path, name: str) -> Description:
    """Read a log in one of our own formats; raises ``InvalidInput``."""
    with disk_errors_named():
        return describe(name, formats.read(path, formats.FORMATS[name].content_type))


class _Idle(NamedTuple):
    """A process without work: whose file it read last, and what will end it."""

    owner: str
    timer: asyncio.TimerHandle


class Readers:
    """Reads what is uploaded: small logs of our own formats in a thread, all else in processes.

    ``room``: bytes that reading may take of this process at once. A log that would need a quarter of it or more is
    read in a process, whose memory is bounded by itself. At most ``size`` processes are there, each started when it is
    first needed and ended when it is lost or long idle; a file may take ``seconds`` of CPU there, and what it unpacks
    is in a folder by ``make_folder``, which goes with it. One ``owner`` has half of the room and of the processes
    (``FairQueue``); ``QueueFull`` is raised where too many wait, or where the machine is too busy to read a file in
    ``MOST_BY_CLOCK`` times its seconds. Who is cancelled, since the client has gone, gives up its place at once.
    """

    def __init__(
        self,
        seconds: float = 60.0,
        size: int = 2,
        room: int = 2**28,
        threads: FairThreads | None = None,
        make_folder: Callable[[], Path] = lambda: Path(tempfile.mkdtemp()),
    ) -> None:
        self.room = FairQueue(room, "read")
        self._threads = threads or FairThreads()
        self._most_here = room // 4
        self._seconds = seconds
        self._turns = FairQueue(size, "read")
        self._size, self._busy = size, 0
        self._make_folder = make_folder
        self._idle: dict[ProcessPoolExecutor, _Idle] = {}

    async def describe(self, source: Path, name: str, unpacked: int, owner: str = "") -> Description:
        """Read a log in one of our own formats, of so many bytes ``unpacked``; raises ``InvalidInput``."""
        needed = WORKING_FACTOR * unpacked
        if needed >= self._most_here:
            return await self._do(partial(read_plain, source, name), name, self._seconds_for(source), owner)
        async with self.room.turn(owner, needed):
            return await self._threads.run(owner, read_plain, source, name, is_long=unpacked > SHORT_BYTES)

    async def convert(
        self, source: Path, target: Path, name: str, settings: FormatSettings, owner: str = ""
    ) -> Description:
        """Read a log of format ``name`` and write it to ``target`` as a container; raises ``InvalidInput``."""
        do = partial(convert, source, target, name, dict(settings))
        return await self._do(do, name, self._seconds_for(source), owner)

    async def write(self, source: Path, target: Path, name: str, owner: str = "") -> None:
        """Write a stored log to ``target`` in the format ``name``; raises ``UnsupportedFormat``."""
        await self._do(partial(rewrite, source, target, name), name, self._seconds, owner)

    async def derive(self, do: Callable[[], Result], name: str, owner: str = "") -> Result:
        """Do something with a stored log of format ``name``; that, its result and what it raises can be pickled."""
        return await self._do(do, name, self._seconds, owner)

    async def stop(self) -> None:
        """End the processes that nobody uses; any other ends with the request that uses it."""
        for executor in list(self._idle):
            self._retire(executor)

    def _seconds_for(self, source: Path) -> float:
        return min(self._seconds, LEAST_SECONDS + source.stat().st_size / SLOWEST)

    async def _do(self, do: Callable[[], Result], name: str, seconds: float, owner: str) -> Result:
        async with self._turns.turn(owner):
            folder = self._make_folder()
            self._busy += 1
            try:
                result, error = await self._in_process(do, name, seconds, owner, folder)
            finally:
                self._busy -= 1
                asyncio.get_running_loop().run_in_executor(None, _remove, folder)
        if error is not None:
            raise error
        return cast(Result, result)

    async def _in_process(
        self, do: Callable[[], Result], name: str, seconds: float, owner: str, folder: Path
    ) -> tuple[Result | None, Exception | None]:
        """What came of it; the process is kept, or ended where the file keeps it or has ended it."""
        executor = await self._take(owner)
        try:
            done = asyncio.get_running_loop().run_in_executor(executor, _outcome, do, folder)
            outcome = await _within(seconds, done, spawned.process_id(executor))
        except TimeoutError as lost:
            _end(executor)
            value = f"not read within {seconds:.3g} s of CPU"
            raise InvalidInput("file", value, "a smaller or undamaged file") from lost
        except BrokenProcessPool as lost:
            _end(executor)
            raise InvalidInput("file", f"such that its {name} reader died of it", "an undamaged file") from lost
        except BaseException:
            _end(executor)
            raise
        self._keep(executor, owner)
        return outcome

    async def _take(self, owner: str) -> ProcessPoolExecutor:
        """A process that runs: one that is idle, or a new one where those were lost or there is none."""
        while (executor := self._choose(owner)) is not None:
            self._idle.pop(executor).timer.cancel()
            if await _runs(executor):
                return executor
        executor = spawned.process(_bound)
        if not await _runs(executor):
            raise StorageUnavailable("the process that reads uploads does not start")
        return executor

    def _choose(self, owner: str) -> ProcessPoolExecutor | None:
        """The owner's last process; another's only where there may be no more: who loses his own waits for a new one.

        Whoever sends files by which processes are lost would otherwise take those that others have warm.
        """
        own = next((executor for executor, idle in self._idle.items() if idle.owner == owner), None)
        may_start = len(self._idle) + self._busy <= self._size  # who asks is counted and has none yet
        return own if own is not None or may_start else next(iter(self._idle), None)

    def _keep(self, executor: ProcessPoolExecutor, owner: str) -> None:
        timer = asyncio.get_running_loop().call_later(IDLE_SECONDS, self._retire, executor)
        self._idle[executor] = _Idle(owner, timer)

    def _retire(self, executor: ProcessPoolExecutor) -> None:
        self._idle.pop(executor).timer.cancel()
        executor.shutdown(wait=False)


async def _within(seconds: float, done: "asyncio.Future[Result]", process_id: int | None) -> Result:
    """What a process does; raises ``TimeoutError`` once it has taken more than so much CPU, and ``QueueFull`` where the
    machine had too little of that for it.
    """
    begin, clock = _cpu_seconds(process_id), asyncio.get_running_loop().time
    deadline = clock() + MOST_BY_CLOCK * seconds
    try:
        while not (await asyncio.wait({done}, timeout=min(WATCH_SECONDS, seconds)))[0]:
            if _cpu_seconds(process_id) - begin > seconds:
                raise TimeoutError
            if clock() > deadline:
                raise QueueFull(f"not read within {MOST_BY_CLOCK * seconds:.3g} s by a machine that is busy")
    finally:
        done.cancel()
    return await done


def _cpu_seconds(process_id: int | None) -> float:
    """CPU time of a process, s; one that is gone takes no more of it."""
    return (process_id and limits.cpu_seconds(process_id)) or 0.0


async def _runs(executor: ProcessPoolExecutor) -> bool:
    """Whether the process answers, once it has started; one that does not is ended."""
    try:
        async with asyncio.timeout(START_SECONDS):
            await asyncio.get_running_loop().run_in_executor(executor, os.getpid)
    except (BrokenProcessPool, TimeoutError):
        _end(executor)
        return False
    except BaseException:
        _end(executor)
        raise
    return True


def _end(executor: ProcessPoolExecutor) -> None:
    """End a process, whatever it is doing."""
    spawned.kill(executor)
    executor.shutdown(wait=False, cancel_futures=True)


def _remove(folder: Path) -> None:
    """Remove what was unpacked; a process that has been ended may write for another moment."""
    for _ in range(100):
        shutil.rmtree(folder, ignore_errors=True)
        if not folder.exists():
            return
        time.sleep(0.1)


def _outcome(do: Callable[[], Result], folder: Path) -> tuple[Result | None, Exception | None]:
    """In the reader's process: the result, or what was raised; what is raised here is the process's own end.

    What is unpacked on the way goes into ``folder``.
    """
    tempfile.tempdir = str(folder)
    try:
        return do(), None
    except MemoryError:
        value = f"in need of more than {MEMORY_BYTES} bytes"
        return None, InvalidInput("file", value, "a smaller or undamaged file")
    except Exception as error:
        return None, error


def convert(source: Path, target: Path, name: str, settings: FormatSettings) -> Description:
    """In the reader's process: a log of format ``name`` as a container at ``target``."""
    log = formats.read(source, formats.FORMATS[name].content_type, **settings)
    with disk_errors_named():
        container.write(log, target)
    return describe(name, log)


def rewrite(source: Path, target: Path, name: str) -> None:
    """In the reader's process: a stored log in the format ``name`` at ``target``."""
    log = formats.read(source)
    with disk_errors_named():
        writing.write(log, target, name)


def _bound() -> None:
    """Bound the memory of this process."""
    for name in LIBRARIES:
        _import_if_there(name)
    with open("/proc/self/statm", encoding="ascii") as stream:
        now = int(stream.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    resource.setrlimit(resource.RLIMIT_AS, (now + MEMORY_BYTES, now + MEMORY_BYTES))


def _import_if_there(name: str) -> None:
    try:
        __import__(name)
    except ModuleNotFoundError:
        return
