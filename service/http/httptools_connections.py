"""The same connections, read by httptools: a compiled parser that lacks bounds on what it keeps."""

from typing import Any

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from service.http.connections import BoundedConnection


class HttpToolsConnection(BoundedConnection, HttpToolsProtocol):
    """Refuses headers, trailers and extensions of chunks that do not end within ``h11_max_incomplete_event_size``."""

    def __init__(self, *given: Any, **options: Any) -> None:
        super().__init__(*given, **options)
        self._unfinished = 0  # bytes since the last that were made use of

    def data_received(self, data: bytes) -> None:
        """Let the parser read, unless it keeps too much."""
        self._unfinished += len(data)
        super().data_received(data)
        most = self.config.h11_max_incomplete_event_size
        if most is not None and self._unfinished > most and not self.transport.is_closing():
            self.send_400_response(f"more than {most} bytes of headers, or between parts of the body")

    def on_headers_complete(self) -> None:
        """Begin to answer; trailers of the body are not added to its headers."""
        self._unfinished = 0
        super().on_headers_complete()
        if not self.parser.should_upgrade():
            self.headers = []

    def on_body(self, body: bytes) -> None:
        """Keep a part of the body for who reads it."""
        self._unfinished = 0
        super().on_body(body)

    def on_message_complete(self) -> None:
        """Begin to wait for the next request."""
        self._unfinished = 0
        super().on_message_complete()

    def _is_receiving(self) -> bool:
        return not self.pipeline and super()._is_receiving()
