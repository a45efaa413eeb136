"""Results of long logs, which are sent without ever being in memory as Python's objects."""

import asyncio
import json
import tracemalloc
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from service.http.routes import grasp_logs

FRAMES = 200_000


def test_a_long_stick_ratio_is_sent_piece_by_piece(monkeypatch: pytest.MonkeyPatch) -> None:
    """200,000 frames, as two lists of floats, would take 16 MB, and their text 4 MB more."""
    history = SimpleNamespace(time=np.arange(FRAMES) * 0.01, stick_ratio=np.linspace(0.0, 1.0, FRAMES))
    history.stick_ratio[1] = np.nan
    monkeypatch.setattr(grasp_logs, "_find", lambda *_: SimpleNamespace(detection=SimpleNamespace(history_blob="")))
    monkeypatch.setattr(grasp_logs, "decode_history", lambda _: history)
    context: Any = SimpleNamespace(blobs=SimpleNamespace(path=lambda _: None))

    async def peak_and_start() -> tuple[int, bytes]:
        tracemalloc.start()
        answer: Any = grasp_logs.read_stick_ratio(context, "0" * 32)
        pieces = answer.body_iterator
        first = await anext(pieces)
        async for piece in pieces:
            assert piece
        return tracemalloc.get_traced_memory()[1], first

    try:
        peak, first = asyncio.run(peak_and_start())
    finally:
        tracemalloc.stop()
    assert first == b'{"time":['
    assert peak < 3e6


def test_a_frame_without_contact_has_no_stick_ratio() -> None:
    answer: Any = grasp_logs.long_json({"time": np.array([0.0, 0.1]), "stick_ratio": np.array([np.nan, 0.5])})

    async def whole() -> bytes:
        return b"".join([piece async for piece in answer.body_iterator])

    assert json.loads(asyncio.run(whole())) == {"time": [0.0, 0.1], "stick_ratio": [None, 0.5]}
