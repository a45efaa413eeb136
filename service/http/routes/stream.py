"""The live stream."""

from fastapi import APIRouter, WebSocket

from service.context import Context
from service.http.access import UPLOAD, asker
from service.stream import connection

router = APIRouter()


@router.websocket("/v1/stream", dependencies=[UPLOAD])
async def live_stream(socket: WebSocket) -> None:
    """Frames in, slip states out (docs/stream.md)."""
    context: Context = socket.app.state.context
    await socket.accept()
    await connection.serve(socket, context, await asker(socket))
