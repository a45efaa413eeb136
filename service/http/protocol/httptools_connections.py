"""The same connections, read by httptools: a compiled parser that lacks bounds on what it keeps."""

from typing import Any

import httptools
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from service.http.protocol.connections import BoundedConnection

OFFER = frozenset({b"upgrade", b"http2-settings"})
"""Headers of an offer to speak another protocol from here on, and what ``Connection`` says of them (RFC 9110, 7.8)."""


HEAD_BYTES = 1024
"""Parsed at once outside of bodies: 56 of the shortest requests, which take some 200 kB."""


class HttpToolsConnection(BoundedConnection, HttpToolsProtocol):
    """Refuses headers, trailers and extensions of chunks that do not end within ``h11_max_incomplete_event_size``.

    An offer of another protocol, such as h2c, is passed over and the request answered, as whoever offers it expects.
    """

    def __init__(self, *given: Any, **options: Any) -> None:
        super().__init__(*given, **options)
        self.parser = _PassingParser(self)  # type: ignore[assignment]  # with the few methods that are used of it
        self._unfinished = 0  # bytes since the last that were made use of
        self._body_left = 0  # bytes, as Content-Length says

    def _may_parse(self) -> bool:
        return not self.pipeline and super()._may_parse()

    def _parsed_at_once(self) -> int:
        """A little, or the rest of a body: the parser has no way to stop at the end of a request."""
        return self._body_left or HEAD_BYTES

    def _parse(self, data: bytes) -> None:
        """Let the parser read, unless it keeps too much."""
        self._unfinished += len(data)
        super()._parse(data)
        most = self.config.h11_max_incomplete_event_size
        if most is not None and self._unfinished > most and not self.transport.is_closing():
            self.send_400_response(f"more than {most} bytes of headers, or between parts of the body")

    def on_headers_complete(self) -> None:
        """Begin to answer; trailers of the body are not added to its headers."""
        if self.offers_another_protocol():
            return  # the request is read once more, without the offer
        self._unfinished = 0
        super().on_headers_complete()
        self.scope["raw_path"], _, self.scope["query_string"] = self.url.partition(b"?")  # as it was sent, all of it
        self._body_left = next((int(value) for name, value in self.headers if name == b"content-length"), 0)
        if not self.parser.should_upgrade():
            self.headers = []

    def on_body(self, body: bytes) -> None:
        """Keep a part of the body for who reads it."""
        self._unfinished = 0
        self._body_left = max(0, self._body_left - len(body))
        super().on_body(body)

    def on_message_complete(self) -> None:
        """Begin to wait for the next request."""
        if self.offers_another_protocol():
            return
        self._unfinished = 0
        super().on_message_complete()

    def offers_another_protocol(self) -> bool:
        """Whether the request under way offers one that is not spoken here, so that its parser left it."""
        return self.parser.should_upgrade() and self._get_upgrade() is not None and not self._should_upgrade()

    def asks_for_websocket(self) -> bool:
        """Whether the request under way ends HTTP on this connection."""
        return self._should_upgrade()

    def head_without_offer(self) -> bytes:
        """The request line and headers as they were sent, without the offer."""
        line = b" ".join([self.parser.get_method(), self.url, b"HTTP/" + self.parser.get_http_version().encode()])
        kept = [name + b": " + value for name, value in self.headers if name not in OFFER | {b"connection"}]
        connection_values = b",".join(value for name, value in self.headers if name == b"connection").split(b",")
        options = [option for option in connection_values if option.strip().lower() not in OFFER]
        return b"\r\n".join([line, *kept, b"connection: " + b",".join(options), b"", b""])

    def _is_receiving(self) -> bool:
        return not self.pipeline and super()._is_receiving()


class _PassingParser:
    """httptools' parser; it leaves a request that offers another protocol before its body, so another reads that."""

    def __init__(self, connection: HttpToolsConnection) -> None:
        self._connection = connection
        self._begin()

    def feed_data(self, data: bytes) -> None:
        """Read; raises ``HttpParserUpgrade`` for a WebSocket only."""
        while data:
            try:
                self._parser.feed_data(data)
                return
            except httptools.HttpParserUpgrade as left:
                if self._connection.asks_for_websocket():
                    raise
                if not self._connection.offers_another_protocol():
                    return  # it is refused
                head, behind = self._connection.head_without_offer(), data[left.args[0] :]
            self._begin()
            data = head + behind  # where the next request may make the same offer

    def get_method(self) -> bytes:
        """The request's method."""
        return bytes(self._parser.get_method())

    def get_http_version(self) -> str:
        """The request's version, such as "1.1"."""
        return str(self._parser.get_http_version())

    def should_upgrade(self) -> bool:
        """Whether the request ends HTTP on this connection."""
        return bool(self._parser.should_upgrade())

    def should_keep_alive(self) -> bool:
        """Whether the connection may serve another request."""
        return bool(self._parser.should_keep_alive())

    def _begin(self) -> None:
        self._parser = httptools.HttpRequestParser(self._connection)
        self._parser.set_dangerous_leniencies(lenient_data_after_close=True)  # as the server's own
