"""Sessions of the live stream: how many there may be, whose they are, and for how long they wait."""

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

import numpy as np
import pytest

from service.processes.side_process import ProcessEnded
from service.stream import detectors, sessions
from service.stream.errors import DETECTOR_LOST, IN_USE, NOT_READY, TOO_MANY, UNKNOWN_SESSION, End
from service.stream.messages import Open
from service.stream.sessions import RecentAnswers, Session, Streams
from tests.sleeping import replace_sleep


class Here(Streams):
    """Whose detectors are asked here: what was asked is kept, and answered by ``answer``."""

    def __init__(self, per_owner: int = 50, answer: Callable[..., Any] = lambda *_: None) -> None:
        super().__init__(per_owner)
        self.asked: list[tuple[Any, ...]] = []
        self.answer = answer

    async def call(self, do: Callable[..., Any], *arguments: Any, is_long: bool = False) -> Any:
        if is_long:
            return await self.compile(do, *arguments)
        self.asked.append((do, *arguments))
        return self.answer(do, *arguments)

    async def compile(self, do: Callable[..., Any], *methods: str) -> None:
        """At once, as of kernels that are kept."""
        assert (do, methods) == (detectors.prepare, ("filter", "coarse"))

    async def begin(self, key_id: str | None = "key", address: str = "10.0.0.9") -> Session:
        opening: Any = Open(position=np.zeros((1, 2, 3)).tobytes(), grid=(1, 2), element_area=1e-6)
        return await self.open(opening, key_id, address)


@pytest.fixture(autouse=True)
def plain_positions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sessions, "packed", lambda _, content: content)


def run(steps: Coroutine[Any, Any, None]) -> None:
    asyncio.run(asyncio.wait_for(steps, 30.0))


def test_an_owner_has_as_many_sessions_as_may_be_and_others_have_theirs() -> None:
    async def steps() -> None:
        streams = Here(per_owner=2)
        for _ in range(2):
            await streams.begin("a")
        with pytest.raises(End, match="2 sessions of this key, or of this address without one, are open") as ended:
            await streams.begin("a")
        assert ended.value.code == TOO_MANY
        await streams.begin("b")
        for address in ("1.1.1.1", "1.1.1.1", "2.2.2.2"):
            await streams.begin(None, address)
        with pytest.raises(End):
            await streams.begin(None, "1.1.1.1")
        assert [each.owner for each in streams.list_all()] == [
            "address 2.2.2.2", *["address 1.1.1.1"] * 2, "b", "a", "a"
        ]  # fmt: skip

    run(steps())


def test_a_server_has_as_many_sessions_as_may_be(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sessions, "MOST_SESSIONS", 2)

    async def steps() -> None:
        streams = Here()
        kept = [await streams.begin(key) for key in "ab"]
        with pytest.raises(End, match="2 sessions are open"):
            await streams.begin("c")
        await streams.end(kept[0])
        await streams.begin("c")

    run(steps())


def test_a_sensor_that_cannot_be_leaves_no_session() -> None:
    def refuse(*_: object) -> None:
        raise ValueError("no sensor")

    async def steps() -> None:
        streams = Here(answer=refuse)
        with pytest.raises(ValueError, match="no sensor"):
            await streams.begin()
        assert streams.list_all() == []

    run(steps())


def test_who_opens_while_the_detector_is_compiled_is_told_so_and_can_open_once_it_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(sessions, "PREPARE_SECONDS", 0.01)

    class Compiling(Here):
        compiled, begun = asyncio.Event(), 0

        async def compile(self, *_: object) -> None:
            self.begun += 1
            await self.compiled.wait()

    async def steps() -> None:
        streams = Compiling()
        for _ in range(2):
            with pytest.raises(End, match=r"the detector is being compiled, .*; open again in 30 s") as ended:
                await streams.begin()
            assert (ended.value.code, streams.list_all()) == (NOT_READY, [])
            assert len(ended.value.reason.encode()) <= 120, "a close frame holds no more"
        assert [do for do, *_ in streams.asked if do is not detectors.drop] == []
        streams.compiled.set()
        session = await streams.begin()
        assert streams.list_all() == [session]
        assert streams.begun == 1
        await streams.stop()

    run(steps())


def test_a_detector_that_could_not_be_prepared_is_prepared_anew() -> None:
    class Failing(Here):
        failed = 0

        async def compile(self, *_: object) -> None:
            self.failed += 1
            if self.failed == 1:
                raise End(DETECTOR_LOST, "the detector's process ended")

    async def steps() -> None:
        streams = Failing()
        with pytest.raises(End, match="process ended"):
            await streams.begin()
        assert streams.list_all() == []
        assert await streams.begin() in streams.list_all()

    run(steps())


def test_a_session_is_gone_on_with_by_its_own_key() -> None:
    async def steps() -> None:
        streams = Here()
        session = await streams.begin("a")
        assert await streams.take_over(session.id, "a") is session
        for name, key in ((session.id, "b"), (session.id, None), ("none", "a")):
            streams.join(session)
            with pytest.raises(End, match="no such session, or it waited too long") as ended:
                await streams.take_over(name, key)
            assert ended.value.code == UNKNOWN_SESSION
            assert not session.wanted.is_set()
            streams.leave(session)
        assert streams.get(session.id) is session

    run(steps())


def test_a_session_is_let_go_by_one_connection_for_another(monkeypatch: pytest.MonkeyPatch) -> None:
    """For a client whose network changed the first is dead long before its end is noticed."""
    monkeypatch.setattr(sessions, "TAKE_OVER_SECONDS", 0.05)

    async def steps() -> None:
        streams = Here()
        session = await streams.begin("a")
        streams.join(session)
        with pytest.raises(End, match="the session has a connection already") as ended:  # which does not let go
            await streams.take_over(session.id, "a")
        assert ended.value.code == IN_USE

        async def let_go() -> None:
            await session.wanted.wait()
            streams.leave(session)

        _, *taken = await asyncio.gather(let_go(), streams.take_over(session.id, "a"))
        assert taken == [session]
        streams.join(session)
        assert (session.connected, session.wanted.is_set(), session.free.is_set()) == (True, False, False)

        async def end() -> None:
            await session.wanted.wait()
            await streams.end(session)
            streams.leave(session)

        ending = asyncio.create_task(end())
        with pytest.raises(End, match="no such session"):  # it has ended meanwhile
            await streams.take_over(session.id, "a")
        await ending

    run(steps())


def test_a_session_that_nobody_goes_on_with_is_forgotten_after_a_while(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sessions, "RECONNECT_SECONDS", 0.05)

    async def steps() -> None:
        streams = Here()
        kept, left = await streams.begin(), await streams.begin()
        streams.join(kept)
        await asyncio.sleep(0.2)
        assert streams.list_all() == [kept]
        assert left.broadcast.is_over
        assert not kept.broadcast.is_over
        streams.leave(kept)
        streams.join(kept)
        await asyncio.sleep(0.2)
        assert streams.list_all() == [kept]
        await streams.end(kept)
        streams.leave(kept)
        assert kept.expiry is None or kept.expiry.cancelled()

    run(steps())


def test_a_session_is_ended_once_and_its_detector_dropped() -> None:
    async def steps() -> None:
        streams = Here()
        session = await streams.begin()
        for _ in range(2):
            await streams.end(session, "log")
        assert [do for do, *_ in streams.asked] == [detectors.open_session, detectors.drop]
        assert streams.asked[1] == (detectors.drop, session.id)

    run(steps())


def test_a_frame_that_came_too_fast_is_tried_again_after_longer_and_longer(monkeypatch: pytest.MonkeyPatch) -> None:
    tries, pauses = iter([detectors.FitInProgress()] * 7), list[float]()

    def step(do: Any, *_: object) -> tuple[dict[str, Any], None]:
        if do is detectors.step and (busy := next(tries, None)) is not None:
            raise busy
        return {"number": 1}, None

    async def sleep(seconds: float) -> None:
        pauses.append(seconds)

    async def steps() -> None:
        streams = Here(answer=step)
        session = await streams.begin()
        replace_sleep(monkeypatch, sleep)
        frame: Any = None
        assert await streams.detect(session, frame, False) == ({"number": 1}, None)

    run(steps())
    assert pauses == pytest.approx([0.005, 0.01, 0.02, 0.04, 0.08, 0.1, 0.1])


class Process:
    """A side process that ends, or that lacks what is asked of it."""

    def __init__(self, error: Exception) -> None:
        self.error = error

    async def call(self, *_: object, **_options: bool) -> None:
        raise self.error


@pytest.mark.parametrize(("error", "left"), [(ProcessEnded(), 0), (KeyError("x"), 1)])
def test_a_process_that_ends_takes_all_sessions_with_it(error: Exception, left: int) -> None:
    async def steps() -> None:
        streams = Streams()
        process: Any = Process(error)
        streams._process = process
        session = Session("one", None, "a", "a")  # type: ignore[arg-type]
        streams._sessions["one"] = session
        with pytest.raises(End, match="the detector's process ended; open a new session") as ended:
            await streams.call(len)
        assert ended.value.code == DETECTOR_LOST
        assert len(streams.list_all()) == left
        assert session.broadcast.is_over is (left == 0)
        assert (streams._process is None) is (left == 0)

    run(steps())


def test_answers_are_kept_for_who_comes_back(monkeypatch: pytest.MonkeyPatch) -> None:
    recent = RecentAnswers()
    for number in range(300):
        recent.add({"number": number})
    assert [each["number"] for each in recent.after(-1)] == list(range(44, 300))
    assert [each["number"] for each in recent.after(297)] == [298, 299]
    assert recent.after(299) == []
    monkeypatch.setattr(sessions, "ANSWER_BYTES_KEPT", 100)
    for number in range(300, 303):
        recent.add({"number": number, "long": "x" * 30})
    assert [each["number"] for each in recent.after(-1)] == [301, 302]
    recent.add({"number": 303, "long": "x" * 200})
    assert recent.after(-1) == []
    recent.add({"number": 304})
    assert [each["number"] for each in recent.after(-1)] == [304]
