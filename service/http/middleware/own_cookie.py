"""Of a browser's cookies none but the service's own is read; whatever else they hold costs nothing."""

import re

from starlette.types import ASGIApp, Receive, Scope, Send

from service.http.sessions import COOKIE

_OWN = re.compile(rb"(?:^|;)[ \t]*(" + COOKIE.encode() + rb"=[A-Za-z0-9_-]{1,64})[ \t]*(?=;|$)")


class OwnCookie:
    """Hands on a session's cookie alone.

    The framework parses all of them for each request, in seconds where they hold many escaped quotes (CVE-2024-7592).
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection, or the start and end of the application."""
        headers = scope.get("headers", ())
        if any(name == b"cookie" for name, _ in headers):
            scope = {**scope, "headers": _with_own_cookie(headers)}
        await self.app(scope, receive, send)


def _with_own_cookie(headers: list[tuple[bytes, bytes]]) -> list[tuple[bytes, bytes]]:
    sent = b";".join(value for name, value in headers if name == b"cookie")
    others = [header for header in headers if header[0] != b"cookie"]
    own = _OWN.search(sent)
    return others if own is None else [*others, (b"cookie", own[1])]
