"""Read uploads: our own formats in a thread, those of other people's libraries in a process of their own.

That process may take so much memory and time and no more, and if a library crashes on a hostile file, it takes only
that process with it. What comes out is a Stiction container, so that nothing after it needs the library again.
"""

import asyncio
import os
import resource
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeVar

from db.blobs import disk_errors_named
from db.errors import StorageUnavailable
from service import formats
from service.formats import writing
from service.processes import spawned
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog
from stiction_client import container

MEMORY_BYTES = 2 * 2**30
"""Address space that a reader may take beyond what it has when it starts: eight times what it may read of a file."""

LEAST_SECONDS, SLOWEST = 5.0, 1e6
"""s that any file may take, and bytes that earn it another; a table of markers, the slowest to read, does 3e6 a second.
A damaged file can keep a library busy for ever."""

Result = TypeVar("Result")
Settings = Mapping[str, float | str | None]


@dataclass(frozen=True, slots=True)
class Description:
    """What the service notes of a log: name of its ``format``, ``duration`` in s."""

    format: str
    sensor: str
    frames: int
    duration: float
    grid: tuple[int, int]


def describe(name: str, log: GraspLog) -> Description:
    """A log of this format in a few numbers."""
    return Description(name, log.sensor, len(log), float(log.time[-1] - log.time[0]), log.grid)


def read_plain(path: Path, name: str) -> Description:
    """Read a log in one of our own formats; raises ``InvalidInput``."""
    return describe(name, formats.read(path, formats.FORMATS[name].content_type))


class Readers:
    """The process that reads all other formats, started when it is first needed and again when it is lost."""

    def __init__(self, seconds: float = 60.0) -> None:
        self._seconds = seconds
        self._executor: ProcessPoolExecutor | None = None
        self._one_at_a_time = asyncio.Lock()

    async def convert(self, source: Path, target: Path, name: str, settings: Settings) -> Description:
        """Read a log of format ``name`` and write it to ``target`` as a container; raises ``InvalidInput``."""
        seconds = min(self._seconds, LEAST_SECONDS + source.stat().st_size / SLOWEST)
        return await self._do(partial(convert, source, target, name, dict(settings)), name, seconds)

    async def write(self, source: Path, target: Path, name: str) -> None:
        """Write a stored log to ``target`` in the format ``name``; raises ``UnsupportedFormat``."""
        await self._do(partial(rewrite, source, target, name), name, self._seconds)

    async def _do(self, do: Callable[[], Result], name: str, seconds: float) -> Result:
        async with self._one_at_a_time:
            loop = asyncio.get_running_loop()
            try:
                executor = await self._started()
                return await asyncio.wait_for(loop.run_in_executor(executor, do), seconds)
            except TimeoutError as error:
                await self._end()
                raise InvalidInput("file", f"not read within {seconds:.3g} s", "a smaller or undamaged file") from error
            except BrokenProcessPool as error:
                await self._end()
                raise InvalidInput("file", f"such that its {name} reader died of it", "an undamaged file") from error

    async def _started(self) -> ProcessPoolExecutor:
        """The process, once it runs: a new one in place of one that was lost between two files."""
        for _ in range(2):
            if self._executor is None:
                self._executor = spawned.process(_bound)
            try:
                await asyncio.get_running_loop().run_in_executor(self._executor, os.getpid)
            except BrokenProcessPool:
                await self._end()
            else:
                return self._executor
        raise StorageUnavailable("the process that reads uploads does not start")

    async def stop(self) -> None:
        """End the process, whatever it is doing."""
        await self._end()

    async def _end(self) -> None:
        if self._executor is None:
            return
        executor, self._executor = self._executor, None
        spawned.kill(executor)
        await asyncio.to_thread(executor.shutdown, cancel_futures=True)


def convert(source: Path, target: Path, name: str, settings: Settings) -> Description:
    """In the reader's process: a log of format ``name`` as a container at ``target``."""
    try:
        log = formats.read(source, formats.FORMATS[name].content_type, **settings)
        with disk_errors_named():
            container.write(log, target)
    except MemoryError as error:
        raise InvalidInput(
            "file", f"in need of more than {MEMORY_BYTES} bytes", "a smaller or undamaged file"
        ) from error
    return describe(name, log)


def rewrite(source: Path, target: Path, name: str) -> None:
    """In the reader's process: a stored log in the format ``name`` at ``target``."""
    log = formats.read(source)
    with disk_errors_named():
        writing.write(log, target, name)


def _bound() -> None:
    """Bound the memory of this process."""
    for name in ("h5py", "pyarrow.parquet", "rosbags.typesys"):  # their libraries take address space of their own
        _import_if_there(name)
    with open("/proc/self/statm", encoding="ascii") as stream:
        now = int(stream.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    resource.setrlimit(resource.RLIMIT_AS, (now + MEMORY_BYTES, now + MEMORY_BYTES))


def _import_if_there(name: str) -> None:
    try:
        __import__(name)
    except ModuleNotFoundError:
        return
