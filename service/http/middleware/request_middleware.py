"""What surrounds every request: its id, the bounds of what is read of it, and the headers of its answer."""

import asyncio
import os
import re
import time
from collections.abc import Mapping
from itertools import chain

from fastapi import Request
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.http import problems
from service.http.problems import BAD_REQUEST, HEADERS_TOO_LARGE, Problem
from service.observability.logs import ABOUT

MOST_HEADER_BYTES = 16 * 1024
"""Of one request; what servers usually take."""

BODY_SECONDS, SLOWEST_BODY = 20.0, 10_000.0
"""s that a client may keep us waiting for its body, and bytes that earn it another second."""

NOTHING = "default-src 'none'; frame-ancestors 'none'; base-uri 'none'"
"""Content security policy of what is no page of the dashboard: each of these says what it needs."""

OF_ALL = ((b"x-content-type-options", b"nosniff"), (b"cache-control", b"no-store"))
OF_TLS = (b"strict-transport-security", b"max-age=31536000")

Headers = list[tuple[bytes, bytes]]

_ID = re.compile(rb"[A-Za-z0-9._-]{1,128}")


class RequestMiddleware:
    """Gives each request an id, bounds its headers and the patience with its body, and completes its answer's headers.

    An error that nothing else answers is answered here.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        request_id = request_id_of(scope)
        scope.setdefault("state", {})["request_id"] = request_id
        token = ABOUT.set({"request_id": request_id})
        try:
            await self._serve(scope, receive, _HeaderSender(scope, send, request_id))
        finally:
            ABOUT.reset(token)

    async def _serve(self, scope: Scope, receive: Receive, send: "_HeaderSender") -> None:
        try:
            _check(scope)
            await self.app(scope, _Receiver(receive).receive, send)
        except Problem as problem:
            await problems.problem_response(Request(scope), problem)(scope, receive, send)
        except asyncio.CancelledError:  # the server waits for its requests no longer
            if send.has_begun:
                raise
            await problems.problem_response(Request(scope), problems.stopping())(scope, receive, send)
        except Exception as error:
            answer = problems.unexpected(Request(scope), error)
            if send.has_begun:
                raise
            await answer(scope, receive, send)


class _HeaderSender:
    """Sends an answer with the headers that every one has, unless it says something else itself."""

    def __init__(self, scope: Scope, send: Send, request_id: str) -> None:
        self.has_begun = False
        self._scope, self._send, self._request_id = scope, send, request_id

    async def __call__(self, message: Message) -> None:
        if message["type"] == "http.response.start":
            self.has_begun = True
            headers_sent = with_common_headers(message["headers"], self._scope)
            message = {**message, "headers": [id_header(self._request_id), *headers_sent]}
        await self._send(message)


class _Receiver:
    """Receives a body, and loses patience with one that comes too slowly."""

    def __init__(self, receive: Receive) -> None:
        self._receive = receive
        self._left = BODY_SECONDS
        self._is_whole = False

    async def receive(self) -> Message:
        """The next message; raises ``HTTPException`` where it does not come in time."""
        if self._is_whole:  # what comes now is the end of the connection, which may take its time
            return await self._receive()
        began = time.monotonic()
        try:
            async with asyncio.timeout(self._left):
                message = await self._receive()
        except TimeoutError as error:
            raise HTTPException(408, "the body came too slowly", {"Connection": "close"}) from error
        self._left += len(message.get("body", b"")) / SLOWEST_BODY - (time.monotonic() - began)
        self._is_whole = not message.get("more_body", False)
        return message


def with_common_headers(headers: Headers, scope: Scope) -> Headers:
    """The headers of an answer, and those that every one has, unless it says something else itself."""
    headers_sent = dict(headers)
    return [*headers, *(header for header in _usual(scope, headers_sent) if header[0] not in headers_sent)]


def id_header(request_id: str) -> tuple[bytes, bytes]:
    """The header by which an answer gives the id of its request."""
    return b"x-request-id", request_id.encode()


def _usual(scope: Scope, headers_sent: Mapping[bytes, bytes]) -> Headers:
    usual = [*OF_ALL]
    if scope["scheme"] == "https":
        usual.append(OF_TLS)
    if headers_sent.get(b"content-type", b"").startswith(b"text/html"):
        usual += (b"referrer-policy", b"no-referrer"), (b"content-security-policy", NOTHING.encode())
    return usual


def size_of_headers(scope: Scope) -> int:
    """Bytes of their names and values."""
    return sum(map(len, chain.from_iterable(scope["headers"])))


def request_id_of(scope: Scope) -> str:
    """The id that the client gave, if it is one that may stand in a log and a header."""
    given = next((value for name, value in scope["headers"] if name == b"x-request-id"), b"")
    return given.decode() if _ID.fullmatch(given) else os.urandom(16).hex()


def _check(scope: Scope) -> None:
    size = size_of_headers(scope)
    if size > MOST_HEADER_BYTES:
        raise Problem.wrong_value(HEADERS_TOO_LARGE, "headers", f"{size} bytes", f"at most {MOST_HEADER_BYTES} bytes")
    if "\0" in scope["path"] or b"%00" in scope["query_string"]:
        raise Problem.wrong_value(BAD_REQUEST, "address", "one with a NUL character", "text")
