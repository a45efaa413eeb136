"""A start that is refused says why in one line; a traceback is for defects."""

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from db.errors import DatabaseError
from service.domain.access.keys import NoKeys

REFUSALS = (DatabaseError, NoKeys, OSError)
"""What the one who starts the service can mend; the message says how."""


class StartRefusal:
    """Puts the message of the error that ended the start (``app.state.start_error``) in place of its traceback."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection, or the start and end of the application."""
        await self.app(scope, receive, _shortened(scope, send) if scope["type"] == "lifespan" else send)


def _shortened(scope: Scope, send: Send) -> Send:
    async def send_short(message: Message) -> None:
        error = getattr(scope["app"].state, "start_error", None)
        if message["type"] == "lifespan.startup.failed" and isinstance(error, REFUSALS):
            message = {**message, "message": str(error)}
        await send(message)

    return send_short
