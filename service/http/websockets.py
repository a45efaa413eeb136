"""The server's WebSocket connections, whose refusals are answers as any others."""

from typing import Any

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol


class WebSocketConnection(WebSocketsSansIOProtocol):
    """Takes a refusal for the end of the handshake: by itself the server logs it as an error of the application."""

    async def send(self, message: Any) -> None:
        """Send what the application says."""
        await super().send(message)
        is_refused = self.initial_response is not None and self.close_sent
        self.handshake_complete = self.handshake_complete or is_refused
