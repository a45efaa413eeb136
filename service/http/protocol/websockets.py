"""The server's WebSocket connections, whose refusals are answers as any others."""

import asyncio
from time import perf_counter
from typing import Any, cast

from uvicorn.protocols.utils import ClientDisconnected
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import CloseCode, Frame

from service.http.bodies import is_utf_8
from service.http.protocol import turns
from service.http.protocol.joined_writes import JoinedWrites

MOST_UNSENT_BYTES = 2**20
"""Of answers to pings that a client does not read; the application waits from 64 KiB on."""

MOST_FRAGMENTS = 1024
"""Of one message; the bound on its bytes does not count those that are empty."""

PARSED_BYTES = 1024
"""Made into messages at once, until the application asks for more: small ones take many times their bytes."""


class WebSocketConnection(WebSocketsSansIOProtocol):
    """Takes a refusal for the end of the handshake: by itself the server logs it as an error of the application.

    So it does with the server's own end, and with text that is no UTF-8. Who pings without reading is let go, and so is
    who sends a message in pieces without end.
    """

    _held = b""

    async def run_asgi(self) -> None:
        """Serve the connection; that the server ends before it is over is no fault of anybody."""
        served = self.app

        async def ended_with_the_server(*given: Any) -> None:
            try:
                await served(*given)
            except asyncio.CancelledError:
                raise ClientDisconnected from None

        self.app = ended_with_the_server
        await super().run_asgi()

    def data_received(self, data: bytes) -> None:
        """Take what has come, a piece after the other while the application has nothing to read."""
        self._held += data
        self._parse()

    async def receive(self) -> Any:
        """The next message."""
        message = await super().receive()
        if self._held and not self.read_paused:  # the application goes on at once as long as a message is there
            self._wait_for_turn()
        return message

    def _parse(self) -> None:
        data, parsed, end_of_turn = self._held, 0, perf_counter() + turns.TURN_SECONDS
        while parsed < len(data) and not self.read_paused and not self.transport.is_closing():
            if parsed and perf_counter() >= end_of_turn:
                self._wait_for_turn()
                break
            super().data_received(data[parsed : parsed + PARSED_BYTES])
            self._answer_pings()
            parsed += PARSED_BYTES
        self._held = data[parsed:]

    def _wait_for_turn(self) -> None:
        self.read_paused = True
        self.transport.pause_reading()
        turns.turns_of(self.loop).wait(self._take_turn)

    def _take_turn(self) -> None:
        is_wanted = self.close_sent or self.queue.empty()  # after the close all is passed over but the client's own
        if self.read_paused and is_wanted and not self.transport.is_closing():
            self.read_paused = False
            self.transport.resume_reading()
        self._parse()

    async def send(self, message: Any) -> None:
        """Send what the application says."""
        await super().send(message)
        if self.close_sent:
            while self.queue.qsize() > 1:  # but that it is over, nothing is asked for any more
                self.queue.get_nowait()
            self._parse()
        is_refused = self.initial_response is not None and self.close_sent
        self.handshake_complete = self.handshake_complete or is_refused

    def pause_writing(self) -> None:
        """Hold messages back that are not read, for as long as some are."""
        super().pause_writing()
        cast(JoinedWrites, self.transport).watch()  # that of the connection which became this one

    def handle_ping(self) -> None:
        """Leave it to be answered with the others that came with it."""

    def _answer_pings(self) -> None:
        """Send the answers, unless they pile up."""
        if answers := b"".join(self.conn.data_to_send()):
            self.transport.write(answers)
        if self.transport.get_write_buffer_size() > MOST_UNSENT_BYTES:
            self.transport.abort()

    def send_receive_event_to_app(self) -> None:
        """Hand a message on, unless it is text that is none (RFC 6455, 8.1)."""
        if self.curr_msg_data_type == "text" and not is_utf_8(b"".join(self.frames)):
            self.frames = []
            self._fail(CloseCode.INVALID_DATA, "text that is no UTF-8")
        else:
            super().send_receive_event_to_app()

    def handle_cont(self, event: Frame) -> None:
        """Take another piece of a message."""
        if len(self.frames) < MOST_FRAGMENTS:
            super().handle_cont(event)
        else:
            self._fail(CloseCode.MESSAGE_TOO_BIG, f"more than {MOST_FRAGMENTS} fragments")

    def _fail(self, code: CloseCode, reason: str) -> None:
        self.conn.fail(code, reason)
        self.handle_parser_exception()
