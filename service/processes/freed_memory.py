"""What the C library does with memory that was freed: it keeps what the next request or job will ask for again."""

import ctypes
import os
import sys

KEPT_BYTES = 16 * 2**20
"""Kept at the top of each arena; several logs of 4 MB are read with that."""

LARGE_BYTES = 8 * 2**20
"""Blocks from this size on are mapped one by one and given back at once."""

ARENAS = 2
"""Heaps that the threads share: only one of them runs Python at a time."""

_TRIM_THRESHOLD, _MMAP_THRESHOLD, _ARENA_MAX = -1, -3, -8  # malloc.h


def keep() -> None:
    """Let glibc keep freed memory within the bounds above, unless its own variables say how it is to be.

    By default it gives blocks of more than 128 KiB back and maps them anew, page by page: of the time that the server
    takes for an upload of 4 MB that was a sixth. Other C libraries have ways of their own, and are left.
    """
    is_said = any(name == "GLIBC_TUNABLES" or name.startswith("MALLOC_") for name in os.environ)
    if is_said or not sys.platform.startswith("linux"):
        return
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except AttributeError:  # musl
        return
    for parameter, value in ((_MMAP_THRESHOLD, LARGE_BYTES), (_TRIM_THRESHOLD, KEPT_BYTES), (_ARENA_MAX, ARENAS)):
        mallopt(parameter, value)
