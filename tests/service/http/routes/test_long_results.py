"""Results of long logs, which are sent without ever being in memory as Python's objects."""

import asyncio
import json
import tracemalloc
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from fastapi import FastAPI

import slipcore
from service.domain.access.principal import Principal
from service.domain.models.stored_results import encode_history
from service.http.access import principal
from service.http.dependencies import server_context
from service.http.long_answers import LONG_ANSWER
from service.http.long_json import long_json
from service.http.routes import grasp_logs
from service.processes import fair_queue
from service.processes.fair_queue import FairQueue, QueueFull
from slipcore import GraspLog
from slipcore.slip_state import EventList, SlipEvents

FRAMES = 200_000


def test_a_long_stick_ratio_is_sent_piece_by_piece(monkeypatch: pytest.MonkeyPatch) -> None:
    """200,000 frames, as two lists of floats, would take 16 MB, and their text 4 MB more."""
    history = SimpleNamespace(time=np.arange(FRAMES) * 0.01, stick_ratio=np.linspace(0.0, 1.0, FRAMES))
    history.stick_ratio[1] = np.nan
    monkeypatch.setattr(grasp_logs, "_find", lambda *_: SimpleNamespace(detection=SimpleNamespace(history_blob="")))
    monkeypatch.setattr(grasp_logs, "decode_history", lambda *_, **__: history)
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
    assert first == b'{"time":'
    assert peak < 3e6


def test_events_are_sent_piece_by_piece_and_without_the_maps_beside_them(
    monkeypatch: pytest.MonkeyPatch, ramp: GraspLog, tmp_path: Path
) -> None:
    """Contact and slip of each frame and element would take 2.6 MB, the events as Python's objects 3 MB."""
    count = 20_000
    of_one_kind = EventList(np.arange(count) % 64, np.arange(count) * 0.01)
    events, maps = SlipEvents(*(of_one_kind,) * 4), np.zeros((count, 8, 8), dtype=bool)
    history = replace(slipcore.detect_slip(ramp), events=events, contact=maps, slip=maps)
    path = tmp_path / "history"
    path.write_bytes(encode_history(history))
    monkeypatch.setattr(grasp_logs, "_find", lambda *_: SimpleNamespace(detection=SimpleNamespace(history_blob="")))
    context: Any = SimpleNamespace(blobs=SimpleNamespace(path=lambda _: path))

    async def length() -> int:
        answer: Any = grasp_logs.read_events(context, "0" * 32)
        return sum([len(piece) async for piece in answer.body_iterator])

    tracemalloc.start()
    try:
        sent, peak = asyncio.run(length()), tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert sent > 600_000
    assert peak < 4 * 2 * count * 8 + 1.5e6  # the stored events themselves, and a piece of text


def test_a_frame_without_contact_has_no_stick_ratio() -> None:
    answer: Any = grasp_logs.long_json({"time": np.array([0.0, 0.1]), "stick_ratio": np.array([np.nan, 0.5])})

    async def whole() -> bytes:
        return b"".join([piece async for piece in answer.body_iterator])

    assert json.loads(asyncio.run(whole())) == {"time": [0.0, 0.1], "stick_ratio": [None, 0.5]}


def test_an_answer_that_is_not_read_keeps_its_room_until_it_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each holds its arrays until its client has read them, and any number of them would be asked for."""
    monkeypatch.setattr(fair_queue, "WAIT_SECONDS", 0.05)
    app, room = FastAPI(), FairQueue(2, "answered")  # of which one owner has half
    app.dependency_overrides[principal] = lambda: Principal("key")
    app.dependency_overrides[server_context] = lambda: SimpleNamespace(answers=room)
    app.add_api_route("/long", lambda: long_json({"a": np.arange(30_000)}), dependencies=[LONG_ANSWER])

    async def ask(read: asyncio.Event) -> bytes:
        received = b""

        async def send(message: Any) -> None:
            nonlocal received
            received += message.get("body", b"")
            await read.wait()

        async def receive() -> Any:
            await asyncio.Event().wait()

        await app({"type": "http", "method": "GET", "path": "/long", "query_string": b"", "headers": []}, receive, send)
        return received

    async def ask_twice() -> None:
        read, at_once = asyncio.Event(), asyncio.Event()
        at_once.set()
        first = asyncio.create_task(ask(read))
        while not room._taken:
            await asyncio.sleep(0.001)
        with pytest.raises(QueueFull, match=r"not answered within 0\.05 s"):
            await ask(at_once)
        read.set()
        expected = list(range(30_000))
        assert json.loads(await first) == {"a": expected}
        assert json.loads(await ask(at_once)) == {"a": expected}
        assert not room._taken

    asyncio.run(ask_twice())
