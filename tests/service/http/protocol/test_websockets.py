"""What the server's WebSocket connections add, without a network: frames go in, and what is said is seen."""

import asyncio
from collections.abc import Awaitable, Callable
from types import SimpleNamespace
from typing import Any

import pytest
import uvicorn
from uvicorn.protocols.utils import ClientDisconnected

from service.http.protocol.websockets import MOST_FRAGMENTS, MOST_UNSENT_BYTES, PARSED_BYTES, WebSocketConnection

HANDSHAKE = (
    b"GET /live HTTP/1.1\r\nHost: a\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
    b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
)
TEXT, BYTES, CLOSE, PING, PONG = 0x81, 0x82, 0x88, 0x89, 0x8A
TEXT_BEGINS, CONTINUES, LAST = 0x01, 0x00, 0x80

Receive = Callable[[], Awaitable[Any]]
Send = Callable[[Any], Awaitable[None]]
App = Callable[[Any, Receive, Send], Awaitable[None]]


def frame(opcode: int, content: bytes = b"") -> bytes:
    """As a client sends it, masked by zeros."""
    return bytes([opcode, 0x80 | len(content)]) + bytes(4) + content


class Wire(SimpleNamespace):
    """A transport that keeps what is written, and says that so many bytes are not read yet."""

    def __init__(self, unsent: int) -> None:
        super().__init__(written=[], closed=False, aborted=False, paused=0, unsent=unsent)

    def get_extra_info(self, name: str) -> Any:
        return {"peername": ("10.0.0.9", 4000), "sockname": ("10.0.0.1", 80)}.get(name)

    def write(self, data: bytes) -> None:
        self.written.append(bytes(data))

    def close(self) -> None:
        self.closed = True

    def abort(self) -> None:
        self.aborted = self.closed = True

    def is_closing(self) -> bool:
        return bool(self.closed)

    def get_write_buffer_size(self) -> int:
        return int(self.unsent)

    def pause_reading(self) -> None:
        self.paused += 1

    def resume_reading(self) -> None:
        pass


async def rounds(count: int = 30) -> None:
    for _ in range(count):
        await asyncio.sleep(0)


def spoken(app: App, *pieces: bytes, unsent: int = 0) -> Wire:
    """What is written to a client that sends these pieces after its handshake, each as the last was dealt with."""

    async def run() -> Wire:
        config = uvicorn.Config(app, lifespan="off", log_level="critical", ws_ping_interval=None)
        config.load()
        wire = Wire(unsent)
        connection = WebSocketConnection(config, uvicorn.server.ServerState(), {})
        connection.connection_made(wire)  # type: ignore[arg-type]
        connection.data_received(HANDSHAKE)
        await rounds()
        for piece in pieces:
            connection.data_received(piece)
            await rounds()
        connection.connection_lost(None)
        await rounds()
        return wire

    return asyncio.run(run())


def listener(heard: list[Any]) -> App:
    async def listen(_scope: Any, receive: Receive, send: Send) -> None:
        assert (await receive())["type"] == "websocket.connect"
        await send({"type": "websocket.accept"})
        while True:
            heard.append(await receive())
            if heard[-1]["type"] == "websocket.disconnect":
                return

    return listen


def closed_with(wire: Wire) -> tuple[int, bytes]:
    """Code and reason of the server's close."""
    said = b"".join(wire.written).partition(b"\r\n\r\n")[2]
    assert said[0] == CLOSE
    return int.from_bytes(said[2:4]), said[4 : 2 + said[1]]


def test_a_message_may_come_in_as_many_pieces_as_are_allowed_and_in_none_more() -> None:
    heard: list[Any] = []
    pieces = frame(TEXT_BEGINS, b"a") + frame(CONTINUES, b"b") * (MOST_FRAGMENTS - 2)
    spoken(listener(heard), pieces + frame(LAST, b"c"))
    assert heard[0] == {"type": "websocket.receive", "text": "a" + "b" * (MOST_FRAGMENTS - 2) + "c"}
    heard.clear()
    wire = spoken(listener(heard), pieces + frame(CONTINUES, b"b") + frame(LAST, b"c"))
    assert closed_with(wire) == (1009, b"more than %d fragments" % MOST_FRAGMENTS)
    assert [each["type"] for each in heard] == ["websocket.disconnect"]
    assert (heard[0]["code"], wire.closed) == (1009, True)


def test_text_is_utf_8_as_a_whole_and_bytes_are_any() -> None:
    heard: list[Any] = []
    euro = "€".encode()
    spoken(listener(heard), frame(TEXT_BEGINS, euro[:1]) + frame(LAST, euro[1:]), frame(BYTES, euro[:1]))
    assert [each.get("text", each.get("bytes")) for each in heard[:2]] == ["€", euro[:1]]
    wire = spoken(listener(heard), frame(TEXT, euro[:1]))
    assert closed_with(wire) == (1007, b"text that is no UTF-8")


def test_pings_that_come_together_are_answered_together() -> None:
    wire = spoken(listener([]), frame(PING, b"a") + frame(PING, b"b"), frame(PING))
    assert wire.written[1:] == [bytes([PONG, 1, 97, PONG, 1, 98]), bytes([PONG, 0])]


@pytest.mark.parametrize(("unsent", "is_let_go"), [(MOST_UNSENT_BYTES, False), (MOST_UNSENT_BYTES + 1, True)])
def test_who_leaves_more_answers_unread_than_are_kept_is_let_go(unsent: int, is_let_go: bool) -> None:
    assert spoken(listener([]), frame(PING), unsent=unsent).aborted is is_let_go


def test_messages_come_in_their_order_and_are_made_a_kilobyte_at_a_time() -> None:
    heard: list[Any] = []
    sent = [f"{number:04}" for number in range(600)]
    wire = spoken(listener(heard), b"".join(frame(TEXT, each.encode()) for each in sent), frame(CLOSE))
    assert [each["text"] for each in heard[:-1]] == sent
    assert wire.paused >= 600 * len(frame(TEXT, b"0000")) // PARSED_BYTES


def test_a_refusal_before_the_handshake_is_an_answer_and_no_fault(caplog: pytest.LogCaptureFixture) -> None:
    async def refuse(_scope: Any, _receive: Any, send: Send) -> None:
        await send({"type": "websocket.http.response.start", "status": 401, "headers": []})
        await send({"type": "websocket.http.response.body", "body": b"no key"})

    wire = spoken(refuse)
    assert wire.written[0].startswith(b"HTTP/1.1 401 ")
    assert b"".join(wire.written).count(b"HTTP/1.1 ") == 1
    assert not caplog.records


def test_of_a_connection_that_the_application_has_closed_nothing_more_is_asked() -> None:
    heard: list[Any] = []

    async def close(_scope: Any, receive: Receive, send: Send) -> None:
        await receive()
        await send({"type": "websocket.accept"})
        heard.append(await receive())
        await send({"type": "websocket.close", "code": 4400, "reason": "enough"})
        heard.append(await receive())

    wire = spoken(close, frame(TEXT, b"one") * 300, frame(CLOSE))
    assert heard[0]["text"] == "one"
    assert closed_with(wire) == (4400, b"enough")


def test_that_the_server_ends_is_no_fault_of_the_application() -> None:
    async def run() -> None:
        async def served(*_given: Any) -> None:
            raise asyncio.CancelledError

        connection = object.__new__(WebSocketConnection)
        connection.app = served
        connection.scope = {}  # type: ignore[typeddict-item]
        connection.handshake_complete, connection.close_timer = True, None
        connection.transport = Wire(0)  # type: ignore[assignment]
        faults: list[object] = []
        connection.logger = SimpleNamespace(exception=faults.append, error=faults.append)  # type: ignore[assignment]
        await connection.run_asgi()
        assert faults == []
        with pytest.raises(ClientDisconnected):
            await connection.app({}, None, None)

    asyncio.run(run())
