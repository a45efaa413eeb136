"""JSON answers with long arrays, which are made a piece at a time while they are sent."""

from collections.abc import Iterator, Mapping
from typing import Any

import msgspec
from fastapi.responses import StreamingResponse
from numpy.typing import NDArray

PIECE = 10_000
"""Numbers made into text at once: as Python's objects and text they take ten times their bytes."""


def long_json(arrays: Mapping[str, NDArray[Any]], **numbers: float) -> StreamingResponse:
    """An object with a member for each array [n] and each number; what is not finite becomes null."""
    return StreamingResponse(_pieces(arrays, numbers), media_type="application/json")


def _pieces(arrays: Mapping[str, NDArray[Any]], numbers: Mapping[str, float]) -> Iterator[bytes]:
    before = b"{"
    for name, array in arrays.items():
        yield before + msgspec.json.encode(name) + b":["
        for start in range(0, len(array), PIECE):
            piece = msgspec.json.encode(array[start : start + PIECE].tolist())[1:-1]
            yield b"," + piece if start else piece
        before = b"],"
    rest = msgspec.json.encode(numbers)[1:]
    yield (b"]" if arrays else b"{") + (b"," if arrays and numbers else b"") + rest
