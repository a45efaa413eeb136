"""A JSON header and plain arrays behind it in one message, which a script of the pages reads without copying.

The first four bytes are the header's length (little-endian). Beside what it is given, the header has ``arrays``: of
each its ``name``, ``type`` (of a JavaScript array), ``offset`` behind the header, and ``length``.
"""

import json
import struct
from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray

ALIGNMENT = 4
TYPES = {"float32": "Float32Array", "uint8": "Uint8Array", "int8": "Int8Array"}

Arrays = dict[str, NDArray[Any]]


def pack_arrays(header: Mapping[str, Any], arrays: Arrays) -> bytes:
    """The message; arrays are of the dtypes in ``TYPES``, little-endian and contiguous."""
    listed, offset = [], 0
    for name, array in arrays.items():
        listed.append({"name": name, "type": TYPES[array.dtype.name], "offset": offset, "length": array.size})
        offset += -(-array.nbytes // ALIGNMENT) * ALIGNMENT
    text = json.dumps({**header, "arrays": listed}, allow_nan=False).encode()
    text += b" " * (-len(text) % ALIGNMENT)
    padded = (array.tobytes() + bytes(-array.nbytes % ALIGNMENT) for array in arrays.values())
    return struct.pack("<I", len(text)) + text + b"".join(padded)
