"""Live streams of somebody who means harm."""

import asyncio
import json
import threading
import time
import tracemalloc
from collections.abc import Awaitable, Callable, Iterator
from contextlib import AbstractContextManager, AsyncExitStack, ExitStack, nullcontext, suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx
import msgspec
import numpy as np
import pytest
from sqlalchemy import event
from starlette.websockets import WebSocketDisconnect
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from db.blobs import BlobStore
from db.database import Database
from db.records import NewModel
from db.repositories import friction_models, jobs, materials
from service.domain.access.principal import Principal
from service.domain.models.model_cache import ModelCache
from service.processes.fair_threads import FairThreads
from service.settings import Settings
from service.stream import connection, detector_session, detectors, errors, sessions
from service.stream.detector_session import PackedFrame
from service.stream.errors import REFUSED, TOO_MANY, UNKNOWN_SESSION, End
from service.stream.messages import MOST_MATERIALS, Open
from service.stream.sessions import Session, Streams
from slipcore.errors import InvalidInput

SIDE = 4
POSITION = np.stack(np.meshgrid(1e-3 * np.arange(SIDE), 1e-3 * np.arange(SIDE), [0.0]), axis=-1).reshape(-1, 3)
MASK = bytes(4)
ZERO = np.zeros((SIDE * SIDE, 3))


class InProcess:
    """The worker's calls, done here."""

    async def call(self, do: Callable[..., Any], *arguments: Any, is_long: bool = False) -> Any:  # noqa: ARG002
        return do(*arguments)

    async def stop(self) -> None:
        return


@pytest.fixture
def make(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Streams]]:
    async def start() -> InProcess:
        return InProcess()

    monkeypatch.setattr(sessions.SideProcess, "start", start)
    yield Streams
    detectors._SESSIONS.clear()


def opening(keep: bool = False) -> Open:
    return Open(POSITION.tobytes(), (SIDE, SIDE), 1e-6, keep=keep)


def run(do: Callable[[], Awaitable[None]]) -> None:
    async def go() -> None:
        await do()

    asyncio.run(go())


def test_a_key_has_a_part_of_the_sessions_only(make: Callable[..., Streams]) -> None:
    async def go() -> None:
        streams = make(per_owner=3)
        results = await asyncio.gather(
            *(streams.open(opening(), "greedy", "10.0.0.9") for _ in range(10)), return_exceptions=True
        )
        refused = [each for each in results if isinstance(each, End)]
        assert len(refused) == 7
        assert {each.code for each in refused} == {TOO_MANY}
        await streams.open(opening(), "another", "10.0.0.9")
        for _ in range(3):
            await streams.open(opening(), None, "10.0.0.8")
        with pytest.raises(End, match="of this address"):
            await streams.open(opening(), None, "10.0.0.8")

    run(go)


def test_no_more_sessions_are_open_than_there_is_room_for(
    make: Callable[..., Streams], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("service.stream.sessions.MOST_SESSIONS", 2)

    async def go() -> None:
        streams = make(per_owner=50)
        for key in ("one", "two"):
            await streams.open(opening(), key, "")
        with pytest.raises(End, match="2 sessions are open") as refused:
            await streams.open(opening(), "three", "")
        assert refused.value.code == TOO_MANY

    run(go)


def test_who_is_refused_holds_no_place(make: Callable[..., Streams]) -> None:
    async def go() -> None:
        streams = make(per_owner=1)
        with pytest.raises(InvalidInput):
            await streams.open(Open(POSITION.tobytes(), (0, 0), 1e-6), "key", "")
        await streams.open(opening(), "key", "")

    run(go)


def test_an_abandoned_session_is_forgotten_though_nobody_opens_another(
    make: Callable[..., Streams], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sessions, "RECONNECT_SECONDS", 0.05)

    async def go() -> None:
        streams = make()
        left, joined = [await streams.open(opening(keep=True), None, "") for _ in range(2)]
        streams.join(joined)
        assert streams.find(left.id, None) is left
        await asyncio.sleep(0.2)
        assert set(detectors._SESSIONS) == {joined.id}  # with all its frames
        with pytest.raises(End) as ended:
            streams.find(left.id, None)
        assert ended.value.code == UNKNOWN_SESSION

    run(go)


def test_sessions_of_one_hold_half_of_the_bytes_that_others_leave(make: Callable[..., Streams]) -> None:
    reserve = detector_session.WINDOW * 3 * POSITION.nbytes
    most = 2 * (2 * reserve + 3 * ZERO.nbytes)

    async def go() -> None:
        streams = make(most_bytes=most)
        first, second = [await streams.open(opening(keep=True), None, "") for _ in range(2)]
        with pytest.raises(InvalidInput, match="STICTION_STREAM_BYTES"):
            await streams.open(opening(), None, "")
        await streams.end(await streams.open(opening(keep=True), "another", ""))
        taken = 0
        with suppress(InvalidInput):
            for number in range(100):
                for session in (first, second):
                    detectors.step(session.id, PackedFrame(number, 0.1 * number, ZERO.tobytes()))
                    taken += 1
        assert taken == 3
        await streams.end(first)
        detectors.step(second.id, PackedFrame(50, 50.0, ZERO.tobytes()))

    run(go)


def test_a_frame_waits_for_two_of_another_however_many_that_sends(
    make: Callable[..., Streams], monkeypatch: pytest.MonkeyPatch
) -> None:
    async def go() -> None:
        streams = make(per_owner=50)
        order: list[str] = []

        async def call(_: object, name: str) -> None:
            order.append(name)
            await asyncio.sleep(0)

        greedy = [await streams.open(opening(), "greedy", "") for _ in range(20)]
        honest = await streams.open(opening(), "honest", "")
        monkeypatch.setattr(streams, "call", call)
        asked = [asyncio.ensure_future(streams.ask(each, detectors.step)) for each in [*greedy, honest]]
        await asyncio.gather(*asked)
        assert order.index(honest.id) <= 2
        assert [*sorted(order)] == sorted(each.id for each in [*greedy, honest])
        monkeypatch.undo()

    run(go)


def test_who_opens_a_session_waits_for_its_turn_as_a_frame_does(make: Callable[..., Streams]) -> None:
    """It may take some ms of the one process that all frames wait for."""

    async def go() -> None:
        streams = make(per_owner=50)
        async with AsyncExitStack() as frames:
            for _ in range(sessions.FRAMES_OF_ONE):
                await frames.enter_async_context(streams._turns.turn("greedy"))
            waiting = asyncio.ensure_future(streams.open(opening(), "greedy", ""))
            honest = await asyncio.wait_for(streams.open(opening(), "honest", ""), 5.0)
            assert set(detectors._SESSIONS) == {honest.id}
        late = await waiting
        assert set(detectors._SESSIONS) == {honest.id, late.id}

    run(go)


@pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
def test_the_materials_of_a_controller_are_read_together_and_beside_the_event_loop(
    make: Callable[..., Streams], database: Database, new_model: NewModel
) -> None:
    names = [f"m{number:02}" for number in range(MOST_MATERIALS)]
    with database.write() as session:
        ids = [materials.create(session, name, "").id for name in names]
        for material_id in ids:
            friction_models.add(
                session, material_id, jobs.add(session, "fit", "ols", material_id=material_id), new_model
            )
        materials.add_alias(session, ids[0], "another name")
    streams, asked, threads = make(), [], set()

    def note(*given: Any) -> None:
        asked.append(given[2])
        threads.add(threading.current_thread())

    event.listen(database.engine, "before_cursor_execute", note)
    counts = []
    for among in (names[1:2], [*names[1:], "another name"]):
        asked.clear()
        control = {"contact_area": 6e-5, "settings": {"least_force": 0.5, "most_force": 20.0}, "materials": among}
        answers = converse(streams, first(control=control), database=database).answers
        assert [answer["type"] for answer in answers] == ["opened"]
        counts.append(len([each for each in asked if each.startswith("SELECT")]))
    assert 0 < counts[0] == counts[1]
    assert threading.current_thread() not in threads
    *_, last = detectors._SESSIONS.values()
    assert last.grip is not None
    assert last.grip._state.recognition is not None
    assert set(last.grip._state.recognition.materials) == set(names)


def test_a_frame_that_comes_faster_than_it_is_looked_at_waits_and_nobody_with_it(
    make: Callable[..., Streams], monkeypatch: pytest.MonkeyPatch
) -> None:
    async def go() -> None:
        streams = make()
        fast, honest = [await streams.open(opening(), owner, "") for owner in ("fast", "honest")]
        asked: list[str] = []

        async def call(_: object, name: str, *_given: object) -> str:
            asked.append(name)
            if name == fast.id and asked.count(name) < 3:
                raise detectors.FitInProgress
            return name

        monkeypatch.setattr(streams, "call", call)
        frame = PackedFrame(0, 0.0, b"")
        found = await asyncio.gather(*(streams.detect(each, frame, False) for each in (fast, honest)))
        assert found == [fast.id, honest.id]
        assert asked == [fast.id, honest.id, fast.id, fast.id]
        monkeypatch.undo()

    run(go)


def test_answers_kept_for_a_return_are_bounded_in_bytes() -> None:
    recent = sessions.RecentAnswers()
    for number in range(300):
        recent.add({"number": number, "slip": list(range(4096))})
    kept = recent.after(-1)
    assert 5 < len(kept) < 50
    assert [each["number"] for each in kept] == list(range(300 - len(kept), 300))
    assert recent.after(298) == [{"number": 299, "slip": list(range(4096))}]


class Socket:
    """A WebSocket whose client says one thing after the other and then goes."""

    def __init__(self, *said: Any) -> None:
        self._said = [{"type": "websocket.receive", "text": each} for each in said]
        self.answers: list[dict[str, Any]] = []
        self.closed: tuple[int, str] | None = None

    async def receive(self) -> dict[str, Any]:
        await asyncio.sleep(0.02)
        return self._said.pop(0) if self._said else {"type": "websocket.disconnect"}

    async def send_text(self, text: str) -> None:
        self.answers.append(msgspec.json.decode(text))

    async def close(self, code: int, reason: str) -> None:
        self.closed = code, reason


NO_DATABASE = SimpleNamespace(read=lambda: nullcontext())
"""Nothing is looked up without a key and a material."""


def converse(streams: Streams, *said: Any, raw: bool = False, database: Any = NO_DATABASE) -> Socket:
    parts = {"database": database, "models": ModelCache(), "settings": Settings(), "threads": FairThreads()}
    context: Any = SimpleNamespace(streams=streams, **parts)
    socket: Any = Socket(*(said if raw else (json.dumps(each) for each in said)))

    async def go() -> None:
        with suppress(WebSocketDisconnect):
            await connection.serve(socket, context, context.streams, Principal(), lambda log: {"id": log.id})

    asyncio.run(go())
    return socket  # type: ignore[no-any-return]


def first(**changes: Any) -> dict[str, Any]:
    return {"type": "open", "position": POSITION.tolist(), "grid": [SIDE, SIDE], "element_area": 1e-6} | changes


def frame(**changes: Any) -> dict[str, Any]:
    return {"type": "frame", "number": 0, "time": 0.0, "displacement": ZERO.tolist()} | changes


def nested(depth: int) -> list[Any]:
    return [nested(depth - 1)] if depth else [1.0]


@pytest.mark.parametrize(
    "position",
    [nested(400), [10**400] * 48, [False, *POSITION.ravel().tolist()[1:]], ["1"] * 48, [None] * 48, [{}] * 48],
    ids=["nested", "large", "truth value", "text", "null", "object"],
)
def test_an_opening_without_numbers_is_refused_by_name(make: Callable[..., Streams], position: Any) -> None:
    closed = converse(make(), first(position=position)).closed
    assert closed is not None
    assert closed[0] == REFUSED
    assert closed[1].startswith("position is ")


@pytest.mark.parametrize(
    "message",
    [
        json.dumps(frame(time=0)).replace('"time": 0', '"time": true'),
        json.dumps(frame(gripper_force=True)),
        json.dumps(frame(number=True)),
        json.dumps(frame(number=2**80)),
        json.dumps(frame()).replace('"time": 0.0', '"time": 1' + "0" * 400),
        '{"type": "frame", "displacement": ' + "[" * 900 + "]" * 900 + ', "number": "x"}',
        "[" * 100_000,
        '{"type": "open"}',
        '{"type": "finish", "store": true, "st\\u006fre": false}',
    ],
    ids=[
        *("time", "force", "number", "number 2^80", "time 10^400"),
        *("900 deep and wrong", "100,000 deep", "no field", "twice"),
    ],
)
def test_a_message_that_is_none_has_its_documented_code(make: Callable[..., Streams], message: str) -> None:
    closed = converse(make(), json.dumps(first()), message, raw=True).closed
    assert closed is not None
    assert closed[0] == errors.NOT_UNDERSTOOD


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        ({"displacement": nested(400)}, "displacement"),
        ({"displacement": [10**400] * 48}, "displacement"),
        ({"displacement": [False] * 48}, "displacement"),
        ({"displacement": [0.0] * 24}, "displacement"),  # the bytes of as many numbers of single precision
        ({"force": [[1.0], ["2"]]}, "force"),
        ({"object_pose": [0, 0, False]}, "object_pose"),
        ({"number": -1}, "number"),
        ({"number": -(2**53)}, "number"),
        ({"time": 1e308}, "time"),
        ({"time": -1e308}, "time"),
        ({"time": 1e13}, "time"),
        ({"displacement": [1e308] * 48}, "displacement"),
        ({"force": [-1e308] * 48}, "force"),
        ({"object_pose": [1e308, 0.0, 0.0]}, "object_pose x, y"),
        ({"command": 1e308}, "command"),
        ({"gripper_force": 1e308}, "gripper_force"),
        ({"gripper_force": -1.0}, "gripper_force"),
        ({"gripper_force_deviation": 1.0}, "gripper_force_deviation"),
    ],
    ids=["nested", "large", "truths", "half", "text", "truth", "-1", "-2^53", *["huge"] * 8, "pulls", "alone"],
)
def test_a_wrong_frame_is_answered_by_name_and_the_next_is_taken(
    make: Callable[..., Streams], wrong: dict[str, Any], name: str
) -> None:
    number = wrong.get("number", 0)
    opened, error, state = converse(make(), first(), frame(**wrong), frame(number=1, time=1.0)).answers
    assert (opened["type"], error["type"], state["type"]) == ("opened", "error", "state")
    assert (error["number"], error["name"], state["number"]) == (number, name, 1)


@pytest.mark.parametrize(
    ("name", "value"),
    [("pressure_square", 1e-300), ("pressure_square", 1e300), ("torque_arm", 5e-324), ("contact_area", 1e-300)],
)
def test_a_controllers_contact_that_cannot_be_is_refused_by_name(
    make: Callable[..., Streams], name: str, value: float
) -> None:
    control = {"contact_area": 6e-5, "settings": {"least_force": 0.5, "most_force": 20.0}, name: value}
    closed = converse(make(), first(control=control)).closed
    assert closed is not None
    assert closed[0] == REFUSED
    assert name.removeprefix("contact_") in closed[1]


@pytest.mark.parametrize(
    "wrong",
    [{"time": 1e308}, {"time": 2e9}, {"displacement": [0.05] * 48}],
    ids=["never", "in sixty years", "beyond the sensor"],
)
def test_a_frame_that_no_log_could_have_does_not_spoil_the_recording(
    make: Callable[..., Streams], tmp_path: Path, wrong: dict[str, Any]
) -> None:
    """A time far ahead would have every later frame refused, and the log at its end with it."""
    streams = make()

    async def go() -> None:
        session = await streams.open(opening(keep=True), "key", "10.0.0.9")
        packed = [PackedFrame(number, 0.1 * number, [0.0] * 48) for number in range(4)]
        packed[2] = PackedFrame(2, **({"time": 0.2, "displacement": [0.0] * 48} | wrong))
        for each in packed:
            with pytest.raises(InvalidInput) if each.number == 2 else nullcontext():
                detectors.step(session.id, each)
        assert detectors.write(session.id, tmp_path / "log", "finger").frames == 3

    run(go)


def test_messages_wait_as_they_were_sent_and_not_as_lists() -> None:
    """8 frames of 1 MB of empty lists would take 400 MiB, which no bound counts."""
    content = msgspec.msgpack.encode({"type": "frame", "number": 0, "time": 0.0, "displacement": [[]] * 1_000_000})
    ended = asyncio.Event()

    class Socket:
        left = connection.MOST_WAITING_IN

        async def receive(self) -> dict[str, Any]:
            if not self.left:
                ended.set()
                await asyncio.Event().wait()
            self.left -= 1
            return {"type": "websocket.receive", "bytes": bytes(content)}

    async def fill() -> int:
        given: Any = (Socket(), SimpleNamespace(), None, None, None)
        reading = asyncio.create_task(connection._Connection(*given)._read())
        await ended.wait()
        held = tracemalloc.get_traced_memory()[0]
        reading.cancel()
        return held

    tracemalloc.start()
    try:
        assert asyncio.run(fill()) < 2 * connection.MOST_WAITING_IN * len(content)
    finally:
        tracemalloc.stop()


def test_a_stream_that_is_refused_is_no_error_of_the_service(
    client: httpx.Client, caplog: pytest.LogCaptureFixture
) -> None:
    offer = {"connection": "Upgrade", "upgrade": "websocket", "sec-websocket-version": "13"}
    headers = {**offer, "sec-websocket-key": "dGhlIHNhbXBsZSBub25jZQ==", "authorization": "Bearer unknown"}
    answer = client.get("/v1/stream", headers=headers)
    assert (answer.status_code, answer.headers["content-type"]) == (401, "application/problem+json")
    client.get("/healthz").raise_for_status()  # by then all is logged
    assert [record.getMessage() for record in caplog.records if record.levelname == "ERROR"] == []


def faults_in(caplog: pytest.LogCaptureFixture) -> list[str]:
    """What the log has a traceback of."""
    return [record.getMessage() for record in caplog.records if record.exc_info is not None]


def connected(client: httpx.Client) -> Any:
    return connect(str(client.base_url.copy_with(scheme="ws", path="/v1/stream")), open_timeout=10.0)


@pytest.mark.parametrize(
    "pieces", [(b"\x81\x82" + MASK + b"\xff\xfe",), (b"\x01\x81" + MASK + b"\xc3", b"\x80\x80" + MASK)]
)
def test_text_that_is_none_ends_its_connection_and_is_no_error_of_the_service(
    client: httpx.Client, caplog: pytest.LogCaptureFixture, pieces: tuple[bytes, ...]
) -> None:
    with connected(client) as stream:
        for piece in pieces:
            stream.socket.sendall(piece)
        with pytest.raises(ConnectionClosed):
            stream.recv(timeout=10.0)
    assert (stream.close_code, stream.close_reason) == (1007, "text that is no UTF-8")
    client.get("/healthz").raise_for_status()
    assert faults_in(caplog) == []


def test_characters_may_be_in_two_pieces(client: httpx.Client) -> None:
    """A frame is text only with those that it goes on in."""
    with connected(client) as stream:
        for piece in (b"\x01\x81" + MASK + b"\xc3", b"\x80\x81" + MASK + b"\xa4"):
            stream.socket.sendall(piece)
        with pytest.raises(ConnectionClosed):
            stream.recv(timeout=10.0)
    assert stream.close_code == errors.NOT_UNDERSTOOD


def test_streams_that_the_server_s_end_cuts_off_are_no_error_of_it(
    serving: Callable[[Settings], AbstractContextManager[httpx.Client]],
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """One whose detector has not started by then."""
    begun = threading.Event()

    async def never(*_: Any) -> None:
        begun.set()
        await asyncio.Event().wait()

    monkeypatch.setattr(Streams, "open", never)
    with ExitStack() as running:
        client = running.enter_context(serving(Settings(data_folder=tmp_path, workers=0, shutdown_seconds=0.0)))
        with connected(client) as stream:
            stream.send(json.dumps({"type": "open", "position": [0.0] * 3, "grid": [1, 1], "element_area": 1e-6}))
            assert begun.wait(10.0)
            running.close()
            with pytest.raises(ConnectionClosed):
                stream.recv(timeout=10.0)
    assert faults_in(caplog) == []


def test_who_goes_while_its_frames_are_detected_has_no_more_of_them_with_the_process_for_it() -> None:
    """What it has sent is done all the same, and others would wait for all of that."""
    nap, times = 0.2, 12

    async def go() -> None:
        streams = Streams()
        await streams.call(abs, 0)
        greedy, honest = (
            Session(naps, opening(), None, owner)  # type: ignore[arg-type]
            for naps, owner in ((nap, "greedy"), (0.0, "honest"))
        )
        gone = []
        for _ in range(times):
            gone.append(asyncio.ensure_future(streams.ask(greedy, time.sleep)))
            await asyncio.sleep(0.004)
            gone[-1].cancel()
        begun = time.monotonic()
        await streams.ask(honest, time.sleep)
        waited = time.monotonic() - begun
        await asyncio.wait(gone)
        await streams.stop()
        assert all(each.cancelled() for each in gone)
        assert waited < 0.5 * times * nap

    run(go)


def test_a_log_whose_client_goes_while_it_is_written_leaves_no_file(tmp_path: Path) -> None:
    """The detectors' process would make the file once more that was removed under it."""
    blobs, streams = BlobStore(tmp_path), Streams()
    spool, finish = tmp_path / "spool", {"type": "finish", "store": True}
    said = first(keep=True), frame(), frame(number=1, time=1.0), finish
    parts = {"database": NO_DATABASE, "models": ModelCache(), "settings": Settings(), "threads": FairThreads()}
    context: Any = SimpleNamespace(streams=streams, blobs=blobs, **parts)

    async def go() -> None:
        socket: Any = Socket(*map(json.dumps, said))
        streams.leave(await streams.open(opening(), "owner", ""))  # so that the next does not wait for kernels
        busy = asyncio.ensure_future(streams.call(time.sleep, 0.5, is_long=True))
        with suppress(WebSocketDisconnect):
            await connection.serve(socket, context, streams, Principal(), lambda *_: {})
        assert [answer["type"] for answer in socket.answers] == ["opened", "state", "state"]
        assert busy.done()
        await streams.stop()
        assert list(spool.iterdir()) == []

    run(go)


def test_who_goes_at_once_leaves_the_process_that_begins_to_the_next(monkeypatch: pytest.MonkeyPatch) -> None:
    begun = []

    async def start() -> InProcess:
        begun.append(1)
        await asyncio.sleep(0.05)
        return InProcess()

    monkeypatch.setattr(sessions.SideProcess, "start", start)

    async def go() -> None:
        streams = Streams()
        for _ in range(3):
            gone = asyncio.ensure_future(streams.call(abs, 0))
            await asyncio.sleep(0.01)
            gone.cancel()
        assert await streams.call(abs, -1) == 1
        assert len(begun) == 1

    run(go)
