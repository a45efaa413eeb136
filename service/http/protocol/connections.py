"""HTTP connections that cannot be kept waiting, whichever parser reads them.

Who is slow with a request's headers is let go, and so is who goes on with a body after its answer. Who sends much
waits for the others (``turns``). No address may hold all connections, and those that ask nothing make room for others.
Who sends requests without waiting for answers is read no faster than he is answered, and a request that two parsers
could read differently is refused.
"""

import asyncio
import json
from collections import Counter
from heapq import nsmallest
from http import HTTPStatus
from time import perf_counter
from typing import Any

from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.config import Config
from uvicorn.protocols.http.flow_control import HIGH_WATER_LIMIT, FlowControl
from uvicorn.protocols.http.h11_impl import H11Protocol

from service.domain.access.networks import network_of
from service.http.problems import BAD_REQUEST, HEADERS_TOO_LARGE, MEDIA_TYPE, TOO_MANY_CONNECTIONS, ProblemType
from service.http.protocol import turns
from service.http.protocol.joined_writes import JoinedWrites

HEADER_SECONDS = 10.0
"""s from the first byte of a request, or from the connection, to the end of its headers.

As long may a body go on that was answered before it was whole: nobody reads it.
"""

RECEIVED_BYTES = 512 * 1024
"""Taken from a socket at once at most. With asyncio's own 256 KiB a body of 4 MB takes 11 ms to receive, not 7."""

H11_BYTES = 4096
"""Parsed at once by h11, which takes 4 ms for as many in chunks of a byte."""

MOST_HEADERS = 100
"""Of a request; each is looked at several times, and browsers send some twenty."""

MOST_PARAMETERS = 100
"""In the query of an address; routes have ten at most."""

OFFER_BYTES = 1024
"""Of the headers by which another protocol is asked for: they are parsed in Python, some of them byte by byte."""

ROOM_SHARE = 0.05
"""Of all connections that may be, which are let go together where there are too many: to choose them takes 1 ms."""

REFUSAL_SECONDS = 0.5
"""s until what cannot be is refused: it takes no turn (``fair_starts``), and who sends nothing else is slow so."""

VERSIONS = frozenset({"1.0", "1.1"})
BODY_HEADERS = frozenset({b"content-length", b"transfer-encoding"})
OFFER_HEADERS = frozenset({b"connection", b"upgrade", b"http2-settings"})

Headers = list[tuple[bytes, bytes]]
Refusal = tuple[ProblemType, str]
"""What a request is refused as, and why."""


class _HoldingFlow(FlowControl):
    """Reads nothing from the network while the connection holds bytes back that it has not parsed."""

    is_holding = False

    def pause_reading(self) -> None:
        """Read no more, also where the server resumed past this object, as it does with h11."""
        self.read_paused = True
        self._transport.pause_reading()

    def resume_reading(self) -> None:
        """Go on reading, unless bytes are held back: who waits for more of a request has it among those."""
        if not self.is_holding:
            super().resume_reading()


class BoundedConnection(asyncio.Protocol):
    """What is added to either of the server's own protocols: its bounds, and its refusals as problem details.

    An address may have ``per_address`` connections; beyond that the one that was idle for longest makes room. All
    together may have ``limit_concurrency``; beyond that several do, of the addresses that have most.
    """

    transport: asyncio.Transport
    flow: FlowControl
    loop: asyncio.AbstractEventLoop
    config: Config
    client: tuple[str, int] | None
    connections: set[Any]
    tasks: set[Any]
    cycle: Any
    scope: Any
    app: Any
    headers: Headers
    limit_concurrency: int | None

    def __init__(self, *given: Any, per_address: int | None = None, **options: Any) -> None:
        super().__init__(*given, **options)
        self._header_timer: asyncio.TimerHandle | None = None
        self._served: ASGIApp = self.app
        self.app = self._serve
        self._most, self.limit_concurrency = self.limit_concurrency, None  # its own refusal is plain text
        self._per_address = per_address
        self._is_beyond = False
        self._held, self._waits_for_turn = b"", False
        self._is_refused, self.is_let_go = False, False
        self.idle_since = self.loop.time()

    @property
    def is_idle(self) -> bool:
        """Whether no request is being answered."""
        return self.cycle is None or bool(self.cycle.response_complete)

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait for a request."""
        self._writes = JoinedWrites(transport, self.loop)
        super().connection_made(self._writes)  # type: ignore[arg-type]  # in a transport's place
        self.flow = self._flow = _HoldingFlow(self.transport)
        if hasattr(transport, "max_size"):  # asyncio's own; other event loops choose by themselves
            transport.max_size = RECEIVED_BYTES
        self._make_room()
        self._wait_for_headers()

    def data_received(self, data: bytes) -> None:
        """Parse until a request is whole, and hold back what is behind it until it is answered (RFC 9112, 9.3.2).

        Parsed requests take many times their bytes. What takes longer than a turn goes on in others.
        """
        data, parsed, end_of_turn = self._held + data, 0, perf_counter() + turns.TURN_SECONDS
        while parsed < len(data) and self._may_parse():
            if parsed and perf_counter() >= end_of_turn:
                self._wait_for_turn()
                break
            end = parsed + self._parsed_at_once()
            self._parse(data[parsed:end])
            parsed = end
        self._hold(data[parsed:] if self._is_open() else b"")

    def _wait_for_turn(self) -> None:
        if not self._waits_for_turn:
            self._waits_for_turn = True
            turns.turns_of(self.loop).wait(self._take_turn)

    def _take_turn(self) -> None:
        self._waits_for_turn = False
        self._parse_held()
        if not self._held and self._is_open() and (self.is_idle or len(self.cycle.body) <= HIGH_WATER_LIMIT):
            self.flow.resume_reading()

    def _parse_held(self) -> None:
        held = self._held
        self._hold(b"")
        if held:
            self.data_received(held)

    def _hold(self, data: bytes) -> None:
        self._held, self._flow.is_holding = data, bool(data)
        if data:
            self.flow.pause_reading()

    def _is_open(self) -> bool:
        """Whether more requests may come: neither closed, nor a WebSocket by now."""
        return not self.transport.is_closing() and self.transport.get_protocol() is self

    def _may_parse(self) -> bool:
        """Whether no whole request waits for its answer."""
        return self._is_open() and not self._is_refused and (self.is_idle or bool(self.cycle.more_body))

    def _parsed_at_once(self) -> int:
        """Bytes that the parser may be given: by itself it makes requests of all that it has."""
        raise NotImplementedError

    def _parse(self, data: bytes) -> None:
        """Go on waiting unless the headers are there, and the body while it is read."""
        super().data_received(data)
        if self.transport.get_protocol() is not self:  # it became a WebSocket
            return
        if self.is_idle and not self.transport.is_closing():
            if self._header_timer is None:
                self._wait_for_headers()
        else:
            self._stop_waiting()

    def handle_websocket_upgrade(self, *event: Any) -> None:
        """Hand the connection on, unless the request for it is refused as any other would be."""
        self._stop_waiting()
        refusal = self._refusal(self.scope) or _fault_of_handshake(self.scope)
        if refusal is None and self.is_idle:
            self._hold(b"")
            self.flow.resume_reading()  # which a turn that ended within the handshake has paused
            super().handle_websocket_upgrade(*event)  # type: ignore[misc]  # of the server's protocol
        else:
            self.refuse(*(refusal or (BAD_REQUEST, "a WebSocket is asked for before another answer is whole")))

    def refuse(self, kind: ProblemType, detail: str) -> None:
        """Answer and close in a while, and read nothing more."""
        self._is_refused = True
        self.flow.pause_reading()
        self.loop.call_later(_seconds_until(kind), self._end, kind, detail)

    def on_response_complete(self) -> None:
        """Begin to be idle, or go on with what came behind the request."""
        self.idle_since = self.loop.time()
        self._flow.is_holding = False
        super().on_response_complete()  # type: ignore[misc]  # of the server's protocol
        self._parse_held()

    def pause_writing(self) -> None:
        """Hold an answer back that is not read, for as long as some of it is."""
        super().pause_writing()
        self._writes.watch()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        self._stop_waiting()
        self._hold(b"")
        super().connection_lost(exc)

    def shutdown(self) -> None:
        """End after the answer under way; one that nobody reads is given up before the server's own patience ends."""
        super().shutdown()  # type: ignore[misc]  # of the server's protocol
        if self.config.timeout_graceful_shutdown is not None:
            self.loop.call_later(0.9 * self.config.timeout_graceful_shutdown, self._give_up)

    def _give_up(self) -> None:
        if self.transport.get_write_buffer_size() > 0:
            self.transport.abort()

    def send_400_response(self, msg: str) -> None:
        """Refuse what is not HTTP."""
        self._end(BAD_REQUEST, msg)

    def _end(self, kind: ProblemType, detail: str) -> None:
        """Close; say why where that cannot be taken for the answer to another request."""
        if self.transport.is_closing():
            return
        if self.is_idle or self._is_receiving():
            content = _problem(kind, detail)
            status = f"HTTP/1.1 {kind.status} {HTTPStatus(kind.status).phrase}".encode()
            lines = [status, *(name + b": " + value for name, value in _headers(kind, content))]
            self.transport.write(b"\r\n".join([*lines, b"", content]))
        self.transport.close()

    def _is_receiving(self) -> bool:
        return self.cycle.more_body and not self.cycle.response_started

    def _make_room(self) -> None:
        """Close another connection where there are too many, of this address or in all, or else refuse what comes on
        this one.
        """
        count = len(self.connections)
        if self._per_address is not None and self.client is not None and count > self._per_address:
            own = _address(self)
            same = [each for each in self.connections if _address(each) == own]
            held = [each for each in same if not each.transport.is_closing() or _has_unsent(each)]
            if len(held) > self._per_address:
                self._is_beyond = not self._close_one(held)
                return
        if self._most is not None and count > self._most and len(staying := self._staying()) > self._most:
            for each in self._first_to_go(staying, max(1, int(ROOM_SHARE * self._most))):
                _let_go(each)

    def _first_to_go(self, staying: list[Any], several: int) -> list[Any]:
        """So many of those that have nothing to do, each of the address that has most once the others are gone."""
        addresses, left = Counter(map(_address, staying)), []
        unneeded = sorted((each for each in staying if each is not self and _is_unneeded(each)), key=_need)
        for each in unneeded:
            left.append(addresses[_address(each)])
            addresses[_address(each)] -= 1
        return [unneeded[k] for k in nsmallest(several, range(len(left)), key=lambda k: -left[k])]

    def _close_one(self, held: list[Any]) -> bool:
        """Close one that is closing with what its client does not read, or the longest idle; whether there is one."""
        unneeded = [each for each in held if each is not self and _is_unneeded(each)]
        if not unneeded:
            return False
        _let_go(min(unneeded, key=_need))
        return True

    def _has_room(self) -> bool:
        """Whether another request may be answered."""
        if self._most is None or max(len(self.connections), len(self.tasks)) <= self._most:
            return True
        return max(len(self._staying()), len(self.tasks)) <= self._most

    def _staying(self) -> list[Any]:
        """All but those that were let go, which are among the connections until the loop's next round."""
        return [each for each in self.connections if not getattr(each, "is_let_go", False)]

    def _wait_for_headers(self) -> None:
        self._header_timer = self.loop.call_later(HEADER_SECONDS, self.transport.close)

    def _stop_waiting(self) -> None:
        if self._header_timer is not None:
            self._header_timer.cancel()
            self._header_timer = None

    async def _serve(self, scope: Scope, receive: Receive, send: Send) -> None:
        refusal = self._refusal(scope)
        if refusal is None:
            await self._served(scope, receive, _closing_unread(self.cycle, send))
        else:
            await asyncio.sleep(_seconds_until(refusal[0]))
            await _refuse(*refusal, scope, send)

    def _refusal(self, scope: Scope) -> Refusal | None:
        if self._is_beyond:
            return TOO_MANY_CONNECTIONS, "this address has as many as it may; try again later"
        if not self._has_room():
            return TOO_MANY_CONNECTIONS, "as many connections are open as may be; try again later"
        if len(scope["headers"]) > MOST_HEADERS:
            return HEADERS_TOO_LARGE, f"{len(scope['headers'])} headers; allowed: at most {MOST_HEADERS}"
        if (length := _length_of_offer(scope["headers"])) > OFFER_BYTES:
            return HEADERS_TOO_LARGE, f"headers for another protocol of {length} bytes; allowed: at most {OFFER_BYTES}"
        fault = ambiguity(scope) or _excess(scope)
        return None if fault is None else (BAD_REQUEST, fault)

    def _get_upgrade(self) -> Any:
        """The protocol that is asked for; None where the headers for it are so long that the request is refused."""
        if _length_of_offer(self.headers) > OFFER_BYTES:
            return None
        return super()._get_upgrade()  # type: ignore[misc]  # of the server's protocol


def _closing_unread(cycle: Any, send: Send) -> Send:
    """Send, and say that the connection ends where a client still waits for leave to send its body (RFC 9110, 10.1.1).

    Without leave it may send the body or leave it out, so that nobody could tell where its next request begins.
    """

    async def closing(message: Message) -> None:
        is_unread = cycle.waiting_for_100_continue and cycle.more_body and not cycle.body
        if is_unread and message["type"] == "http.response.start":
            message = {**message, "headers": [*message.get("headers", ()), (b"connection", b"close")]}
        await send(message)

    return closing


def _address(connection: Any) -> str | None:
    """Where a connection comes from, by IPv6 its network; None by a socket in the file system."""
    return None if connection.client is None else network_of(str(connection.client[0]))


def _has_unsent(connection: Any) -> bool:
    """Whether its client has not read all that it was sent, which stays in memory until then."""
    return bool(connection.transport.get_write_buffer_size() > 0)


def _need(connection: Any) -> tuple[bool, float]:
    """By which those that make room are ordered: first who is closing and not read, then the longest idle."""
    return not connection.transport.is_closing(), getattr(connection, "idle_since", 0.0)


def _let_go(connection: Any) -> None:
    connection.is_let_go = True
    if _has_unsent(connection):
        connection.transport.abort()
    else:
        connection.transport.close()


def _is_idle(connection: Any) -> bool:
    """Whether a connection asks nothing and stays."""
    return isinstance(connection, BoundedConnection) and connection.is_idle and not connection.is_let_go


def _is_unneeded(connection: Any) -> bool:
    """Whether a connection has nothing more to do than to let its client read."""
    return _is_idle(connection) or (connection.transport.is_closing() and not getattr(connection, "is_let_go", False))


class H11Connection(BoundedConnection, H11Protocol):
    """Read by h11, in Python: where the compiled parser is not installed."""

    def _parsed_at_once(self) -> int:
        """A part of what comes; h11 goes no further than to the end of a request."""
        return H11_BYTES


def ambiguity(scope: Scope) -> str | None:
    """Why a request could be read differently by another parser on its way (RFC 9112: 2.3, 3.2, 6.1), None if not.

    ``raw_path`` is the target as it was sent, without the query.
    """
    if scope["http_version"] not in VERSIONS:
        return f"HTTP version {scope['http_version']}; allowed: 1.0, 1.1"
    target = scope["raw_path"]
    if (not target.startswith(b"/") and target != b"*") or b"#" in target:
        return "a target other than a path, which would name a host beside the header Host; allowed: such as /healthz"
    hosts, lengths, codings = 0, 0, []
    for name, value in scope["headers"]:
        if name == b"host":
            hosts += 1
        elif name == b"content-length":
            lengths += 1
        elif name == b"transfer-encoding":
            codings.append(value.lower())
    if hosts > 1 or (hosts == 0 and scope["http_version"] == "1.1"):
        return f"{hosts} headers Host; allowed: 1"
    if codings and lengths:
        return "both Transfer-Encoding and Content-Length; allowed: one of them"
    return None if codings in ([], [b"chunked"]) else "a Transfer-Encoding other than chunked; allowed: chunked"


def _excess(scope: Scope) -> str | None:
    """What of the address takes long to read before it is known who sends it; None for what all the others send."""
    parameters = scope["query_string"].count(b"&") + 1
    return None if parameters <= MOST_PARAMETERS else f"{parameters} parameters; allowed: at most {MOST_PARAMETERS}"


def _fault_of_handshake(scope: Scope) -> Refusal | None:
    """What RFC 6455, 4.1 forbids; the WebSocket's own protocol would wait for ever for the end of a body."""
    if scope["http_version"] != "1.1":
        return BAD_REQUEST, f"a WebSocket is asked for by HTTP {scope['http_version']}; allowed: 1.1"
    if any(name in BODY_HEADERS for name, _ in scope["headers"]):
        return BAD_REQUEST, "a WebSocket is asked for with a body; allowed: none"
    return None


def _length_of_offer(headers: Headers) -> int:
    return sum(len(value) for name, value in headers if name in OFFER_HEADERS or name.startswith(b"sec-websocket-"))


def _seconds_until(refusal: ProblemType) -> float:
    """Who comes while there is no room makes room at once."""
    return 0.0 if refusal is TOO_MANY_CONNECTIONS else REFUSAL_SECONDS


async def _refuse(kind: ProblemType, detail: str, scope: Scope, send: Send) -> None:
    """Answer before anything else of the service sees the request, and close."""
    content = _problem(kind, detail, scope["path"])
    await send({"type": "http.response.start", "status": kind.status, "headers": _headers(kind, content)})
    await send({"type": "http.response.body", "body": content})


def _problem(kind: ProblemType, detail: str, instance: str = "/") -> bytes:
    problem = {"type": kind.uri, "title": kind.title, "status": kind.status, "detail": detail, "instance": instance}
    return json.dumps(problem).encode()


def _headers(kind: ProblemType, content: bytes) -> list[tuple[bytes, bytes]]:
    length = str(len(content)).encode()
    retry = [(b"retry-after", b"1")] if kind is TOO_MANY_CONNECTIONS else []
    return [
        (b"content-type", MEDIA_TYPE.encode()),
        (b"content-length", length),
        (b"connection", b"close"),
        *retry,
    ]
