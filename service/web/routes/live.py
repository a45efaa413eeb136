"""Live streams: which there are, and one of them as it goes on."""

from functools import partial

from fastapi import APIRouter, Request, Response, WebSocket
from starlette.exceptions import HTTPException

from service.http.access import READ, principal
from service.http.context import ServerContext
from service.http.middleware.authentication import Authenticator
from service.stream import watching
from service.web.rendering import render

router = APIRouter(include_in_schema=False)


@router.get("/live", dependencies=[READ])
async def list_streams(request: Request) -> Response:
    """The newest first."""
    context: ServerContext = request.app.state.context
    return render(request, "streams.html", sessions=context.streams.list_all())


@router.get("/live/{id}", dependencies=[READ])
async def show_stream(request: Request, id: str) -> Response:  # noqa: A002  (the path's own name)
    """One stream, whose frames come through ``watch_stream``; raises ``HTTPException``."""
    context: ServerContext = request.app.state.context
    session = context.streams.get(id)
    if session is None:
        raise HTTPException(404, "no such live stream; it may have ended, and is a grasp log now if it was stored")
    return render(request, "stream.html", session=session)


@router.websocket("/live/{id}/frames", dependencies=[READ])
async def watch_stream(socket: WebSocket, id: str) -> None:  # noqa: A002
    """The frames of a stream as they come (``service.stream.live_frame``)."""
    context: ServerContext = socket.app.state.context
    authenticator: Authenticator = socket.app.state.authenticator
    who = await principal(socket)
    await socket.accept()
    await watching.serve(socket, context.streams, id, who.share, partial(authenticator.still_admits, socket))
