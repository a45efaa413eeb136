"""Hand a stored log out as a file: as it is kept where that is asked for, or written anew in a reader's process."""

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from db.records import StoredGraspLog
from service import formats
from service.domain.context import Context
from service.domain.errors import FileDeleted, UnsupportedFormat


@dataclass(frozen=True, slots=True)
class LogFile:
    """A file to be sent; ``close`` it after that."""

    path: Path
    close: ExitStack


async def export(
    context: Context, log: StoredGraspLog, name: str, owner: str, room: Callable[[], Awaitable[None]]
) -> LogFile:
    """The log as a file of format ``name``; what is not there yet is made in the share of ``owner``, after ``room``.

    Raises ``FileDeleted`` where there is none, ``UnsupportedFormat`` without a library of that format, ``QueueFull``.
    """
    if not log.has_file:
        raise FileDeleted(f"the file of grasp log {log.id} was deleted, as old uploads are here")
    source = await asyncio.to_thread(context.blobs.path, log.sha256)
    with ExitStack() as spools:
        if name == "npz" and await asyncio.to_thread(formats.identify, source) == "npz":
            return LogFile(source, spools.pop_all())
        await room()
        spool = spools.enter_context(context.blobs.spool())
        try:
            await context.readers.write(source, spool.path, name, owner)
        except formats.UnsupportedFormat as error:
            raise UnsupportedFormat(error.name, error.value, error.allowed) from error
        return LogFile(spool.path, spools.pop_all())
