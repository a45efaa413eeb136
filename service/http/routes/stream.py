"""The live stream."""

from typing import Any

from fastapi import APIRouter, WebSocket

from db.blobs import Spool
from service.domain.uploads.upload import UploadRequest, store_made
from service.formats.reading import Description
from service.http.access import UPLOAD, principal
from service.http.context import ServerContext
from service.http.schemas.grasp_logs import GraspLogOut
from service.stream import connection

router = APIRouter()


@router.websocket("/v1/stream", dependencies=[UPLOAD])
async def live_stream(socket: WebSocket) -> None:
    """Frames in, slip states out (docs/stream.md)."""
    context: ServerContext = socket.app.state.context
    await socket.accept()

    def store(spool: Spool, found: Description, request: UploadRequest) -> dict[str, Any]:
        return GraspLogOut.of(store_made(context, spool, found, request).log).model_dump(mode="json")

    await connection.serve(socket, context, context.streams, await principal(socket), store)
