"""Hand a stored log out as a file: as it is kept where that is asked for, or written anew in a reader's process."""

from collections.abc import Awaitable, Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from db.records import StoredGraspLog
from service import formats
from service.domain.errors import FileDeleted, UnsupportedFormat
from service.domain.resources.context import Context


@dataclass(frozen=True, slots=True)
class LogFile:
    """A file to be sent, and the hash of its bytes; ``close`` it after that."""

    path: Path
    close: ExitStack
    sha256: str


async def export(
    context: Context,
    log: StoredGraspLog,
    name: str,
    owner: str,
    room: Callable[[], Awaitable[None]],
    checked_within: float = 0.0,
) -> LogFile:
    """The log as a file of format ``name``; what is not there yet is made in the share of ``owner``, after ``room``.

    The stored file is compared with its hash unless it was ``checked_within`` so many seconds (``BlobStore.path``).
    Raises ``FileDeleted`` where there is none, ``UnsupportedFormat`` without a library of that format, ``QueueFull``,
    and ``StorageUnavailable`` where a file would be made on a disk that is nearly full.
    """
    if not log.has_file:
        raise FileDeleted(f"the file of grasp log {log.id} was deleted, as old uploads are here")
    (source,) = await context.files(owner, [log.sha256], checked_within)
    with ExitStack() as held:
        if name == "npz" and await context.threads.run(owner, formats.identify, source) == "npz":
            try:
                stored = held.enter_context(await context.threads.run(owner, source.open, "rb"))
            except FileNotFoundError as error:
                raise FileDeleted(f"the file of grasp log {log.id} has just been deleted") from error
            there = Path(f"/dev/fd/{stored.fileno()}")  # also once it is deleted
            return LogFile(there, held.pop_all(), log.sha256)
        await room()
        await context.threads.run(owner, context.require_room)
        spool = held.enter_context(context.blobs.spool())
        try:
            await context.readers.write(source, spool.path, name, owner)
        except formats.UnsupportedFormat as error:
            raise UnsupportedFormat(error.name, error.value, error.allowed) from error
        await context.threads.run(owner, spool.adopt)
        return LogFile(spool.path, held.pop_all(), spool.sha256)
