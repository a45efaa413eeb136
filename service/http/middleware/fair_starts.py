"""Requests begin in turns, so that whoever sends many at once keeps the others waiting little."""

import asyncio
import time
from collections.abc import Awaitable, Callable, Generator
from typing import Any, NamedTuple

from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Receive, Scope, Send

from service.http.middleware.authentication import Authenticator
from service.processes.fair_queue import UnboundedFairQueue

START_SECONDS = 0.001
"""s at least between the starts of two requests of one client, of which none then begins in the other's round."""

CLIENTS_AT_ONCE = 8
"""Whose next request waits for its time; those of further ones wait for these."""

MOST_CLIENTS = 10_000
"""Remembered; when there are more, all may begin anew."""


class FairStarts:
    """Lets one request or stream of a client begin in a round of the event loop; its others follow in later ones.

    What a request does before it waits for anything keeps everybody waiting, and for who has no key that is all that is
    done: the next one of the same client waits for as long again, so that others have half of the time. A client is a
    key that was one before, or else an address.
    """

    def __init__(self, app: ASGIApp, authenticator: Authenticator) -> None:
        self.app = app
        self._client = authenticator.starts_as
        self._turns = UnboundedFairQueue(CLIENTS_AT_ONCE, "begun", share=1)
        self._next: dict[str, float] = {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        async with self._turns.turn(client := self._client(HTTPConnection(scope))):
            await self._wait(client)
            began = time.monotonic()
            begun = _Begun(self.app(scope, receive, send))
            ended = time.monotonic()
            self._next[client] = ended + max(START_SECONDS, ended - began)
        await begun

    async def _wait(self, client: str) -> None:
        if (begins := self._next.get(client)) is not None:
            # without a second left, too: a round of the event loop may have lasted longer than the time to wait
            await asyncio.sleep(max(begins - time.monotonic(), 0.0))
        if len(self._next) >= MOST_CLIENTS:
            self._next.clear()


class _Begun(Awaitable[None]):
    """What is left of a request that ran to its first wait, or to its end, as this was made; its errors come then."""

    def __init__(self, request: Awaitable[None]) -> None:
        self._steps = request.__await__()
        self._first = self._step(next, self._steps)

    def __await__(self) -> Generator[Any, Any, None]:
        """Go on as if nothing had been run before."""
        step = self._first
        while not isinstance(step, _End):
            try:
                sent = yield step
            except BaseException as thrown:
                step = self._step(self._steps.throw, thrown)
            else:
                step = self._step(self._steps.send, sent)
        if step.error is not None:
            raise step.error

    @staticmethod
    def _step(run: Callable[[Any], Any], given: object) -> Any:
        """What the request waits for next, or its end."""
        try:
            return run(given)
        except StopIteration:
            return _End(None)
        except BaseException as error:
            return _End(error)


class _End(NamedTuple):
    """Of a request, by an ``error`` or without."""

    error: BaseException | None
