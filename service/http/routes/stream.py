"""The live stream."""

from typing import Any

from fastapi import APIRouter, WebSocket

from db.records import StoredGraspLog
from service.context import Context
from service.http.access import UPLOAD, asker
from service.http.schemas.grasp_logs import GraspLogOut
from service.stream import connection

router = APIRouter()


@router.websocket("/v1/stream", dependencies=[UPLOAD])
async def live_stream(socket: WebSocket) -> None:
    """Frames in, slip states out (docs/stream.md)."""
    context: Context = socket.app.state.context
    await socket.accept()
    await connection.serve(socket, context, await asker(socket), _as_json)


def _as_json(log: StoredGraspLog) -> dict[str, Any]:
    return GraspLogOut.of(log).model_dump(mode="json")
