"""Real sockets, since what is tested stands between the network and the application."""

import asyncio
import gc
import json
import select
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest
import uvicorn
from starlette.types import Receive, Scope, Send

from service.http.middleware.request_middleware import MOST_HEADER_BYTES
from service.http.protocol import connections, joined_writes, turns
from service.http.protocol.connections import BoundedConnection, H11Connection
from service.http.protocol.httptools_connections import HttpToolsConnection

TIMEOUT = 0.2
MOST, MOST_OF_ONE = 60, 100
BUFFER = 2**16
"""Bytes that the system may keep of what a client does not read, on either side: Linux doubles it."""

LARGE = bytes(2**21)
"""More than that."""

Connect = Callable[..., socket.socket]


async def hello(scope: Scope, receive: Receive, send: Send) -> None:
    """Answers when it has the whole body, or early, and shortly or at length; headers tell the path and what came."""
    assert scope["type"] == "http"
    received, is_read = 0, scope["path"] == "/early"
    while not is_read:
        message = await receive()
        received, is_read = received + len(message.get("body", b"")), not message.get("more_body")
    if scope["path"] == "/slow":
        await asyncio.sleep(TIMEOUT)
    body = LARGE if scope["path"] == "/large" else b"hello"
    told = {b"content-length": str(len(body)).encode(), b"path": scope["raw_path"], b"received": b"%d" % received}
    headers = [*told.items()]
    await send({"type": "http.response.start", "status": 200, "headers": headers})
    await send({"type": "http.response.body", "body": body})


@pytest.fixture(params=[H11Connection, HttpToolsConnection])
def protocol(request: pytest.FixtureRequest) -> type[BoundedConnection]:
    """Either parser."""
    chosen: type[BoundedConnection] = request.param
    return chosen


@pytest.fixture
def most_of_one() -> int:
    """Connections that an address may have."""
    return MOST_OF_ONE


@pytest.fixture
def connect(monkeypatch: pytest.MonkeyPatch, protocol: type[BoundedConnection], most_of_one: int) -> Iterator[Connect]:
    monkeypatch.setattr(connections, "HEADER_SECONDS", TIMEOUT)
    server = uvicorn.Server(
        uvicorn.Config(
            hello,
            lifespan="off",
            log_level="critical",
            http=partial(protocol, per_address=most_of_one),  # type: ignore[arg-type]
            loop="asyncio" if protocol is H11Connection else "uvloop",
            h11_max_incomplete_event_size=MOST_HEADER_BYTES,
            limit_concurrency=MOST,
            ws="none",
        )
    )
    listening = socket.create_server(("127.0.0.1", 0))
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER)  # also of connections that it accepts
    thread = threading.Thread(target=server.run, args=([listening],))
    thread.start()
    while not server.started:
        time.sleep(0.005)
    opened: list[socket.socket] = []

    def open_one(source: str = "127.0.0.1") -> socket.socket:
        address = listening.getsockname()
        opened.append(socket.create_connection(address, timeout=10.0, source_address=(source, 0)))
        opened[-1].setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
        return opened[-1]

    yield open_one
    for each in opened:
        each.close()
    server.should_exit = True
    thread.join()


def rest(connection: socket.socket) -> bytes:
    """Everything until the server closes."""
    received = b""
    try:
        while part := connection.recv(65536):
            received += part
    except ConnectionResetError:
        pass
    return received


def until(connection: socket.socket, text: bytes, times: int = 1) -> bytes:
    """What comes, in however many pieces, up to a text."""
    received = b""
    while received.count(text) < times:
        received += (piece := connection.recv(65536))
        assert piece, received
    return received


@pytest.mark.parametrize("sent", [b"", b"G", b"GET / HTTP/1.1\r\nHost: a\r\n"])
def test_who_does_not_finish_his_headers_is_let_go(connect: Connect, sent: bytes) -> None:
    began, connection = time.monotonic(), connect()
    connection.sendall(sent)
    assert rest(connection) == b""
    assert TIMEOUT * 0.9 < time.monotonic() - began < 5.0


def test_who_goes_on_with_a_body_after_its_answer_is_let_go(connect: Connect) -> None:
    connection = connect()
    connection.sendall(b"POST /early HTTP/1.1\r\nHost: a\r\nContent-Length: 1000\r\n\r\n")
    assert connection.recv(65536).startswith(b"HTTP/1.1 200")
    began = time.monotonic()
    connection.sendall(b"x")  # which ends the server's own clock for idle connections
    rest(connection)
    assert TIMEOUT * 0.9 < time.monotonic() - began < 5.0


EXPECTING = b"Host: a\r\nExpect: 100-continue\r\nContent-Length: 2\r\n\r\n"


def test_who_is_answered_before_he_may_send_his_body_is_told_that_the_connection_ends(connect: Connect) -> None:
    """His next request was taken for the body, and never answered."""
    connection = connect()
    connection.sendall(b"POST /early HTTP/1.1\r\n" + EXPECTING)
    answer = rest(connection)
    assert answer.startswith(b"HTTP/1.1 200")
    assert answer.lower().count(b"connection: close\r\n") == 1
    assert answer.endswith(b"hello")


def test_who_was_let_send_his_body_may_ask_again(connect: Connect) -> None:
    connection = connect()
    for _ in range(2):
        connection.sendall(b"POST / HTTP/1.1\r\n" + EXPECTING)
        assert until(connection, b"\r\n\r\n").startswith(b"HTTP/1.1 100")
        connection.sendall(b"xy")
        answer = until(connection, b"hello").lower()
        assert b"received: 2\r\n" in answer
        assert b"connection: close" not in answer


def test_who_did_not_wait_with_his_body_may_ask_again(connect: Connect) -> None:
    connection = connect()
    for _ in range(2):
        connection.sendall(b"POST /early HTTP/1.1\r\n" + EXPECTING + b"x")
        assert b"connection: close" not in until(connection, b"hello").lower()
        connection.sendall(b"y")


def test_who_waits_for_nothing_with_no_body_may_ask_again(connect: Connect) -> None:
    connection = connect()
    for _ in range(2):
        connection.sendall(b"GET /early HTTP/1.1\r\nHost: a\r\nExpect: 100-continue\r\n\r\n")
        assert b"connection: close" not in until(connection, b"hello").lower()


def test_who_trickles_headers_is_let_go_all_the_same(connect: Connect) -> None:
    began, connection = time.monotonic(), connect()
    connection.sendall(b"GET / HTTP/1.1\r\nHost: a\r\n")
    with suppress(OSError):
        while time.monotonic() - began < 5.0:
            connection.sendall(b"X: y\r\n")
            time.sleep(TIMEOUT / 10.0)
    assert time.monotonic() - began < 3.0


def test_many_slow_ones_keep_nobody_waiting_and_are_all_gone_in_the_end(connect: Connect) -> None:
    slow = [connect() for _ in range(50)]
    for each in slow:
        each.sendall(b"POST / HTTP/1.1\r\n")
    quick = connect()
    began = time.monotonic()
    quick.sendall(b"GET / HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n")
    assert rest(quick).endswith(b"hello")
    assert time.monotonic() - began < 2.0
    assert all(rest(each) == b"" for each in slow)


def test_a_request_may_take_its_time_once_its_headers_are_there(connect: Connect) -> None:
    connection = connect()
    connection.sendall(b"POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 2\r\nConnection: close\r\n\r\nx")
    time.sleep(2.0 * TIMEOUT)
    connection.sendall(b"y")
    assert rest(connection).endswith(b"hello")


def test_the_clock_starts_anew_for_the_next_request_of_a_connection(connect: Connect) -> None:
    connection = connect()
    request = b"GET / HTTP/1.1\r\nHost: a\r\n\r\n"
    for _ in range(2):
        connection.sendall(request)
        answer = b""
        while not answer.endswith(b"hello"):
            answer += connection.recv(65536)
        time.sleep(2.0 * TIMEOUT)  # idle between requests is what keep-alive is for
    connection.sendall(request[:10])
    began = time.monotonic()
    assert rest(connection) == b""
    assert time.monotonic() - began < 5.0


@pytest.mark.parametrize(
    "sent",
    [
        b"nonsense\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\nX: " + b"x" * (2 * MOST_HEADER_BYTES),
        b"GET /\xff HTTP/1.1\r\nHost: a\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\nX-Request-ID: a\rSet-Cookie: b\r\n\r\n",
        b"POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\nxx",
        b"POST / HTTP/1.1\r\nHost: a\r\nContent-Length: -1\r\n\r\n",
        b"POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: gzip, chunked\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n",
    ],
    ids=lambda sent: sent[:40].decode(errors="replace"),
)
def test_what_is_not_http_is_a_problem_and_ends_the_connection(connect: Connect, sent: bytes) -> None:
    connection = connect()
    connection.sendall(sent)
    head, _, body = rest(connection).partition(b"\r\n\r\n")
    assert head.startswith((b"HTTP/1.1 400", b"HTTP/1.1 501"))
    assert b"application/problem+json" in head
    assert b'"type": "/problems/bad-request"' in body


@pytest.mark.parametrize("protocol", [H11Connection], indirect=True)
def test_a_socket_is_read_in_large_pieces(connect: Connect, monkeypatch: pytest.MonkeyPatch) -> None:
    sizes: list[int] = []
    begin = BoundedConnection.connection_made

    def look(self: BoundedConnection, transport: asyncio.Transport) -> None:
        begin(self, transport)
        sizes.append(transport.max_size)  # type: ignore[attr-defined]  # which asyncio reads, and could rename

    monkeypatch.setattr(BoundedConnection, "connection_made", look)
    connection = connect()
    connection.sendall(b"GET / HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n")
    assert rest(connection).endswith(b"hello")
    assert sizes == [connections.RECEIVED_BYTES]


UNENDED = b"POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 2\r\n\r\nx"
"""A request that stops within its body."""


def test_whoever_comes_when_all_connections_are_busy_is_told_so(connect: Connect) -> None:
    others = [connect() for _ in range(MOST)]
    for other in others:
        other.sendall(UNENDED)
    time.sleep(TIMEOUT)
    connection = connect()
    connection.sendall(b"GET /hello HTTP/1.1\r\nHost: a\r\n\r\n")
    head, _, body = rest(connection).partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 503")
    assert b"retry-after: 1" in head.lower()
    assert json.loads(body).items() >= {"type": "/problems/too-many-connections", "instance": "/hello"}.items()
    for other in others:
        other.close()
    time.sleep(TIMEOUT)
    again = connect()
    again.sendall(b"GET / HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n")
    assert rest(again).endswith(b"hello")


def test_connections_that_ask_nothing_make_room_for_others(connect: Connect, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of the address that has most, so that no more files are open than were counted with."""
    monkeypatch.setattr(connections, "HEADER_SECONDS", 60.0)
    of_another = connect("127.0.0.2")
    silent = [connect() for _ in range(MOST + 20)]
    asking = connect()
    asking.sendall(b"GET / HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n")
    assert rest(asking).endswith(b"hello")
    ended, _, _ = select.select(silent, [], [], 0.0)
    several = int(connections.ROOM_SHARE * MOST)
    assert 0 <= len(ended) - (len(silent) + 2 - MOST) < several
    of_another.sendall(b"GET / HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n")
    assert rest(of_another).endswith(b"hello")


def test_nobody_is_refused_while_idle_connections_make_room(connect: Connect) -> None:
    """Those that had been let go counted until the loop's next round: a quarter of the requests was refused."""
    asking = connect("127.0.0.2")
    silent: list[socket.socket] = []
    for round_ in range(30):
        silent += [connect(f"127.0.0.{3 + k % 5}") for k in range(MOST)]
        asking.sendall(b"GET / HTTP/1.1\r\nHost: a\r\n\r\n")
        assert asking.recv(65536).startswith(b"HTTP/1.1 200"), round_
        for each in silent[:-MOST]:
            each.close()


@pytest.mark.parametrize("most_of_one", [2])
@pytest.mark.parametrize("end", [b"Connection: close\r\n", b""], ids=["closing", "idle"])
def test_whose_answers_are_not_read_makes_room_for_the_next(connect: Connect, end: bytes) -> None:
    unread = []
    for _ in range(2):
        unread.append(connect())
        unread[-1].sendall(b"GET /large HTTP/1.1\r\nHost: a\r\n" + end + b"\r\n")
        assert unread[-1].recv(8).startswith(b"HTTP/1.1")
        time.sleep(TIMEOUT)
    another = connect()
    another.sendall(b"GET / HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n")
    assert rest(another).endswith(b"hello")
    received = len(rest(unread[0]))
    assert received < len(LARGE)


@pytest.mark.parametrize("end", [b"Connection: close\r\n", b""], ids=["closing", "idle"])
def test_whose_answers_are_not_read_makes_room_for_other_addresses(connect: Connect, end: bytes) -> None:
    for _ in range(MOST):
        unread = connect()
        unread.sendall(b"GET /large HTTP/1.1\r\nHost: a\r\n" + end + b"\r\n")
        assert unread.recv(8).startswith(b"HTTP/1.1")
    for _ in range(2):
        another = connect("127.0.0.2")
        another.sendall(b"GET / HTTP/1.1\r\nHost: a\r\n\r\n")
        assert until(another, b"hello").startswith(b"HTTP/1.1 200")


def test_a_websocket_that_closes_and_is_not_read_makes_room_for_other_addresses(
    protocol: type[BoundedConnection],
) -> None:
    """It is no connection of this kind, and asks nothing either."""
    config, state = uvicorn.Config(hello, lifespan="off", ws="none", limit_concurrency=1), uvicorn.server.ServerState()
    config.load()
    told = {"is_closing.return_value": True, "get_write_buffer_size.return_value": 10}
    unread, transport = Mock(client=("10.0.0.1", 1), transport=Mock(**told), is_let_go=False), Mock()
    state.connections.add(unread)

    async def connect_another() -> None:
        protocol(config, state, {}, per_address=10).connection_made(transport)  # type: ignore[arg-type]

    asyncio.run(connect_another())
    unread.transport.abort.assert_called_once()


def test_no_address_makes_more_room_than_another_that_has_as_many(protocol: type[BoundedConnection]) -> None:
    """All that go together had been of the one that had most, be it by one."""
    config, state = (
        uvicorn.Config(hello, lifespan="off", ws="none", limit_concurrency=100),
        uvicorn.server.ServerState(),
    )
    config.load()
    told = {"is_closing.return_value": True, "get_write_buffer_size.return_value": 10}
    held = {
        address: [
            Mock(client=(address, k), transport=Mock(**told), is_let_go=False, idle_since=0.0) for k in range(count)
        ]
        for address, count in (("10.0.0.1", 52), ("10.0.0.2", 50))
    }
    state.connections.update(*held.values())

    async def connect_another() -> None:
        protocol(config, state, {}, per_address=100).connection_made(Mock())  # type: ignore[arg-type]

    asyncio.run(connect_another())
    stay = [sum(not each.is_let_go for each in of_one) for of_one in held.values()]
    assert sorted(stay) == [48, 49]


def test_whose_answer_under_way_is_not_read_is_let_go(connect: Connect, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(joined_writes, "UNREAD_SECONDS", TIMEOUT)
    connection = connect()
    connection.sendall(b"GET /large HTTP/1.1\r\nHost: a\r\n\r\n")
    assert connection.recv(8).startswith(b"HTTP/1.1")
    time.sleep(5.0 * TIMEOUT)
    received = len(rest(connection))
    assert received < len(LARGE)


KINDS = (
    b"GET /%d HTTP/1.1\r\nHost: a\r\n\r\n",
    b"POST /%d HTTP/1.1\r\nHost: a\r\nContent-Length: 3000\r\n\r\n" + b"x" * 3000,
    b"POST /%d HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n3\r\nxyz\r\n0\r\n\r\n",
    b"GET /%d HTTP/1.1\r\nHost: a\r\nConnection: Upgrade\r\nUpgrade: h2c\r\n\r\n",
)
LAST = b"GET /last HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n"


@pytest.mark.parametrize("piece", [7_001, 10**6])
def test_requests_that_do_not_wait_for_answers_are_all_answered_in_their_order(connect: Connect, piece: int) -> None:
    sent = b"".join(KINDS[k % len(KINDS)] % k for k in range(400)) + LAST
    connection = connect()
    for at in range(0, len(sent), piece):
        connection.sendall(sent[at : at + piece])
    paths = [line[6:] for line in rest(connection).split(b"\r\n") if line.startswith(b"path: ")]
    assert paths == [*(b"/%d" % k for k in range(400)), b"/last"]


def test_what_comes_behind_the_last_request_is_passed_over(connect: Connect) -> None:
    connection = connect()
    connection.sendall(LAST + KINDS[0] % 1)
    received = rest(connection)
    assert received.count(b"HTTP/1.1 ") == received.count(b"HTTP/1.1 200") == 1
    assert b"path: /last" in received


def parsed_requests() -> int:
    return sum(type(each).__name__ == "RequestResponseCycle" for each in gc.get_objects())


@pytest.mark.parametrize("kind", [KINDS[0], KINDS[2]], ids=["GET", "chunked"])
def test_requests_that_wait_for_others_of_their_connection_are_not_parsed(connect: Connect, kind: bytes) -> None:
    connection = connect()
    connection.sendall(b"GET /slow HTTP/1.1\r\nHost: a\r\n\r\n")
    connection.setblocking(False)
    before, after = parsed_requests(), 0
    with suppress(BlockingIOError):
        connection.sendall(kind % 1 * (2**20 // len(kind)))
    began = time.monotonic()
    while time.monotonic() - began < TIMEOUT:
        after = max(after, parsed_requests() - before)
    assert after < 100


def test_whoever_waits_for_more_of_a_request_has_nothing_behind_it_read(
    connect: Connect, monkeypatch: pytest.MonkeyPatch
) -> None:
    held: list[int] = []
    hold = BoundedConnection._hold

    def look(self: BoundedConnection, data: bytes) -> None:
        hold(self, data)
        held.append(len(data))

    monkeypatch.setattr(BoundedConnection, "_hold", look)
    connection = connect()
    request = b"POST /slow HTTP/1.1\r\nHost: a\r\nContent-Length: 1\r\n\r\nx"
    sender = threading.Thread(target=send_until_shut, args=(connection, request * 2**17))
    sender.start()
    until(connection, b"HTTP/1.1 200", 4)
    connection.shutdown(socket.SHUT_RDWR)
    sender.join()
    assert 0 < max(held) <= connections.RECEIVED_BYTES


def send_until_shut(connection: socket.socket, data: bytes) -> None:
    with suppress(OSError):
        connection.sendall(data)


@pytest.fixture
def turns_taken(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """What waited for a turn, with turns so short that each piece takes one."""
    taken: list[object] = []
    wait = turns.Turns.wait

    def noted(waiting: turns.Turns, go_on: Callable[[], None]) -> None:
        taken.append(go_on)
        wait(waiting, go_on)

    monkeypatch.setattr(turns, "TURN_SECONDS", 0.0)
    monkeypatch.setattr(turns.Turns, "wait", noted)
    return taken


@pytest.mark.parametrize("chunk", [b"x", bytes(100_000)], ids=["of one byte", "large"])
def test_a_body_in_chunks_is_parsed_in_turns_and_comes_whole(
    connect: Connect, turns_taken: list[object], chunk: bytes
) -> None:
    count = 20_000 // len(chunk) or 20
    framed = b"%x\r\n%b\r\n" % (len(chunk), chunk) * count + b"0\r\n\r\n"
    behind = b"GET /behind HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"
    with connect() as connection:
        connection.sendall(
            b"POST / HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n" + framed + behind
        )
        answers = b"".join(iter(partial(connection.recv, 2**16), b""))
    assert b"received: %d\r\n" % (count * len(chunk)) in answers
    assert b"path: /behind" in answers
    assert len(turns_taken) > len(framed) // connections.H11_BYTES // 2


def test_nothing_is_read_while_bytes_are_held_back() -> None:
    """Although the server's h11 resumes reading past the object that is asked to pause it."""
    asked: list[str] = []
    transport: Any = SimpleNamespace(
        pause_reading=lambda: asked.append("pause"), resume_reading=lambda: asked.append("resume")
    )
    flow = connections._HoldingFlow(transport)
    flow.is_holding = True
    flow.pause_reading()
    flow.resume_reading()
    assert (asked, flow.read_paused) == (["pause"], True)
    transport.resume_reading()
    flow.pause_reading()
    assert asked == ["pause", "resume", "pause"]
    flow.is_holding = False
    flow.resume_reading()
    assert (asked[3:], flow.read_paused) == (["resume"], False)


def test_what_is_held_back_behind_an_early_answer_pauses_reading(connect: Connect, turns_taken: list[object]) -> None:
    """The server's h11 resumes reading by itself at the end of a body whose answer was early."""
    del turns_taken
    head = b"POST /early HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n"
    with connect() as connection:
        connection.sendall(head + b"1\r\nx\r\n" * 5_000 + b"0\r\n\r\nGET /large HTTP/1.1\r\nHost: a\r\n\r\n")
        connection.settimeout(2.0)
        sent, block = 0, bytes(2**18)
        with suppress(TimeoutError, ConnectionResetError, BrokenPipeError):
            while sent < 2**26:
                sent += connection.send(block)
    assert sent < 2**25


def scope_of(*headers: tuple[bytes, bytes], version: str = "1.1", path: bytes = b"/a", query: bytes = b"") -> Scope:
    return {"http_version": version, "raw_path": path, "path": "/a", "query_string": query, "headers": [*headers]}


HOST, LENGTH, CHUNKED = (b"host", b"a"), (b"content-length", b"1"), (b"transfer-encoding", b"Chunked")


@pytest.mark.parametrize(
    "scope",
    [
        scope_of(HOST),
        scope_of(version="1.0"),
        scope_of(HOST, version="1.0"),
        scope_of(HOST, path=b"*"),
        scope_of(HOST, LENGTH),
        scope_of(HOST, CHUNKED),
    ],
)
def test_what_every_parser_reads_alike_is_taken(scope: Scope) -> None:
    assert connections.ambiguity(scope) is None


@pytest.mark.parametrize(
    ("scope", "fault"),
    [
        (scope_of(HOST, version="2.0"), "HTTP version 2.0; allowed: 1.0, 1.1"),
        (scope_of(HOST, path=b"a"), "a target other than a path"),
        (scope_of(HOST, path=b"**"), "a target other than a path"),
        (scope_of(HOST, path=b"/a#b"), "a target other than a path"),
        (scope_of(), "0 headers Host; allowed: 1"),
        (scope_of(HOST, HOST), "2 headers Host; allowed: 1"),
        (scope_of(HOST, HOST, version="1.0"), "2 headers Host; allowed: 1"),
        (scope_of(HOST, LENGTH, CHUNKED), "both Transfer-Encoding and Content-Length; allowed: one of them"),
        (scope_of(HOST, CHUNKED, CHUNKED), "a Transfer-Encoding other than chunked; allowed: chunked"),
        (scope_of(HOST, (b"transfer-encoding", b"gzip")), "a Transfer-Encoding other than chunked; allowed: chunked"),
    ],
)
def test_what_two_parsers_could_read_differently_is_named(scope: Scope, fault: str) -> None:
    told = connections.ambiguity(scope)
    assert told is not None
    assert told.startswith(fault)


def refused(scope: Scope, *, is_beyond: bool = False, has_room: bool = True) -> tuple[str, str] | None:
    connection: Any = SimpleNamespace(_is_beyond=is_beyond, _has_room=lambda: has_room)
    refusal = BoundedConnection._refusal(connection, scope)
    return None if refusal is None else (refusal[0].title, refusal[1])


def test_a_request_has_as_many_headers_and_parameters_as_it_may_and_none_more() -> None:
    assert refused(scope_of(*[HOST, *99 * [(b"a", b"b")]])) is None
    told = refused(scope_of(*[HOST, *100 * [(b"a", b"b")]]))
    assert told is not None
    assert told[1] == "101 headers; allowed: at most 100"
    assert refused(scope_of(HOST, query=b"a=1" + 99 * b"&a")) is None
    told = refused(scope_of(HOST, query=b"a=1" + 100 * b"&a"))
    assert told is not None
    assert told[1] == "101 parameters; allowed: at most 100"


@pytest.mark.parametrize("name", [b"connection", b"upgrade", b"http2-settings", b"sec-websocket-protocol"])
def test_an_offer_of_another_protocol_is_as_long_as_it_may_be_and_no_longer(name: bytes) -> None:
    rest_of_it = (b"sec-websocket-key", 24 * b"k")
    assert refused(scope_of(HOST, rest_of_it, (name, 1000 * b"a"), (b"cookie", 2000 * b"c"))) is None
    told = refused(scope_of(HOST, rest_of_it, (name, 1001 * b"a")))
    assert told is not None
    assert told[1] == "headers for another protocol of 1025 bytes; allowed: at most 1024"


def test_where_there_is_no_room_nothing_else_is_looked_at() -> None:
    beyond, full = refused(scope_of(), is_beyond=True), refused(scope_of(), has_room=False)
    assert beyond is not None
    assert full is not None
    assert beyond[1] == "this address has as many as it may; try again later"
    assert full[1] == "as many connections are open as may be; try again later"


def test_who_is_told_to_try_again_is_told_at_once_and_when() -> None:
    for kind, seconds in ((connections.TOO_MANY_CONNECTIONS, 0.0), (connections.BAD_REQUEST, 0.5)):
        content = connections._problem(kind, "why", "/a")
        headers = dict(connections._headers(kind, content))
        assert connections._seconds_until(kind) == seconds
        assert headers.get(b"retry-after") == (b"1" if seconds == 0.0 else None)
        assert (headers[b"connection"], headers[b"content-length"]) == (b"close", b"%d" % len(content))
        assert headers[b"content-type"] == b"application/problem+json"
        told = json.loads(content)
        assert (told["status"], told["detail"], told["instance"]) == (kind.status, "why", "/a")
        assert (told["type"], told["title"]) == (kind.uri, kind.title)


def test_a_websocket_is_asked_for_without_a_body_and_by_http_1_1() -> None:
    assert connections._fault_of_handshake(scope_of(HOST)) is None
    for scope, fault in (
        (scope_of(HOST, version="1.0"), "a WebSocket is asked for by HTTP 1.0; allowed: 1.1"),
        (scope_of(HOST, LENGTH), "a WebSocket is asked for with a body; allowed: none"),
        (scope_of(HOST, CHUNKED), "a WebSocket is asked for with a body; allowed: none"),
    ):
        told = connections._fault_of_handshake(scope)
        assert told is not None
        assert told[1] == fault


@pytest.mark.parametrize(
    ("open_ones", "let_go", "tasks", "has_room"),
    [(5, 0, 5, True), (6, 0, 5, False), (6, 1, 5, True), (6, 2, 6, False), (0, 0, 6, False)],
)
def test_as_many_connections_and_requests_may_be_as_are_allowed(
    open_ones: int, let_go: int, tasks: int, has_room: bool
) -> None:
    """Those that were let go are among the connections until the loop's next round, and take no room."""
    known = {Mock(is_let_go=k < let_go) for k in range(open_ones)}
    connection: Any = SimpleNamespace(_most=5, connections=known, tasks=set(range(tasks)))
    connection._staying = lambda: BoundedConnection._staying(connection)
    assert BoundedConnection._has_room(connection) is has_room
    connection._most = None
    assert BoundedConnection._has_room(connection)


def test_first_goes_who_closes_unread_and_then_the_longest_idle() -> None:
    def held(idle_since: float, *, is_closing: bool) -> Any:
        return Mock(idle_since=idle_since, transport=Mock(**{"is_closing.return_value": is_closing}))

    long_idle, idle, closing = held(1.0, is_closing=False), held(2.0, is_closing=False), held(3.0, is_closing=True)
    assert sorted([idle, long_idle, closing], key=connections._need) == [closing, long_idle, idle]


@pytest.mark.parametrize("unsent", [0, 1])
def test_who_has_not_read_all_is_let_go_at_once(unsent: int) -> None:
    one = Mock(is_let_go=False, transport=Mock(**{"get_write_buffer_size.return_value": unsent}))
    connections._let_go(one)
    assert one.is_let_go
    assert (one.transport.abort.call_count, one.transport.close.call_count) == (unsent, 1 - unsent)
    BoundedConnection._give_up(SimpleNamespace(transport=one.transport))  # type: ignore[arg-type]
    assert one.transport.abort.call_count == 2 * unsent


def test_addresses_of_one_ipv6_network_have_the_connections_of_one(protocol: type[BoundedConnection]) -> None:
    """One machine has as many of them as it likes: five held all connections, and nobody needs a key for that."""
    config, state = (
        uvicorn.Config(hello, lifespan="off", ws="none", limit_concurrency=100),
        uvicorn.server.ServerState(),
    )
    config.load()
    busy = {"is_closing.return_value": False, "get_write_buffer_size.return_value": 0}
    held = [Mock(client=(f"fd00:1::{k:x}", 1, 0, 0), transport=Mock(**busy), is_let_go=False) for k in range(10)]
    state.connections.update(held)

    async def is_beyond(host: str) -> bool:
        transport = Mock(**busy)
        transport.get_extra_info = lambda name, default=None: (host, 5) if name == "peername" else default
        another = protocol(config, state, {}, per_address=10)
        another.connection_made(transport)
        state.connections.discard(another)
        return another._is_beyond

    assert asyncio.run(is_beyond("fd00:1::ffff"))
    assert not asyncio.run(is_beyond("fd00:2::1"))
