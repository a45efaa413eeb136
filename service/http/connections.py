"""HTTP connections that cannot be kept waiting: who is slow with a request's headers is let go.

So is who goes on with a body after its answer.
"""

import asyncio
import json
from typing import Any

import h11
from starlette.types import Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

from service.http.problems import BAD_REQUEST, MEDIA_TYPE, TOO_MANY_CONNECTIONS, ProblemType

HEADER_SECONDS = 10.0
"""s from the first byte of a request, or from the connection, to the end of its headers.

As long may a body go on that was answered before it was whole: nobody reads it.
"""

RECEIVED_BYTES = 512 * 1024
"""Taken from a socket at once at most. With asyncio's own 256 KiB a body of 4 MB takes 11 ms to receive, not 7."""


class BoundedConnection(H11Protocol):
    """The server's own protocol with a clock for headers, which it lacks, and its own refusals as problem details."""

    def __init__(self, *given: Any, **options: Any) -> None:
        super().__init__(*given, **options)
        self._header_timer: asyncio.TimerHandle | None = None
        self._served = self.app
        self._most, self.limit_concurrency = self.limit_concurrency, None  # its own refusal is plain text

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait for a request."""
        super().connection_made(transport)
        if hasattr(transport, "max_size"):  # asyncio's own; other event loops choose by themselves
            transport.max_size = RECEIVED_BYTES
        self._wait_for_headers()

    def data_received(self, data: bytes) -> None:
        """Go on waiting unless the headers are there, and the body while it is read."""
        is_full = self._most is not None and max(len(self.connections) - 1, len(self.tasks)) >= self._most
        self.app = _refuse if is_full else self._served
        super().data_received(data)
        is_answered = self.conn.our_state is h11.DONE and self.conn.their_state is h11.SEND_BODY
        if (self.conn.their_state is h11.IDLE or is_answered) and not self.transport.is_closing():
            if self._header_timer is None:
                self._wait_for_headers()
        else:
            self._stop_waiting()

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        """Hand the connection on."""
        self._stop_waiting()
        super().handle_websocket_upgrade(event)

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        self._stop_waiting()
        super().connection_lost(exc)

    def shutdown(self) -> None:
        """End after the answer under way; one that nobody reads is given up before the server's own patience ends."""
        super().shutdown()
        if self.config.timeout_graceful_shutdown is not None:
            self.loop.call_later(0.9 * self.config.timeout_graceful_shutdown, self._give_up)

    def _give_up(self) -> None:
        if self.transport.get_write_buffer_size() > 0:
            self.transport.abort()

    def send_400_response(self, msg: str) -> None:
        """Refuse what is not HTTP, and close."""
        content = _problem(BAD_REQUEST, msg)
        response = h11.Response(status_code=BAD_REQUEST.status, headers=_headers(content))
        for event in (response, h11.Data(data=content), h11.EndOfMessage()):
            self.transport.write(self.conn.send(event) or b"")
        self.transport.close()

    def _wait_for_headers(self) -> None:
        self._header_timer = self.loop.call_later(HEADER_SECONDS, self.transport.close)

    def _stop_waiting(self) -> None:
        if self._header_timer is not None:
            self._header_timer.cancel()
            self._header_timer = None


async def _refuse(scope: Scope, receive: Receive, send: Send) -> None:  # noqa: ARG001
    """Answer a request for which there is no room, before anything else of the service sees it."""
    content = _problem(TOO_MANY_CONNECTIONS, "as many connections are open as may be; try again later", scope["path"])
    headers = [*_headers(content), (b"retry-after", b"1")]
    await send({"type": "http.response.start", "status": TOO_MANY_CONNECTIONS.status, "headers": headers})
    await send({"type": "http.response.body", "body": content})


def _problem(kind: ProblemType, detail: str, instance: str = "/") -> bytes:
    problem = {"type": kind.uri, "title": kind.title, "status": kind.status, "detail": detail, "instance": instance}
    return json.dumps(problem).encode()


def _headers(content: bytes) -> list[tuple[bytes, bytes]]:
    length = str(len(content)).encode()
    return [(b"content-type", MEDIA_TYPE.encode()), (b"content-length", length), (b"connection", b"close")]
