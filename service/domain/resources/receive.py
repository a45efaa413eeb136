"""Take in a body: streamed to disk as it comes, unpacked where it was packed on its way, bounded all along."""

import asyncio
import gzip
import sys
import zlib
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

from db.blobs import Spool
from service.domain.errors import InvalidValue, TooLarge, UnsupportedFormat, UploadInterrupted

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

CHUNK_BYTES = 2**20
"""Bytes gathered before a thread hashes and writes them: about a millisecond of work."""

LEAST_CHUNK_BYTES, BUFFER_BYTES = 2**16, 2**25
"""Bytes gathered of each of very many bodies, and of all bodies together at most, as long as those allow it."""

UNPACKING_BYTES = 2**24
"""Memory of one body that is unpacked: the window of what packed it, and a few chunks."""

WINDOW_LOG = 23
"""log₂ of the memory that unpacking zstd may take; larger windows are not for HTTP (RFC 9659)."""

EXPANSION_FROM = 16 * CHUNK_BYTES
"""Bytes unpacked before their ratio to the packed ones counts: a small log of zeros is no attack."""

InThread = Callable[..., Awaitable[None]]
"""Calls its first argument with the others in a thread."""


def _unpack_zstd(path: Path) -> zstd.ZstdFile:
    return zstd.ZstdFile(path, options={zstd.DecompressionParameter.window_log_max: WINDOW_LOG})


_UNPACKERS: dict[str, Callable[[Path], gzip.GzipFile | zstd.ZstdFile]] = {"gzip": gzip.GzipFile, "zstd": _unpack_zstd}
"""Content encodings that are undone; ``identity`` is none."""


def check_size(size: int, limit: int) -> None:
    """Raises ``TooLarge`` for a body over the limit."""
    if size > limit:
        raise TooLarge("body", f"{size} bytes or more", f"at most {limit} bytes")


def check_expansion(packed: int, unpacked: int, most: int) -> None:
    """Raises ``TooLarge`` for a body that unpacks, by its encoding or as an archive, to too many times its bytes."""
    if unpacked > max(EXPANSION_FROM, most * packed):
        value = f"{packed} bytes that unpack to {unpacked} or more"
        raise TooLarge("body", value, f"at most {most} times as many")


def check_encoding(encoding: str) -> str:
    """The content encoding, empty where there is none; raises ``UnsupportedFormat`` for one that isn't known."""
    name = encoding.strip().lower()
    if name in ("", "identity"):
        return ""
    if name not in _UNPACKERS:
        raise UnsupportedFormat("content encoding", encoding, f"{', '.join(_UNPACKERS)} or none")
    return name


class Bodies:
    """Bodies on their way, which share the memory in which their bytes gather: any of them may stop and stay."""

    def __init__(self) -> None:
        self._count = 0

    async def receive(self, spool: Spool, chunks: AsyncIterator[bytes], limit: int, in_thread: InThread) -> None:
        """Write a body to ``spool`` as it comes.

        Raises ``TooLarge`` for one over the limit, ``UploadInterrupted`` where ``chunks`` raises ``ConnectionError``.
        """
        self._count += 1
        try:
            await _receive(spool, chunks, limit, self._chunk_bytes, in_thread)
        finally:
            self._count -= 1

    def _chunk_bytes(self) -> int:
        return min(max(BUFFER_BYTES // self._count, LEAST_CHUNK_BYTES), CHUNK_BYTES)


async def _receive(
    spool: Spool, chunks: AsyncIterator[bytes], limit: int, chunk_bytes: Callable[[], int], in_thread: InThread
) -> None:
    """A chunk is written while the next is received: no faster than the disk takes it."""
    size, waiting, writing = 0, bytearray(), None
    try:
        async for chunk in chunks:
            size += len(chunk)
            check_size(size, limit)
            waiting += chunk
            if len(waiting) >= chunk_bytes():
                if writing is not None:
                    await writing
                writing, waiting = asyncio.ensure_future(in_thread(spool.write, waiting)), bytearray()
    except ConnectionError as error:
        raise UploadInterrupted(f"the connection ended after {size} bytes") from error
    finally:
        if writing is not None:
            await writing
    await in_thread(spool.write, waiting)


def unpack(packed: Spool, spool: Spool, encoding: str, limit: int, expansion: int) -> None:
    """Undo a content encoding, a chunk at a time; raises ``TooLarge`` or, of a damaged stream, ``InvalidValue``."""
    packed.flush()
    try:
        with _UNPACKERS[encoding](packed.path) as stream:
            while chunk := stream.read(CHUNK_BYTES):
                check_size(spool.size + len(chunk), limit)
                spool.write(chunk)
                check_expansion(packed.size, spool.size, expansion)
    except (EOFError, gzip.BadGzipFile, zlib.error, zstd.ZstdError) as error:
        value = f"not a complete {encoding} stream ({str(error)[:80]})"
        raise InvalidValue("body", value, f"{encoding}, as content-encoding says") from error


@asynccontextmanager
async def unless_gone(gone: Coroutine[Any, Any, None]) -> AsyncIterator[None]:
    """Ends what is waited for inside once ``gone`` has ended: raises ``UploadInterrupted``, which nobody reads."""
    watch, loop = asyncio.create_task(gone), asyncio.get_running_loop()
    is_waiting = True
    try:
        async with asyncio.timeout(None) as limit:

            def end(_: object) -> None:
                if is_waiting:  # the loop may call this when all is over
                    limit.reschedule(loop.time())

            watch.add_done_callback(end)
            try:
                yield
            finally:
                is_waiting = False
    except TimeoutError as error:
        if not limit.expired():
            raise
        raise UploadInterrupted("the connection ended before there was an answer") from error
    finally:
        watch.cancel()
        await asyncio.wait({watch})
