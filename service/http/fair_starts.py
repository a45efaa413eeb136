"""Requests begin in turns, so that whoever sends many at once keeps the others waiting little."""

import asyncio
import time

from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Receive, Scope, Send

from service.http.authentication import Authenticator
from service.processes.fair_queue import PatientQueue

START_SECONDS = 0.001
"""s between the starts of two requests of one client: so none has all of the time, nor two in a round of the loop."""

CLIENTS_AT_ONCE = 8
"""Whose next request waits for its time; those of further ones wait for these."""

MOST_CLIENTS = 10_000
"""Remembered; when there are more, all may begin anew."""


class FairStarts:
    """Lets one request or stream of a client begin in a round of the event loop; its others follow in later ones.

    What a request does before it waits for anything keeps everybody waiting, and for who has no key that is all that is
    done. A client is a key that was one before, or else an address.
    """

    def __init__(self, app: ASGIApp, authenticator: Authenticator) -> None:
        self.app = app
        self._client = authenticator.starts_as
        self._turns = PatientQueue(CLIENTS_AT_ONCE, "begun", share=1)
        self._next: dict[str, float] = {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        if scope["type"] != "lifespan":
            await self._start(self._client(HTTPConnection(scope)))
        await self.app(scope, receive, send)

    async def _start(self, client: str) -> None:
        async with self._turns.turn(client):
            seconds = self._next.get(client, 0.0) - time.monotonic()
            if seconds > 0.0:
                await asyncio.sleep(seconds)
            if len(self._next) >= MOST_CLIENTS:
                self._next.clear()
            self._next[client] = time.monotonic() + START_SECONDS
