"""Connections of somebody who means harm, to a whole server."""

import json
import re
import socket
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager, suppress

import httpx
import pytest

from service import serving as server
from service.http.middleware.request_middleware import MOST_HEADER_BYTES
from service.http.protocol import connections, turns
from service.http.protocol.connections import BoundedConnection, H11Connection
from service.http.protocol.httptools_connections import HttpToolsConnection
from service.http.protocol.websockets import MOST_FRAGMENTS, PARSED_BYTES, WebSocketConnection
from service.settings import Settings

MOST_OF_ONE = 20
Address = tuple[str, int]
Serving = Callable[[Settings], AbstractContextManager[httpx.Client]]


@pytest.fixture(scope="module", params=[HttpToolsConnection, H11Connection])
def address(
    request: pytest.FixtureRequest, serving: Serving, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Address]:
    """Of a server with either parser."""
    protocol: type[BoundedConnection] = request.param
    folder = tmp_path_factory.mktemp("served")
    settings = Settings(data_folder=folder, workers=0, max_connections_per_address=MOST_OF_ONE, max_connections=100)
    with pytest.MonkeyPatch.context() as patch, ExitStack() as stack:
        patch.setattr(server, "parsed_connection", lambda: protocol)
        patch.setattr(connections, "REFUSAL_SECONDS", 0.0)
        client = stack.enter_context(serving(settings))
        yield client.base_url.host, int(client.base_url.port or 0)


def everything(connection: socket.socket) -> bytes:
    """What the server sends until it closes."""
    received = b""
    with suppress(ConnectionResetError):
        while part := connection.recv(65536):
            received += part
    return received


def told(address: Address, *pieces: bytes) -> bytes:
    """The answer to some bytes, until the server closes."""
    with closing(socket.create_connection(address, timeout=10.0)) as connection:
        with suppress(BrokenPipeError, ConnectionResetError):
            for piece in pieces:
                connection.sendall(piece)
        return everything(connection)


CHUNKED = b"POST /v1/materials HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n"
HIDDEN = b"GET /v1/hidden HTTP/1.1\r\nHost: localhost\r\n\r\n"


@pytest.mark.parametrize(
    "sent",
    [
        CHUNKED + b"Content-Length: 5\r\n\r\n0\r\n\r\n" + HIDDEN,
        CHUNKED.replace(b"chunked", b"gzip, chunked") + b"\r\n0\r\n\r\n" + HIDDEN,
        CHUNKED + b"Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n" + HIDDEN,
        b"GET /healthz HTTP/1.1\r\n\r\n" + HIDDEN,
        b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nHost: localhost\r\n\r\n" + HIDDEN,
        b"GET /healthz HTTP/2.0\r\nHost: localhost\r\n\r\n" + HIDDEN,
        b"GET /healthz HTTP/0.9\r\nHost: localhost\r\n\r\n" + HIDDEN,
        b"GET /healthz HTTP/9.9\r\nHost: localhost\r\n\r\n" + HIDDEN,
        b"GET http://elsewhere/healthz HTTP/1.1\r\nHost: localhost\r\n\r\n" + HIDDEN,
        b"GET http://localhost HTTP/1.1\r\nHost: localhost\r\n\r\n" + HIDDEN,
        b"GET localhost:80 HTTP/1.1\r\nHost: localhost\r\n\r\n" + HIDDEN,
        b"CONNECT localhost:80 HTTP/1.1\r\nHost: localhost\r\n\r\n" + HIDDEN,
        b"GET healthz HTTP/1.1\r\nHost: localhost\r\n\r\n" + HIDDEN,
        b"GET /healthz#there HTTP/1.1\r\nHost: localhost\r\n\r\n" + HIDDEN,
    ],
    ids=lambda sent: sent[:80].decode(),
)
def test_what_two_parsers_read_differently_is_refused_and_ends_the_connection(address: Address, sent: bytes) -> None:
    head, _, body = told(address, sent).partition(b"\r\n\r\n")
    assert head.split()[1] in {b"400", b"501"}
    assert b"connection: close" in head.lower()
    assert json.loads(body)["type"] == "/problems/bad-request"  # and nothing after it: the hidden request has no answer


@pytest.mark.parametrize(
    "endless",
    [
        (b"\r\n" * MOST_HEADER_BYTES,),
        (b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nX: ", b"x" * 2**20),
        (b"GET /" + b"x" * 2**20,),
        (CHUNKED + b"\r\n1;", b"x" * 2**20),
        (CHUNKED + b"\r\n0\r\n", b"X: y\r\n" * 2**17),
    ],
    ids=["empty lines", "header", "address", "extension of a chunk", "trailers"],
)
def test_what_does_not_end_is_not_kept(address: Address, endless: tuple[bytes, ...]) -> None:
    began = time.monotonic()
    assert not told(address, *endless).startswith(b"HTTP/1.1 2")
    assert time.monotonic() - began < 5.0


LOCAL = b"Host: localhost\r\nConnection: close\r\n"
MANY_OPTIONS = b"Connection: Upgrade" + 600 * b",a" + b"\r\n"
TO_WEBSOCKET = b"Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"


@pytest.mark.parametrize(
    ("sent", "told_of"),
    [
        (b"GET /healthz HTTP/1.1\r\n" + LOCAL + b"a: b\r\n" * 99, "101 headers; allowed: at most 100"),
        (b"GET /healthz?" + b"%4=&" * 100 + b" HTTP/1.1\r\n" + LOCAL, "101 parameters; allowed: at most 100"),
        (
            b"GET /v1/stream?" + b"a&" * 100 + b" HTTP/1.1\r\nHost: a\r\nConnection: Upgrade\r\n" + TO_WEBSOCKET,
            "101 parameters",
        ),
        (
            b"GET /v1/stream HTTP/1.1\r\nHost: a\r\n" + MANY_OPTIONS + TO_WEBSOCKET,
            "headers for another protocol of 1242 bytes; allowed: at most 1024",
        ),
    ],
    ids=["headers", "parameters", "parameters of a websocket", "handshake"],
)
def test_what_takes_long_to_read_is_refused_before_it_is_known_who_sends_it(
    address: Address, sent: bytes, told_of: str
) -> None:
    head, _, body = told(address, sent + b"\r\n").partition(b"\r\n\r\n")
    assert head.split()[1] in {b"400", b"431"}
    assert told_of in json.loads(body)["detail"]


def test_a_long_offer_of_another_protocol_is_not_read_twice(address: Address) -> None:
    """Read once more without the offer, each of its options was a header: 15 kB became 82 kB."""
    sent = b"GET /healthz HTTP/1.1\r\nHost: a\r\n" + MANY_OPTIONS + b"Upgrade: h2c\r\n\r\n"
    answer = told(address, sent + NEXT)
    by_parser = [b"HTTP/1.1 431"], 2 * [b"HTTP/1.1 200"]  # h11 has nothing to read twice
    assert re.findall(rb"HTTP/1\.1 \d+", answer) in by_parser


def test_what_cannot_be_is_refused_late_and_other_requests_at_once(
    address: Address, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Refusals take no turns: a hundred connections that sent nothing else kept all others waiting."""
    monkeypatch.setattr(connections, "REFUSAL_SECONDS", 0.4)
    for sent, status in (
        (b"GET /healthz HTTP/1.1\r\n" + LOCAL + b"a: b\r\n" * 99, b"431"),
        (b"GET /v1/stream HTTP/1.1\r\nHost: a\r\n" + MANY_OPTIONS + TO_WEBSOCKET, b"431"),
    ):
        began = time.monotonic()
        assert told(address, sent + b"\r\n").split()[1] == status
        assert time.monotonic() - began >= 0.4


OFFERS = (
    b"Connection: Upgrade, HTTP2-Settings\r\nUpgrade: h2c\r\nHTTP2-Settings: AAMAAABkAAQAAP__\r\n",
    b"Connection: upgrade\r\nUpgrade: something/1\r\n",
)
RECOGNISE = b"POST /v1/recognise HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
NEXT = b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"


@pytest.mark.parametrize("offer", OFFERS, ids=["h2c", "unknown"])
@pytest.mark.parametrize("is_chunked", [False, True])
@pytest.mark.parametrize("pieces", [1, 40])
def test_a_body_behind_an_offer_of_another_protocol_is_read(
    address: Address, offer: bytes, is_chunked: bool, pieces: int
) -> None:
    """Java's client and `curl --http2` offer h2c with their first request, whatever it is."""
    body = b'{"grasp_log": "nothing"}'
    framed = b"%x\r\n%b\r\n0\r\n\r\n" % (len(body), body) if is_chunked else body
    length = b"Transfer-Encoding: chunked\r\n" if is_chunked else b"Content-Length: %d\r\n" % len(body)
    sent = RECOGNISE + length + offer + b"\r\n" + framed + NEXT
    step = -(-len(sent) // pieces)
    answer = told(address, *(sent[k : k + step] for k in range(0, len(sent), step)))
    assert answer.startswith(b"HTTP/1.1 409"), answer[:200]
    assert b"/problems/no-model" in answer  # so that the question was understood
    assert answer.count(b"HTTP/1.1 ") == 2


@pytest.mark.parametrize("offer", OFFERS, ids=["h2c", "unknown"])
def test_every_request_that_offers_another_protocol_is_answered(address: Address, offer: bytes) -> None:
    answer = told(address, 4 * (b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n" + offer + b"\r\n") + NEXT)
    assert answer.count(b"HTTP/1.1 200") == 5


def test_an_offer_does_not_hide_an_ambiguous_body(address: Address) -> None:
    sent = RECOGNISE + OFFERS[0] + b"Content-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n" + HIDDEN
    answer = told(address, sent)
    assert answer.startswith(b"HTTP/1.1 400")
    assert answer.count(b"HTTP/1.1 ") == 1


def test_a_connection_that_offers_another_protocol_and_is_to_close_closes(address: Address) -> None:
    offer = b"Connection: close, Upgrade\r\nUpgrade: h2c\r\n"
    answer = told(address, b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n" + offer + b"\r\n" + HIDDEN)
    assert answer.startswith(b"HTTP/1.1 200")
    assert b"hidden" not in answer


def test_trailers_do_not_become_headers(address: Address) -> None:
    sent = CHUNKED + b"Content-Type: application/json\r\n\r\n0\r\nX-Request-ID: from-a-trailer\r\n\r\n"
    answer = told(address, sent, HIDDEN.replace(b"\r\n\r\n", b"\r\nConnection: close\r\n\r\n"))
    assert answer.count(b"HTTP/1.1 4") == 2
    assert b"from-a-trailer" not in answer


def test_garbage_behind_a_request_is_not_taken_for_its_answer(address: Address) -> None:
    answer = told(address, b"GET /v1/jobs HTTP/1.1\r\nHost: localhost\r\n\r\nnonsense\r\n\r\n")
    assert not answer or answer.startswith(b"HTTP/1.1 200")


def test_idle_connections_of_an_address_make_room_for_its_next(address: Address) -> None:
    with ExitStack() as opened:
        idle = []
        for _ in range(MOST_OF_ONE):
            idle.append(opened.enter_context(socket.create_connection(address, timeout=5.0)))
            time.sleep(0.01)
        answer = told(address, b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
        assert answer.startswith(b"HTTP/1.1 200")
        assert idle[0].recv(1) == b""  # it had been idle for longest
        idle[-1].sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
        assert everything(idle[-1]).startswith(b"HTTP/1.1 200")


def test_an_address_whose_connections_are_all_busy_is_told_so(address: Address) -> None:
    head = b"POST /v1/materials HTTP/1.1\r\nHost: localhost\r\n"
    slow = head + b"Content-Type: application/json\r\nContent-Length: 9\r\n\r\n{"
    with ExitStack() as opened:
        for _ in range(MOST_OF_ONE):
            opened.enter_context(socket.create_connection(address, timeout=5.0)).sendall(slow)
        time.sleep(0.3)
        head, _, body = told(address, b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n").partition(b"\r\n\r\n")
        assert head.startswith(b"HTTP/1.1 503")
        assert json.loads(body)["type"] == "/problems/too-many-connections"
    time.sleep(0.3)
    assert told(address, b"GET /healthz HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n").startswith(b"HTTP/1.1 200")


HANDSHAKE = (
    b"GET /v1/stream HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
)


@pytest.mark.parametrize(
    "odd",
    [
        HANDSHAKE + b"Content-Length: 5\r\n\r\nabcde",
        HANDSHAKE + b"Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
        HANDSHAKE + b"Host: elsewhere\r\n\r\n",
        HANDSHAKE.replace(b"HTTP/1.1", b"HTTP/1.0") + b"\r\n",
        HANDSHAKE.replace(b" /v1", b" http://elsewhere/v1") + b"\r\n",
    ],
    ids=["body", "chunks", "two hosts", "HTTP 1.0", "absolute form"],
)
def test_an_odd_request_for_a_websocket_is_refused_at_once(address: Address, odd: bytes) -> None:
    began = time.monotonic()
    head, _, body = told(address, odd).partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 400")
    assert json.loads(body)["type"] == "/problems/bad-request"
    assert time.monotonic() - began < 5.0


def test_websockets_count_among_the_connections_of_an_address(address: Address) -> None:
    with ExitStack() as opened:
        for _ in range(MOST_OF_ONE):
            socket_ = opened.enter_context(socket.create_connection(address, timeout=5.0))
            socket_.sendall(HANDSHAKE + b"\r\n")
            assert socket_.recv(65536).startswith(b"HTTP/1.1 101")
        head, _, body = told(address, HANDSHAKE + b"\r\n").partition(b"\r\n\r\n")
        assert head.startswith(b"HTTP/1.1 503")
        assert b"retry-after: 1" in head
        assert json.loads(body)["type"] == "/problems/too-many-connections"
    time.sleep(0.3)


@contextmanager
def websocket(address: Address) -> Iterator[socket.socket]:
    """An open one whose system keeps little of what is not read."""
    with closing(socket.socket()) as connection:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        connection.settimeout(20.0)
        connection.connect(address)
        connection.sendall(HANDSHAKE + b"\r\n")
        assert connection.recv(4096).startswith(b"HTTP/1.1 101")
        yield connection


def frame(opcode: int, content: bytes = b"") -> bytes:
    """As a client sends it, masked by zeros."""
    return bytes([opcode, 0x80 | len(content)]) + bytes(4) + content


PING, TEXT_BEGINS, CONTINUES, LAST = 0x89, 0x01, 0x00, 0x80


def flood(connection: socket.socket, content: bytes, times: int) -> None:
    for _ in range(times):
        connection.sendall(content)


def test_who_pings_without_reading_the_answers_is_let_go(address: Address) -> None:
    with websocket(address) as connection, pytest.raises((ConnectionResetError, BrokenPipeError)):
        flood(connection, frame(PING, b"x" * 125) * 2000, 250)  # 64 MB


def test_who_pings_and_reads_is_answered(address: Address) -> None:
    with websocket(address) as connection:
        for _ in range(100):
            connection.sendall(frame(PING, b"still there") * 50)
            received = b""
            while len(received) < 50 * 13:
                received += connection.recv(4096)
            assert received == (b"\x8a\x0bstill there") * 50


def test_a_message_in_pieces_without_end_ends_the_connection(address: Address) -> None:
    with websocket(address) as connection:
        connection.sendall(frame(TEXT_BEGINS) + frame(CONTINUES) * MOST_FRAGMENTS)
        assert everything(connection)[2:4] == (1009).to_bytes(2)  # behind the opcode and the length


TEXT, CLOSE, PING, SMALL = 0x81, 0x88, 0x89, 8
PONG = bytes([0x8A, 0])


def opcodes(received: bytes) -> list[int]:
    """Of the frames that have come."""
    found, at = [], 0
    while at + 2 <= len(received):
        found.append(received[at])
        size, at = received[at + 1], at + 2
        more = {126: 2, 127: 8}.get(size, 0)
        at += more + (int.from_bytes(received[at : at + more]) if more else size)
    return found


def until_close(connection: socket.socket) -> bytes:
    """What the server sends on a WebSocket until it closes, which is answered: else it waits 10 s for that."""
    received = b""
    while CLOSE not in opcodes(received):
        received += connection.recv(65536)
    connection.sendall(frame(CLOSE))
    return received + everything(connection)


@pytest.fixture
def most_waiting(monkeypatch: pytest.MonkeyPatch) -> Counter[int]:
    """How many messages waited in the queue of a connection, by its number."""
    found: Counter[int] = Counter()
    original = WebSocketConnection.send_receive_event_to_app

    def counting(connection: WebSocketConnection) -> None:
        original(connection)
        found[id(connection)] = max(found[id(connection)], connection.queue.qsize())

    monkeypatch.setattr(WebSocketConnection, "send_receive_event_to_app", counting)
    return found


def test_small_messages_are_not_made_before_they_are_asked_for(address: Address, most_waiting: Counter[int]) -> None:
    """As objects they take many times their bytes, and after the close of the first nobody asks for the others."""
    with websocket(address) as connection:
        connection.sendall(frame(TEXT, b"{}") * 30_000)
        assert until_close(connection)[2:4] == (1003).to_bytes(2)
    assert 1 <= max(most_waiting.values()) <= PARSED_BYTES // SMALL


@pytest.fixture
def turns_taken(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    taken: list[object] = []
    wait = turns.Turns.wait
    monkeypatch.setattr(turns.Turns, "wait", lambda own, go_on: (taken.append(go_on), wait(own, go_on)))
    return taken


def test_pings_are_answered_in_turns(
    address: Address, turns_taken: list[object], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A connection of nothing else kept all others waiting for as long as it lasted."""
    monkeypatch.setattr(turns, "TURN_SECONDS", 0.0)
    pings = 10_000
    with websocket(address) as connection:
        connection.sendall(frame(PING) * pings)
        said = b""
        while len(said) < 2 * pings:
            said += connection.recv(65536)
        assert said == PONG * pings
        assert len(turns_taken) > 6 * pings // PARSED_BYTES // 2
        connection.sendall(frame(CLOSE))
        assert everything(connection)[:1] == bytes([CLOSE])


@pytest.mark.parametrize("behind", [b"", b"POST /login HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n"])
def test_a_websocket_whose_handshake_takes_several_turns_is_read(
    address: Address, monkeypatch: pytest.MonkeyPatch, behind: bytes
) -> None:
    monkeypatch.setattr(turns, "TURN_SECONDS", 0.0)
    headers = b"".join(b"X-%d: %b\r\n" % (k, b"x" * 100) for k in range(80))
    before = behind and behind + b"1\r\nx\r\n" * 20_000 + b"0\r\n\r\n"
    with closing(socket.create_connection(address, timeout=20.0)) as connection:
        connection.sendall(before + HANDSHAKE + headers + b"\r\n")
        said = b""
        while b"101 Switching" not in said or not said.endswith(b"\r\n\r\n"):
            said += connection.recv(4096)
        connection.sendall(frame(PING))
        assert connection.recv(4096) == PONG


def test_pings_behind_the_last_message_do_not_delay_the_close(
    address: Address, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(turns, "TURN_SECONDS", 0.0)
    began = time.monotonic()
    with websocket(address) as connection:
        connection.sendall(frame(TEXT, b"{}") + frame(PING) * 20_000)
        until_close(connection)
    assert time.monotonic() - began < 8.0  # the server gives the close 10 s


def test_messages_that_wait_as_bytes_come_in_their_order(
    address: Address, most_waiting: Counter[int], turns_taken: list[object]
) -> None:
    """And in turns: the application goes from one to the next without a pause in which others would come."""
    corners = [[x, y, 0.0] for x in (0.0, 1e-3) for y in (0.0, 1e-3)]
    opening = {"type": "open", "position": corners, "grid": [2, 2], "element_area": 1e-6}
    begin = frame(TEXT_BEGINS) + b"".join(frame(CONTINUES, bytes([each])) for each in json.dumps(opening).encode())
    again = frame(TEXT, b'{"type":"frame","number":0,"time":0.0,"displacement":[0,0,0,0,0,0,0,0,0,0,0,0]}')
    with websocket(address) as connection:
        connection.sendall(begin + frame(LAST) + again * 1000 + frame(TEXT, b'{"type":"finish"}'))
        said = until_close(connection)
    assert [said.count(each) for each in (b'"opened"', b'"state"', b'"finished"')] == [1, 1, 1]
    assert said.endswith((1000).to_bytes(2) + b"finished")
    assert max(most_waiting.values()) <= PARSED_BYTES // len(again) + 1
    assert len(turns_taken) > len(again) * 1000 // PARSED_BYTES // 2
