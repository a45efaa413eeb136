"""What httptools' connections add to its parser, without a network: bytes go in, requests and answers come out."""

import asyncio
import json
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
import uvicorn
from starlette.types import Receive, Scope, Send
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from service.http.protocol.httptools_connections import HEAD_BYTES, HttpToolsConnection

MOST = 400
"""Bytes of headers that are kept of a request."""

Asked = list[tuple[Scope, bytes]]


class Wire(SimpleNamespace):
    """A transport that keeps what is written."""

    def __init__(self) -> None:
        super().__init__(written=b"", closed=False, is_left_open=False, protocol=None, reads=True)

    def get_extra_info(self, name: str) -> Any:
        return {"peername": ("10.0.0.9", 4000), "sockname": ("10.0.0.1", 80)}.get(name)

    def write(self, data: bytes) -> None:
        self.written += data

    def close(self) -> None:
        self.closed = True

    def is_closing(self) -> bool:
        return bool(self.closed)

    def get_write_buffer_size(self) -> int:
        return 0

    def get_protocol(self) -> Any:
        return self.protocol

    def pause_reading(self) -> None:
        self.reads = False

    def resume_reading(self) -> None:
        self.reads = True


async def turns(count: int = 20) -> None:
    for _ in range(count):
        await asyncio.sleep(0)


def exchange(*pieces: bytes, look: Callable[[HttpToolsConnection], object] = lambda _: None) -> tuple[Asked, Wire]:
    """What an application is asked by these pieces, each of which comes after the answers to those before it."""
    asked: Asked = []

    async def answer(scope: Scope, receive: Receive, send: Send) -> None:
        body, more = b"", True
        while more:
            message = await receive()
            body, more = body + message.get("body", b""), bool(message.get("more_body"))
        asked.append((scope, body))
        await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"2")]})
        await send({"type": "http.response.body", "body": b"ok"})

    async def run() -> Wire:
        config = uvicorn.Config(
            answer, lifespan="off", ws="none", log_level="critical", h11_max_incomplete_event_size=MOST
        )
        config.load()
        connection, wire = HttpToolsConnection(config, uvicorn.server.ServerState(), {}), Wire()
        wire.protocol = connection
        connection.connection_made(wire)  # type: ignore[arg-type]
        for piece in pieces:
            connection.data_received(piece)
            look(connection)
            await turns()
        wire.is_left_open = not wire.closed
        connection.connection_lost(None)
        await turns()
        return wire

    return asked, asyncio.run(run())


def refusal(wire: Wire) -> str:
    head, _, body = wire.written.partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 400 ")
    return str(json.loads(body)["detail"])


BEGIN = b"GET / HTTP/1.1\r\nHost: a\r\nX: "


@pytest.mark.parametrize("pieces", [1, 7])
def test_headers_may_be_as_long_as_is_allowed_and_no_byte_longer(pieces: int) -> None:
    head = BEGIN + (MOST - len(BEGIN)) * b"x"
    parts = [head[k * len(head) // pieces : (k + 1) * len(head) // pieces] for k in range(pieces)]
    asked, wire = exchange(*parts, b"")
    assert (asked, wire.written, wire.is_left_open) == ([], b"", True)
    _, wire = exchange(*parts, b"x")
    assert refusal(wire) == f"more than {MOST} bytes of headers, or between parts of the body"
    assert not wire.is_left_open


def test_each_request_and_each_part_of_a_body_may_be_as_long_as_is_allowed() -> None:
    """What is counted begins anew with whatever was made use of."""
    long = BEGIN + (MOST - len(BEGIN) - 100) * b"x" + b"\r\n\r\n"
    asked, wire = exchange(long, long, long)
    assert len(asked) == wire.written.count(b"HTTP/1.1 200") == 3
    extension = b"1;" + (MOST - 100) * b"e" + b"\r\ny\r\n"
    chunked = b"POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n"
    asked, wire = exchange(chunked, extension, extension, extension, b"0\r\n\r\n")
    assert [body for _, body in asked] == [b"yyy"]
    asked, wire = exchange(chunked, b"1\r\ny\r\n0\r\n\r\n" + long)
    assert len(asked) == wire.written.count(b"HTTP/1.1 200") == 2


def test_a_body_is_parsed_at_once_and_all_else_a_kilobyte_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    parsed: list[int] = []
    parse = HttpToolsProtocol.data_received

    def look(self: HttpToolsProtocol, data: bytes) -> None:
        parsed.append(len(data))
        parse(self, data)

    monkeypatch.setattr(HttpToolsProtocol, "data_received", look)
    head = b"POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 5000\r\nX: 1\r\n\r\n"
    head = head.replace(b"1\r\n\r\n", (HEAD_BYTES - len(head) + 1) * b"1" + b"\r\n\r\n")
    monkeypatch.setattr("tests.service.http.protocol.test_httptools_connections.MOST", 2 * HEAD_BYTES)
    asked, _ = exchange(head, 2000 * b"b", 3000 * b"b" + BEGIN + b"\r\n\r\n")
    assert [len(body) for _, body in asked] == [5000, 0]
    assert parsed == [HEAD_BYTES, 2000, 3000, len(BEGIN) + 4]
    parsed.clear()
    chunks = 100 * (b"32\r\n" + 50 * b"c" + b"\r\n") + b"0\r\n\r\n"
    asked, _ = exchange(b"POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n", chunks)
    assert [len(body) for _, body in asked] == [5000]
    assert max(parsed) == HEAD_BYTES


def test_an_address_is_told_as_it_was_sent() -> None:
    ((scope, _),), _ = exchange(b"GET /a%20b//c?x=1?y=%32&z HTTP/1.1\r\nHost: a\r\n\r\n")
    assert (scope["path"], scope["raw_path"]) == ("/a b//c", b"/a%20b//c")
    assert scope["query_string"] == b"x=1?y=%32&z"
    ((scope, _),), _ = exchange(b"GET /none HTTP/1.1\r\nHost: a\r\n\r\n")
    assert (scope["raw_path"], scope["query_string"]) == (b"/none", b"")


@pytest.mark.parametrize("version", [b"1.1", b"1.0"])
def test_of_an_offer_of_another_protocol_nothing_is_left_and_of_the_request_all_else(version: bytes) -> None:
    offer = (
        b"POST /there?a=b HTTP/" + version + b"\r\nHost: a\r\nUpgrade: h2c\r\nA: 1\r\nHTTP2-Settings: AAMAAABk\r\n"
        b"Connection: Upgrade, close ,HTTP2-Settings\r\nContent-Length: 3\r\nB: 2\r\n\r\n"
    )
    (asked, wire) = exchange(offer + b"abc")
    ((scope, body),) = asked
    assert (scope["method"], scope["raw_path"], scope["query_string"]) == ("POST", b"/there", b"a=b")
    assert (scope["http_version"], body) == (version.decode(), b"abc")
    kept = [(name, value.strip()) for name, value in scope["headers"]]
    assert kept == [
        (b"host", b"a"), (b"a", b"1"), (b"content-length", b"3"), (b"b", b"2"), (b"connection", b"close")
    ]  # fmt: skip
    assert wire.written.count(b"HTTP/1.1 200") == 1
    assert not wire.is_left_open


def test_offers_that_come_together_are_each_passed_over() -> None:
    offer = b"GET /%d HTTP/1.1\r\nHost: a\r\nUpgrade: h2c\r\nConnection: Upgrade\r\n\r\n"
    asked, wire = exchange(b"".join(offer % k for k in range(3)) + b"GET /3 HTTP/1.1\r\nHost: a\r\n\r\n", b"", b"")
    assert [scope["path"] for scope, _ in asked] == ["/0", "/1", "/2", "/3"]
    assert wire.written.count(b"HTTP/1.1 200") == 4
    assert wire.is_left_open


def test_trailers_are_no_headers() -> None:
    chunked = b"POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n"
    asked, _ = exchange(chunked + b"1\r\ny\r\n", b"0\r\nHidden: 1\r\n\r\n")
    ((scope, body),) = asked
    assert [name for name, _ in scope["headers"]] == [b"host", b"transfer-encoding"]
    assert body == b"y"


def test_what_is_no_http_is_refused_where_it_cannot_be_taken_for_another_s_answer() -> None:
    _, wire = exchange(b"nonsense\r\n\r\n")
    assert refusal(wire)
    assert not wire.is_left_open
    asked, wire = exchange(b"GET / HTTP/1.1\r\nHost: a\r\n\r\nnonsense\r\n\r\n", b"")
    assert [scope["path"] for scope, _ in asked] == ["/"]
    assert (wire.written, wire.is_left_open) == (b"", False)
