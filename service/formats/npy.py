"""One array in the .npy format, read from bytes that nobody vouches for."""

import math
import sys
import threading
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from slipcore.errors import InvalidInput

MAX_ARRAY_BYTES = 512 * 2**20
"""Bytes of one array, and of all arrays of one log together; ten minutes of a 20×20 sensor at 30 Hz are 300 MB."""

MAX_HEADER_BYTES = 10_000
"""numpy's own bound; a header of a plain array has 128."""

_HEADER_READERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}


class Readable(Protocol):
    """What is read of a stream."""

    def read(self, size: int = ..., /) -> bytes:
        """So many bytes, fewer at its end."""

    def tell(self) -> int:
        """How many were read."""


def read_array(stream: Readable, name: str, size: int) -> NDArray[Any]:
    """Read one array of numbers, booleans or text from a .npy of ``size`` bytes.

    What the header claims is checked against ``size`` and the limit before any memory is taken; pickled objects are
    never loaded. Raises ``InvalidInput`` named ``name``.
    """
    shape, fortran_order, dtype = _header(stream, name)
    if dtype.kind not in "biufU" or dtype.itemsize == 0:
        raise InvalidInput(name, f"of dtype {dtype}", "an array of numbers, booleans or text, without objects")
    claimed = math.prod(shape) * dtype.itemsize
    held = size - stream.tell()
    if claimed > MAX_ARRAY_BYTES:
        raise InvalidInput(name, f"{claimed} bytes by its header", f"at most {MAX_ARRAY_BYTES} bytes")
    if claimed != held:
        raise InvalidInput(name, f"{claimed} bytes by its header, {held} in the file", "a complete .npy array")
    content = stream.read(claimed)
    if len(content) != claimed:
        raise InvalidInput(name, f"cut off after {len(content)} of {claimed} bytes", "a complete .npy array")
    if dtype.kind == "U":
        _check_text(content, dtype, name)
    return np.frombuffer(content, dtype).reshape(shape, order="F" if fortran_order else "C")


def _check_text(content: bytes, dtype: np.dtype[Any], name: str) -> None:
    """Python cannot even say what a number beyond the last code point is."""
    largest = int(np.frombuffer(content, f"{dtype.byteorder}u4").max(initial=0))
    if largest > sys.maxunicode:
        raise InvalidInput(name, f"text with the code point {largest:#x}", f"code points up to {sys.maxunicode:#x}")


HEADER_LOCK = threading.Lock()
"""numpy parses a header by building a syntax tree, which CPython 3.11 does not do safely in several threads at once."""


def _header(stream: Readable, name: str) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    try:
        version = np.lib.format.read_magic(stream)
        with HEADER_LOCK:
            shape, fortran_order, dtype = _HEADER_READERS[version](stream, max_header_size=MAX_HEADER_BYTES)
    except (OSError, SystemError):
        raise  # the machine's fault, not the file's
    except Exception as error:  # numpy's parser answers hostile bytes with whatever its parts raise, even MemoryError
        detail = str(error).splitlines()[0][:100] if str(error) else type(error).__name__
        raise InvalidInput(name, f"not a .npy array ({detail})", "the .npy format, version 1.0 or 2.0") from error
    if any(isinstance(length, bool) or length < 0 for length in shape) or len(shape) > 8:
        raise InvalidInput(name, f"of shape {list(shape)}"[:100], "at most 8 axes, none negative")
    return shape, fortran_order, dtype
