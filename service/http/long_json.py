"""JSON answers with long arrays, which are made a piece at a time while they are sent."""

from collections.abc import Iterator, Mapping
from typing import Any

import msgspec
import numpy as np
from fastapi.responses import StreamingResponse
from numpy.typing import NDArray

PIECE = 10_000
"""Numbers made into text at once: as Python's objects and text they take ten times their bytes."""

Arrays = Mapping[str, NDArray[Any]]


def long_json(members: Mapping[str, "NDArray[Any] | float | Arrays"]) -> StreamingResponse:
    """An object with arrays [n], numbers, and objects of arrays as members; what is not finite becomes null."""
    return StreamingResponse(_object(members), media_type="application/json")


def _object(members: Mapping[str, Any]) -> Iterator[bytes]:
    before = b"{"
    for name, value in members.items():
        yield before + msgspec.json.encode(name) + b":"
        if isinstance(value, Mapping):
            yield from _object(value)
        elif isinstance(value, np.ndarray):
            yield from _array(value)
        else:
            yield msgspec.json.encode(value)
        before = b","
    yield b"}" if members else b"{}"


def _array(array: NDArray[Any]) -> Iterator[bytes]:
    before = b"["
    for start in range(0, len(array), PIECE):
        yield before + msgspec.json.encode(array[start : start + PIECE].tolist())[1:-1]
        before = b","
    yield b"]" if len(array) else b"[]"
