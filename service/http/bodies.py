"""Bodies of requests: read as they come, and of bounded size."""

import json
from collections.abc import AsyncIterator, Callable, Coroutine
from functools import partial
from typing import Any

from fastapi import Request, Response
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.types import Message, Receive

from service.domain.context import Context
from service.http.access import principal
from service.http.fair_route import FairRoute
from service.http.problems import UNSUPPORTED_FORMAT, Problem

MOST_FIELDS = 100
"""Of an object in a body, or of a form; those that are known have two dozen at most."""

MAX_JSON_BYTES = 64 * 1024
"""Bytes of a JSON body; the longest description is 10,000 characters."""


async def chunks(request: Request) -> AsyncIterator[bytes]:
    """The body as it comes; raises ``ConnectionError`` where the client goes before its end."""
    try:
        async for chunk in request.stream():
            yield chunk
    except ClientDisconnect as error:
        raise ConnectionError("the client has closed its connection") from error


class _JsonRequest(Request):
    async def json(self) -> Any:
        """The body; raises ``HTTPException`` for objects of more fields than any has: each would be an error apart."""
        body, parse = await self.body(), partial(json.loads, object_pairs_hook=_few_fields)
        if len(body) <= MAX_JSON_BYTES:
            return parse(body)
        context: Context = self.app.state.context
        return await context.threads.run((await principal(self)).share, parse, body, is_long=True)


def _few_fields(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    if len(pairs) > MOST_FIELDS:
        raise HTTPException(400, f"an object of the body has more than {MOST_FIELDS} fields")
    return dict(pairs)


class JsonRoute(FairRoute):
    """A route whose body, if it takes one, is JSON of bounded size: the framework reads all of it into memory."""

    most_bytes = MAX_JSON_BYTES

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """The handler with the checks before it."""
        handle = super().get_route_handler()
        if self.body_field is None:
            return handle

        async def handle_json(request: Request) -> Response:
            given = request.headers.get("content-type", "")
            if given.partition(";")[0].strip().lower() != "application/json":
                raise Problem.wrong_value(UNSUPPORTED_FORMAT, "content type", given or "missing", "application/json")
            return await handle(_JsonRequest(request.scope, limited(request.receive, self.most_bytes)))

        return handle_json


class LongJsonRoute(JsonRoute):
    """A route whose body may hold samples: some 7,000 of them."""

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
