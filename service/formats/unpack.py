"""Decompression within bounds: what a small file unpacks to is limited before it is there."""

import bz2
import io
import sys
from pathlib import Path

import lz4.frame

from slipcore.errors import InvalidInput

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

MAX_CHUNK_BYTES = 64 * 2**20
"""Bytes of one chunk of a recording, unpacked; recorders write chunks of 1 to 10 MB."""

WINDOW_LOG = 26
"""log₂ of the memory that unpacking zstd may take."""

MAX_UNPACKED_BYTES = 2 * 2**30
"""Bytes of all chunks of a recording together, unpacked one at a time: what can be gone through in seconds."""


class BoundedFile(io.BufferedReader):
    """A file that is never asked for more than it has: a length that a header claims would be memory taken."""

    def __init__(self, path: Path) -> None:
        super().__init__(io.FileIO(path))
        self.size = path.stat().st_size

    def read(self, size: int | None = -1) -> bytes:
        """So many bytes, or those that are left."""
        left = max(self.size - self.tell(), 0)
        return super().read(left if size is None or size < 0 else min(size, left))


class BoundedPath:
    """A path that opens such files, for a library that opens by itself."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def exists(self) -> bool:
        """Whether the file is there."""
        return self._path.exists()

    def open(self, mode: str = "rb") -> BoundedFile:
        """Open it, to be read."""
        assert mode == "rb"
        return BoundedFile(self._path)

    def __str__(self) -> str:
        return self._path.name


class Unpacker:
    """Unpacks the chunks of one recording, and counts what they unpack to."""

    def __init__(self) -> None:
        self._total = 0

    def unpack(self, content: bytes, compression: str, size: int | None = None) -> bytes:
        """A chunk's bytes, ``size`` of them where it is known. Raises ``InvalidInput`` for too many or damaged ones."""
        if size is not None and size > MAX_CHUNK_BYTES:
            raise InvalidInput("chunk", f"{size} bytes by its header", f"at most {MAX_CHUNK_BYTES} bytes unpacked")
        limit = MAX_CHUNK_BYTES if size is None else size
        try:
            unpacked = _unpacked(content, compression, limit)
        except (zstd.ZstdError, RuntimeError, OSError, ValueError, EOFError) as error:
            raise InvalidInput("chunk", f"damaged ({str(error)[:80]})", f"{compression or 'plain'} data") from error
        self._total += len(unpacked)
        if len(unpacked) > limit or self._total > MAX_UNPACKED_BYTES:
            allowed = f"at most {limit} bytes unpacked, {MAX_UNPACKED_BYTES} in all"
            raise InvalidInput("chunk", f"{len(unpacked)} bytes or more", allowed)
        return unpacked


def _unpacked(content: bytes, compression: str, limit: int) -> bytes:
    """At most one byte more than ``limit``, which shows that there is more."""
    if compression in ("", "none"):
        return content
    if compression == "lz4":
        return bytes(lz4.frame.LZ4FrameDecompressor().decompress(content, max_length=limit + 1))
    if compression == "bz2":
        return bz2.BZ2Decompressor().decompress(content, max_length=limit + 1)
    if compression == "zstd":
        options = {int(zstd.DecompressionParameter.window_log_max): WINDOW_LOG}
        return bytes(zstd.ZstdDecompressor(options=options).decompress(content, max_length=limit + 1))
    raise InvalidInput("chunk", f"compressed by {compression[:20]!r}", "lz4, zstd, bz2 or not at all")
