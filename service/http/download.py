"""Files as answers, whole or in the ranges that are asked for."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fastapi import Request
from fastapi.responses import FileResponse
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.types import Message, Receive, Scope, Send

IS_HEAD = "stiction.is_head"
"""Key in the scope of a HEAD request that is handed on as GET (``middleware.head_requests``)."""

CHECKED_SECONDS = 60.0
"""s after which a file of which parts are asked for is compared with its hash anew."""


def checked_within(request: Request) -> float:
    """How many seconds ago a stored file may have been compared with its hash: a whole one is each time it is sent."""
    return CHECKED_SECONDS if "range" in request.headers or request.scope.get(IS_HEAD) else 0.0


class Download(FileResponse):
    """A file and its parts; ``close`` is called at the end, however that comes.

    A header Range that says nothing of bytes is ignored (RFC 9110, 14.2). One that cannot be met (416), or that ends
    before it begins (400), raises ``HTTPException``: by itself it is plain text.
    """

    def __init__(self, path: Path, close: Callable[[], None], **options: Any) -> None:
        super().__init__(path, **options)
        self._close = close

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the file."""

        async def send_unless_refused(message: Message) -> None:
            if message["type"] == "http.response.start" and message["status"] in REFUSALS:
                headers = {name.decode(): value.decode() for name, value in message["headers"]}
                kept = {name: value for name, value in headers.items() if name == "content-range"}
                raise HTTPException(message["status"], REFUSALS[message["status"]], kept)
            await send(message)

        understood = [
            (name, value)
            for name, value in scope["headers"]
            if name != b"range" or RANGE.fullmatch(value.decode("latin-1"))
        ]
        try:
            method = "HEAD" if scope.get(IS_HEAD) else scope["method"]  # of which nothing is read
            await super().__call__({**scope, "method": method, "headers": understood}, receive, send_unless_refused)
        finally:
            await run_in_threadpool(self._close)


RANGE = re.compile(r"bytes=[ \t]*(?:[0-9]+-[0-9]*|-[0-9]+)(?:[ \t]*,[ \t]*(?:[0-9]+-[0-9]*|-[0-9]+))*", re.IGNORECASE)
"""What a header Range says of bytes (RFC 9110, 14.1.1)."""

REFUSALS = {
    400: "the header Range ends before it begins; allowed: such as bytes=0-1023",
    416: "the header Range begins behind the end of the file; allowed: within its length",
}
"""Why a Range is refused, by the answer's status."""
