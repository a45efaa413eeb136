"""HTTP connections that cannot be kept waiting: who is slow with a request's headers is let go.

So is who goes on with a body after its answer.
"""

import asyncio
import json
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from service.problems import BAD_REQUEST, MEDIA_TYPE

HEADER_SECONDS = 10.0
"""s from the first byte of a request, or from the connection, to the end of its headers.

As long may a body go on that was answered before it was whole: nobody reads it.
"""


class BoundedConnection(H11Protocol):
    """The server's own protocol with a clock for headers, which it lacks, and its own refusals as problem details."""

    def __init__(self, *given: Any, **options: Any) -> None:
        super().__init__(*given, **options)
        self._header_timer: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait for a request."""
        super().connection_made(transport)
        self._wait_for_headers()

    def data_received(self, data: bytes) -> None:
        """Go on waiting unless the headers are there, and the body while it is read."""
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

    def send_400_response(self, msg: str) -> None:
        """Refuse what is not HTTP, and close."""
        kind = BAD_REQUEST
        problem = {"type": kind.uri, "title": kind.title, "status": kind.status, "detail": msg, "instance": "/"}
        content = json.dumps(problem).encode()
        headers = [("content-type", MEDIA_TYPE), ("content-length", str(len(content))), ("connection", "close")]
        for event in (
            h11.Response(status_code=kind.status, headers=headers),
            h11.Data(data=content),
            h11.EndOfMessage(),
        ):
            self.transport.write(self.conn.send(event) or b"")
        self.transport.close()

    def _wait_for_headers(self) -> None:
        self._header_timer = self.loop.call_later(HEADER_SECONDS, self.transport.close)

    def _stop_waiting(self) -> None:
        if self._header_timer is not None:
            self._header_timer.cancel()
            self._header_timer = None
