"""Problems as pages: what a program is told as JSON, a browser that asks for a page is shown as one.

Nothing changes for the API's paths, nor for who does not say that it takes HTML. Who lacks a key is led to the login.
"""

import json
from typing import Any
from urllib.parse import quote

from fastapi import Request
from fastapi.responses import RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.http.middleware.request_middleware import with_common_headers
from service.http.problems import MEDIA_TYPE
from service.web.rendering import render

KEPT_HEADERS = frozenset({b"retry-after", b"www-authenticate", b"allow", b"x-request-id"})
"""What a page says as the JSON would have."""

API_FOLDER = "/v1/"
API_PATHS = frozenset({"/healthz", "/readyz", "/metrics", "/openapi.json"})


class ProblemPages:
    """Puts a page in the place of a problem's JSON."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        if not _wants_page(scope):
            await self.app(scope, receive, send)
            return
        scope.setdefault("state", {})  # which those inside share
        await self.app(scope, receive, _PageSender(scope, receive, send))


class _PageSender:
    """Keeps a problem back until it is whole, then sends the page of it; hands all else on."""

    def __init__(self, scope: Scope, receive: Receive, send: Send) -> None:
        self._scope, self._receive, self._send = scope, receive, send
        self._start: Message | None = None
        self._body = b""

    async def __call__(self, message: Message) -> None:
        if message["type"] == "http.response.start" and _is_problem(message):
            self._start = message
            return
        if self._start is None:
            await self._send(message)
            return
        self._body += message.get("body", b"")
        if not message.get("more_body", False):
            page = _page(Request(self._scope), self._start["status"], json.loads(self._body))
            kept = [each for each in self._start["headers"] if each[0] in KEPT_HEADERS]
            page.raw_headers[:] = with_common_headers([*page.raw_headers, *kept], self._scope)
            await page(self._scope, self._receive, self._send)


def _wants_page(scope: Scope) -> bool:
    if scope["type"] != "http" or scope["method"] not in {"GET", "POST"}:
        return False
    path = scope["path"]
    if path.startswith(API_FOLDER) or path in API_PATHS:
        return False
    return any(name == b"accept" and b"text/html" in value for name, value in scope["headers"])


def _is_problem(message: Message) -> bool:
    return any(name == b"content-type" and value.startswith(MEDIA_TYPE.encode()) for name, value in message["headers"])


def _page(request: Request, status: int, problem: dict[str, Any]) -> Response:
    if status == 401 and request.method == "GET":
        asked = request.url.path + (f"?{request.url.query}" if request.url.query else "")
        return RedirectResponse(f"/login?next={quote(asked, safe='')}", 303)
    template, given = getattr(request.state, "on_problem", ("problem.html", {}))
    return render(request, template, status, problem=problem, **given)
