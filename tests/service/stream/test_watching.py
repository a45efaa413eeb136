"""Those who watch a live stream, without network and detector."""

import asyncio
import json
import struct
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from service.stream import broadcast as broadcasts
from service.stream import watching
from service.stream.broadcast import Broadcast, Watchers
from service.stream.errors import End
from service.stream.live_frame import pack_end
from service.stream.messages import Open
from service.stream.sessions import Session, Streams
from service.stream.watching import MOST_ON_THE_WAY, READ_TOGETHER

END = pack_end("The stream has ended.", "a1")


def header(content: bytes) -> dict[str, Any]:
    (length,) = struct.unpack_from("<I", content)
    found: dict[str, Any] = json.loads(content[4 : 4 + length])
    return found


class Reader:
    """A browser that gets frames, and says so where it reads them."""

    def __init__(self, reads: bool = True) -> None:
        self.got: list[bytes] = []
        self.closed: tuple[int, str] | None = None
        self._reads = reads
        self.said = asyncio.Semaphore(0)

    async def send_bytes(self, content: bytes) -> None:
        self.got.append(content)
        if self._reads and len(self.got) % READ_TOGETHER == 0:
            self.said.release()

    async def receive(self) -> dict[str, str]:
        await self.said.acquire()
        return {"type": "websocket.receive", "text": ""}

    async def close(self, code: int, reason: str) -> None:
        self.closed = code, reason


class OneSession(Streams):
    """A session whose frames come from the test."""

    def __init__(self) -> None:
        super().__init__()
        self.session = Session("one", Open(b"", (1, 1), 1e-6), None, "somebody")
        self._sessions["one"] = self.session


async def always() -> bool:
    return True


async def never() -> bool:
    return False


def watched(reader: Reader, frames: int, still_may: Callable[[], Awaitable[bool]] = always) -> None:
    """Watch a session of so many frames, each of which the reader has time for, to its end."""

    async def run() -> None:
        streams, socket = OneSession(), reader
        shown = streams.session.broadcast
        task = asyncio.create_task(watching.serve(socket, streams, "one", "me", still_may))  # type: ignore[arg-type]
        await asyncio.sleep(0)
        for number in range(frames):
            shown.publish(str(number).encode())
            for _ in range(10):  # turns of the loop: no time passes
                await asyncio.sleep(0)
        shown.end(END)
        await asyncio.wait_for(task, 20.0)
        assert shown.watchers == 0

    asyncio.run(run())


def test_who_reads_gets_each_frame_and_how_it_ended() -> None:
    reader = Reader()
    watched(reader, 100)
    assert reader.got == [*(str(number).encode() for number in range(100)), END]
    assert reader.closed == (1000, "the session has ended")
    assert header(END) == {"ended": "The stream has ended.", "grasp_log": "a1", "arrays": []}


def test_who_reads_nothing_is_sent_no_more_than_a_few_frames_and_is_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watching, "READ_SECONDS", 0.2)
    reader = Reader(reads=False)
    watched(reader, 100)
    assert reader.got == [str(number).encode() for number in range(MOST_ON_THE_WAY)]
    assert reader.closed == (4408, "nothing was read for 0.2 s")


def test_who_says_to_have_read_what_was_not_sent_is_let_go() -> None:
    reader = Reader()
    reader.said.release()
    watched(reader, 100)
    assert reader.closed == (1003, "a word without 8 frames to have read")
    assert len(reader.got) < 100


def test_who_reads_slowly_sees_the_newest_frame_and_not_those_before() -> None:
    async def run() -> None:
        shown = Broadcast()
        for number in range(1000):
            shown.publish(str(number).encode())
        assert await shown.newer(3) == (1000, b"999")

    asyncio.run(run())


def test_whose_key_has_ended_sees_no_more() -> None:
    reader = Reader()
    watched(reader, 10, never)
    assert len(reader.got) < 10
    assert reader.closed is not None
    assert reader.closed[0] == 4401


def test_a_session_that_is_not_there_is_not_watched() -> None:
    async def run() -> Reader:
        reader = Reader()
        await watching.serve(reader, Streams(), "two", "me", always)  # type: ignore[arg-type]
        return reader

    assert asyncio.run(run()).closed == (4404, "no such session, or it has ended")


def test_frames_are_packed_for_who_watches_and_thirty_a_second() -> None:
    shown = Broadcast()
    assert not shown.wants(0.0)
    shown.watchers = 1
    at_thousand = sum(shown.wants(number / 1000.0) for number in range(10_000))
    assert at_thousand == pytest.approx(300, abs=2)
    uneven = [1000.0 + number / 30.0 + 0.008 * (-1) ** number for number in range(300)]
    assert sum(map(shown.wants, uneven)) == 300


def test_those_who_watch_are_counted_for_each_owner(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(broadcasts, "MOST_OF_ONE_OWNER", 1)
    monkeypatch.setattr(broadcasts, "MOST_WATCHERS", 2)
    watchers, shown = Watchers(), Broadcast()
    with watchers.one_more("me", shown), watchers.one_more("you", shown):
        assert shown.watchers == 2
        with pytest.raises(End, match="2 connections watch"), watchers.one_more("her", shown):
            raise AssertionError
    with (
        watchers.one_more("me", shown),
        pytest.raises(End, match="1 connections of this key"),
        watchers.one_more("me", shown),
    ):
        raise AssertionError
    assert shown.watchers == 0
    with watchers.one_more("me", shown):  # there is room again
        assert shown.watchers == 1


@pytest.mark.parametrize("how", ["end", "_forget", "_lose_all"])
def test_whatever_ends_a_session_ends_what_is_shown_of_it(how: str) -> None:
    async def run() -> dict[str, Any]:
        streams = OneSession()
        shown = streams.session.broadcast
        if how == "end":
            streams.call = lambda *_: asyncio.sleep(0)  # type: ignore[method-assign, assignment]
            await streams.end(streams.session, "log")
        elif how == "_forget":
            streams._forget(streams.session)
        else:
            streams._lose_all()
        assert shown.is_over
        assert streams.list_all() == []
        return header((await shown.newer(0))[1])

    told = asyncio.run(run())
    assert told["ended"].endswith(".")
    assert told["grasp_log"] == ("log" if how == "end" else None)
