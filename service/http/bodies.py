"""Bodies of requests: read as they come, and of bounded size."""

import codecs
import json
import re
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import AsyncExitStack
from typing import Any

import msgspec
from fastapi import Request, Response
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.types import Message, Receive, Scope

from service.domain.resources.receive import unless_gone
from service.http.access import principal
from service.http.context import ServerContext
from service.http.fair_route import FairRoute, gone
from service.http.problems import UNSUPPORTED_FORMAT, Problem
from service.json_objects import RepeatedKey, unique

MOST_FIELDS = 100
"""Of an object in a body, or of a form; those that are known have two dozen at most."""

MOST_FIELDS_TOGETHER = 500
"""Of all objects in a body; a calibration's presses have 64 at most. Each that is unknown is an error apart."""

MAX_JSON_BYTES = 64 * 1024
"""Bytes of a JSON body; the longest description is 10,000 characters."""

SHORT_JSON_BYTES = 4096
"""Parsed without a turn, in 0.3 ms at most."""

STRING = re.compile(rb'"(?:[^"\\]|\\.)*"', re.DOTALL)
"""What is left of JSON without these has a colon a field."""


def media_type(request: Request) -> str:
    """What the body is said to be, without parameters and in lower case (RFC 9110, 8.3.1)."""
    return request.headers.get("content-type", "").partition(";")[0].strip().lower()


async def chunks(request: Request) -> AsyncIterator[bytes]:
    """The body as it comes; raises ``ConnectionError`` where the client goes before its end."""
    try:
        async for chunk in request.stream():
            yield chunk
    except ClientDisconnect as error:
        raise ConnectionError("the client has closed its connection") from error


class _JsonRequest(Request):
    """A request whose long body is parsed in a turn until ``held`` ends: parsed it takes 20 times its bytes."""

    def __init__(self, scope: Scope, receive: Receive, held: AsyncExitStack) -> None:
        super().__init__(scope, receive)
        self._held = held

    async def json(self) -> Any:
        """The body; raises ``HTTPException`` for objects of more fields than any has: each would be an error apart."""
        body = await self.body()
        _check_encoding(body)
        if len(body) <= SHORT_JSON_BYTES:
            return json.loads(body, object_pairs_hook=_few_fields)
        context: ServerContext = self.app.state.context
        share = (await principal(self)).share
        async with unless_gone(gone(self)):
            await self._held.enter_async_context(context.long_bodies.turn(share))
        return await context.threads.run(share, _parse_long, body, is_long=True)


def _check_encoding(body: bytes) -> None:
    """Raises ``JSONDecodeError`` for any but UTF-8 without a byte order mark (RFC 8259, 8.1).

    The parser of short bodies takes UTF-16 and UTF-32 as well, that of long ones does not.
    """
    if body.startswith(codecs.BOM_UTF8) or b"\0" in body or not is_utf_8(body):
        raise json.JSONDecodeError("another encoding than UTF-8 without a byte order mark", "", 0)


def is_utf_8(body: bytes) -> bool:
    """Whether bytes are text."""
    try:
        body.decode()
    except UnicodeDecodeError:
        return False
    return True


def _few_fields(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    if len(pairs) > MOST_FIELDS:
        raise HTTPException(400, f"an object of the body has more than {MOST_FIELDS} fields")
    try:
        return unique(pairs)
    except RepeatedKey as error:
        raise HTTPException(400, f"an object of the body has the field {error.key} more than once") from error


def _parse_long(body: bytes) -> Any:
    """The same in a quarter of the time, in which no other thread goes on."""
    try:
        parsed = msgspec.json.decode(body)
    except msgspec.DecodeError as error:
        raise json.JSONDecodeError(str(error), "", 0) from error
    if isinstance(parsed, (dict, list)) and _check_fields(parsed) < STRING.sub(b"", body).count(b":"):
        json.loads(body, object_pairs_hook=_few_fields)  # shows which field stands twice
    return parsed


def _check_fields(parsed: Any) -> int:
    """How many fields there are; raises as ``_few_fields`` does, and for too many in all objects of a body together."""
    waiting, count = [parsed], 0
    while waiting:
        each = waiting.pop()
        if isinstance(each, dict):
            count += len(_few_fields([*each.items()]))
            each = each.values()
        if count > MOST_FIELDS_TOGETHER:
            raise HTTPException(400, f"the objects of the body have more than {MOST_FIELDS_TOGETHER} fields together")
        waiting += [inner for inner in each if isinstance(inner, (dict, list))]
    return count


class JsonRoute(FairRoute):
    """A route whose body, if it takes one, is JSON of bounded size: the framework reads all of it into memory."""

    most_bytes = MAX_JSON_BYTES

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """The handler with the checks before it."""
        handle = super().get_route_handler()
        if self.body_field is None:
            return handle

        async def handle_json(request: Request) -> Response:
            if media_type(request) != "application/json":
                given = request.headers.get("content-type") or "missing"
                raise Problem.wrong_value(UNSUPPORTED_FORMAT, "content type", given, "application/json")
            packed = ", ".join(request.headers.getlist("content-encoding"))
            if packed.strip().lower() not in ("", "identity"):
                raise Problem.wrong_value(UNSUPPORTED_FORMAT, "content encoding", packed, "none: JSON comes unpacked")
            async with AsyncExitStack() as held:
                return await handle(_JsonRequest(request.scope, limited(request.receive, self.most_bytes), held))

        return handle_json


class LongJsonRoute(JsonRoute):
    """A route whose body may hold samples: some 40,000 of them."""

    most_bytes = 2**20


def limited(receive: Receive, most: int) -> Receive:
    """What receives a body, and raises ``HTTPException`` beyond so many bytes."""
    received = 0

    async def receive_some() -> Message:
        nonlocal received
        message = await receive()
        received += len(message.get("body", b""))
        if received > most:
            raise HTTPException(413, f"the body has more than {most} bytes")
        return message

    return receive_some
