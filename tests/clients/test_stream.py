"""What a live stream does where its connection breaks, without a network: what is answered stands beforehand."""

import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, ConnectionClosedError
from websockets.frames import Close

from stiction_client import AnswerTimedOut, ConnectionFailed, InvalidArgument, StreamEnded, UnexpectedAnswer, stream
from stiction_client.stream import SlipStream

OPENED = {"type": "opened", "session": "s"}
BROKEN = ConnectionClosedError(None, None)
IN_USE = ConnectionClosedError(Close(4409, "the session has a connection already"), None)
Answers = list[dict[str, Any] | Exception]


class Connection:
    """Gives the answers that it was made with, and notes what it was sent."""

    def __init__(self, answers: Answers) -> None:
        self._answers, self.sent, self.is_open = iter(answers), list[dict[str, Any]](), True

    def send(self, content: bytes) -> None:
        self.sent.append(msgspec.msgpack.decode(content))

    def recv(self, timeout: float, *, decode: bool) -> bytes:
        assert (timeout, decode) == (stream.ANSWER_TIMEOUT, False)
        answer = next(self._answers)
        if isinstance(answer, Exception):
            raise answer
        return answer if isinstance(answer, bytes) else msgspec.msgpack.encode(answer)


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[SlipStream, list[Connection]]]:
    """A stream whose connections, one after the other, give these answers."""

    def open_stream(*answers: Answers) -> tuple[SlipStream, list[Connection]]:
        made: list[Connection] = []

        @contextmanager
        def connect(url: str, **_: Any) -> Iterator[Connection]:
            assert url == "ws://service/v1/stream"
            given = answers[len(made)]
            made.append(Connection(given if IN_USE in given else [OPENED, *given]))
            yield made[-1]
            made[-1].is_open = False

        monkeypatch.setattr(stream, "connect", connect)
        return SlipStream("http://service/", np.zeros((2, 2, 3)), 1e-6), made

    return open_stream


def send(live: SlipStream, count: int) -> None:
    for k in range(count):
        live.send(0.1 * k, np.full((2, 2, 3), k))


def state(number: int) -> dict[str, Any]:
    return {"type": "state", "number": number}


def test_an_answer_that_was_lost_comes_on_the_next_connection(opened: Any) -> None:
    """Which is told the last one that came, and all frames since."""
    live, made = opened([state(0), BROKEN], [state(1), state(2)])
    send(live, 3)
    assert [answer["number"] for answer in live.answers()] == [0, 1, 2]
    first, second = made
    assert [message.get("number") for message in first.sent] == [None, 0, 1, 2]
    assert second.sent[0] == {"type": "resume", "session": "s", "last": 0}
    assert second.sent[1:] == first.sent[2:]
    assert (first.is_open, second.is_open) == (False, True)


@pytest.mark.parametrize("times", [1, 3, 4])
def test_a_session_whose_old_connection_is_still_there_is_waited_for(
    opened: Any, monkeypatch: pytest.MonkeyPatch, times: int
) -> None:
    """A service notices the end of one later than its client: a robot's loop ended by that."""
    slept: list[float] = []
    monkeypatch.setattr(stream, "time", SimpleNamespace(sleep=slept.append))
    live, made = opened([BROKEN], *[[IN_USE] for _ in range(times)], [state(0)])
    send(live, 1)
    with nullcontext() if times < 4 else pytest.raises(ConnectionFailed, match="has a connection already"):
        assert live.receive() == state(0)
    assert slept == list(stream.IN_USE_PAUSES[:times])
    assert [each.is_open for each in made] == [False] * min(times + 1, 4) + [True]


def test_a_connection_that_breaks_again_at_once_is_told(opened: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """As the library's own error, while frames were sent again."""
    live, made = opened([BROKEN], [])
    send(live, 2)

    def broken(_: Connection, content: bytes) -> None:
        if msgspec.msgpack.decode(content)["type"] == "frame":
            raise BROKEN

    monkeypatch.setattr(Connection, "send", broken)
    with pytest.raises(ConnectionFailed):
        live.receive()
    assert len(made) == 2


def test_the_detector_is_left_to_the_service_which_says_it(opened: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the first frame's answer at the latest; a service of before says none."""
    live, made = opened([state(0), state(1) | {"detector": "coarse"}, BROKEN], [state(2)])
    assert "detector" not in made[0].sent[0]
    send(live, 3)
    found = [live.detector]
    for _ in range(3):
        live.receive()
        found.append(live.detector)
    assert found == [None, None, "coarse", "coarse"]
    monkeypatch.setattr(stream, "connect", lambda *_, **__: nullcontext(made[1]))
    made[1]._answers = iter([OPENED | {"detector": "filter"}])
    named = SlipStream("http://service/", np.zeros((2, 2, 3)), 1e-6, detector="filter")
    assert (named.detector, made[1].sent[-1]["detector"]) == ("filter", "filter")


def test_what_becomes_of_a_log_is_told_although_the_connection_broke(opened: Any) -> None:
    stored = {"type": "finished", "grasp_log": {"id": "7"}}
    live, made = opened([state(0), BROKEN], [stored])
    send(live, 1)
    assert live.finish(store=True) == {"id": "7"}
    assert [message["type"] for message in made[1].sent] == ["resume", "finish"]
    assert not made[1].is_open


@pytest.mark.parametrize("code", stream.RESUMABLE)
def test_a_server_that_stops_or_cannot_store_is_asked_once_more(opened: Any, code: int) -> None:
    ended = ConnectionClosedError(Close(code, "later"), None)
    live, made = opened([ended], [ended])
    send(live, 1)
    with pytest.raises(ConnectionFailed, match=rf"the service ended the stream: later \({code}\)"):
        live.receive()
    assert len(made) == 2


def test_what_a_service_refuses_is_told_with_its_reason_and_not_asked_again(opened: Any) -> None:
    refused: ConnectionClosed = ConnectionClosedError(Close(4401, "the key has ended"), None)
    live, made = opened([refused])
    send(live, 1)
    with pytest.raises(StreamEnded, match=r"the key has ended \(4401\)") as ended:
        live.receive()
    assert isinstance(ended.value, ConnectionFailed)
    assert (ended.value.code, ended.value.reason, len(made)) == (4401, "the key has ended", 1)
    assert str(pickle.loads(pickle.dumps(ended.value))) == str(ended.value)


def test_an_answer_that_is_late_may_be_waited_for_again(opened: Any) -> None:
    live, made = opened([TimeoutError(), state(0)])
    send(live, 1)
    with pytest.raises(AnswerTimedOut, match="no answer within 30 s; the session goes on"):
        live.receive()
    assert (live.receive()["number"], len(made)) == (0, 1)


OTHERS = [b"\xc1", b"text", b"\x91" * 5000, [1, 2], 5, None, {}, {"type": "state"}]
"""Messages that are none of a service's."""


@pytest.mark.parametrize("answer", [*OTHERS, *({"number": each} for each in ("0", 0.0, -1, 2, 10**9))])
def test_an_answer_to_no_frame_that_waits_is_told(opened: Any, answer: Any) -> None:
    """Its number had been believed, and the frames before it forgotten."""
    live, _ = opened([{"number": 0}, answer, {"number": 1}])
    send(live, 2)
    live.receive()
    with pytest.raises(UnexpectedAnswer, match="ws://service/v1/stream answered"):
        live.receive()
    assert live.receive() == {"number": 1}


@pytest.mark.parametrize("command", [{"normal_force": each} for each in (float("nan"), -1.0, "1", True)] + [{}, 5])
def test_a_command_that_is_no_force_is_told(opened: Any, command: Any) -> None:
    live, _ = opened([{"number": 0, "command": command}, {"number": 0, "command": {"normal_force": 2.0}}])
    send(live, 1)
    with pytest.raises(UnexpectedAnswer):
        live.receive()
    assert live.receive()["command"] == {"normal_force": 2.0}


@pytest.mark.parametrize("answer", [*OTHERS, {"type": "finished"}, {"grasp_log": None}])
def test_an_end_that_is_none_is_told(opened: Any, answer: Any) -> None:
    live, _ = opened([answer])
    with pytest.raises(UnexpectedAnswer):
        live.finish()


@pytest.mark.parametrize("answer", [*OTHERS, {"type": "opened"}, {"type": "opened", "session": 5}])
def test_a_service_of_another_kind_is_told(monkeypatch: pytest.MonkeyPatch, answer: Any) -> None:
    made = Connection([answer])
    monkeypatch.setattr(stream, "connect", lambda *_, **__: nullcontext(made))
    with pytest.raises(UnexpectedAnswer):
        SlipStream("http://service/", np.zeros((2, 2, 3)), 1e-6)


@pytest.mark.parametrize("url", ["localhost:8000", "htp://x", "http://", "http://x:99999"])
def test_an_address_of_no_service_is_refused_by_name(url: str) -> None:
    """The errors of the library had come through."""
    with pytest.raises(InvalidArgument, match=r"^address is "):
        SlipStream(url, np.zeros((2, 2, 3)), 1e-6)


@pytest.mark.parametrize(
    ("frame", "told"),
    [
        ({"time": None}, "time is None; allowed: a number"),
        ({"time": True}, "time is True; allowed: a number"),
        ({"command": "x"}, "command is 'x'; allowed: a number"),
        ({"displacement": None}, "displacement is None; allowed: an array of numbers"),
        ({"displacement": 0.0}, "displacement is 0.0; allowed: an array of numbers"),
        ({"force": "x"}, "force is 'x'; allowed: an array of numbers"),
        ({"normal": [[0.0], [0.0, 1.0]]}, r"normal is \[\[0.0\], \[0.0, 1.0\]\]; allowed: one number, or an array"),
        ({"object_pose": [True, False, True]}, r"object_pose is \[True, False, True\]; allowed: an array of numbers"),
    ],
)
def test_what_is_no_frame_is_named_and_the_stream_goes_on(opened: Any, frame: dict[str, Any], told: str) -> None:
    """Sent, it would end the session of an object that is held."""
    live, (connection,) = opened([state(0)])
    with pytest.raises(InvalidArgument, match=f"^{told}"):
        live.send(**({"time": 0.0, "displacement": np.zeros((2, 2, 3))} | frame))
    send(live, 1)
    assert [answer["number"] for answer in live.answers()] == [0]
    assert [message["type"] for message in connection.sent] == ["open", "frame"]


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"position": "x"}, "position is 'x'; allowed: an array of numbers"),
        ({"control": {"least_force": 1.0}}, r"control is \{.*; allowed: an object of ControlSettings"),
        ({"materials": "paper"}, "materials is 'paper'; allowed: a list of names"),
        ({"key": "é"}, "key is one with other characters"),
    ],
)
def test_what_opens_no_stream_is_named_before_anything_is_sent(wrong: dict[str, Any], told: str) -> None:
    with pytest.raises(InvalidArgument, match=f"^{told}"):
        SlipStream(**({"url": "http://service", "position": np.zeros((2, 2, 3)), "element_area": 1e-6} | wrong))


def test_address_and_key_are_those_of_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[str, Any]] = []

    @contextmanager
    def connect(url: str, **options: Any) -> Iterator[Connection]:
        asked.append((url, options["additional_headers"]))
        yield Connection([OPENED])

    monkeypatch.setattr(stream, "connect", connect)
    monkeypatch.setenv("STICTION_URL", "https://elsewhere")
    monkeypatch.setenv("STICTION_KEY", "secret")
    SlipStream(None, np.zeros((2, 2, 3)), 1e-6)
    SlipStream("http://service", np.zeros((2, 2, 3)), 1e-6, key="")
    assert asked == [("wss://elsewhere/v1/stream", {"Authorization": "Bearer secret"}), ("ws://service/v1/stream", {})]
