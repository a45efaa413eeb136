import asyncio
import json
import tracemalloc
from typing import Any

import numpy as np
import pytest

from service.http.long_json import PIECE, long_json


async def sent(members: dict[str, Any]) -> list[bytes]:
    return [bytes(piece) async for piece in long_json(members).body_iterator]  # type: ignore[arg-type]


@pytest.mark.parametrize("count", [0, 1, PIECE, PIECE + 1])
def test_an_answer_is_the_json_of_its_arrays(count: int) -> None:
    times, elements = np.linspace(0.0, 1.0, count), np.arange(count)
    members = {"onset": {"time": times, "element": elements}, "time": times, "element_area": 1e-6}
    answer = json.loads(b"".join(asyncio.run(sent(members))))
    of_kind = {"time": times.tolist(), "element": elements.tolist()}
    assert answer == {"onset": of_kind, "time": times.tolist(), "element_area": 1e-6}


def test_what_is_not_finite_becomes_null() -> None:
    assert json.loads(b"".join(asyncio.run(sent({"a": np.array([np.nan, 1.0, np.inf])})))) == {"a": [None, 1.0, None]}


def test_an_answer_takes_little_memory_beside_its_arrays() -> None:
    async def walk() -> int:
        arrays = {name: np.random.default_rng(0).random(500_000) for name in ("time", "weight")}
        tracemalloc.start()
        async for _ in long_json(arrays).body_iterator:
            pass
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return peak

    assert asyncio.run(walk()) < 4 * 2**20  # at once it is 50 MB
