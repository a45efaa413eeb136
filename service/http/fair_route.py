"""Routes that are answered in a thread: fairly, so that nobody's requests keep those of others waiting."""

from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import AsyncExitStack
from inspect import iscoroutinefunction
from typing import Any

from fastapi import Depends, Request, Response
from fastapi.params import Depends as Dependency
from fastapi.routing import APIRoute

from service.domain.resources.receive import unless_gone
from service.http.access import CurrentPrincipal
from service.http.dependencies import CurrentContext
from service.http.parameters import KNOWN_PARAMETERS, query_parameters, schema_of
from service.ranges import Schema


async def gone(request: Request) -> None:
    """Wait until the client has closed its connection; the body must have been read."""
    while (await request.receive())["type"] != "http.disconnect":
        pass


async def _turn(context: CurrentContext, principal: CurrentPrincipal, request: Request) -> AsyncIterator[None]:
    async with AsyncExitStack() as held:
        async with unless_gone(gone(request)):
            await held.enter_async_context(context.turns.turn(principal.share))
        yield


class FairRoute(APIRoute):
    """A route that, where a thread answers it, takes a turn before that, once its body is there and it may be asked.

    The turn ends with the making of the answer, however slowly that is read. A route that is a coroutine has its work
    done by ``Context.threads``. Who has gone gives up its place, here or there. A route of the REST API refuses
    ``parameters`` that it does not know.
    """

    def __init__(
        self, path: str, endpoint: Callable[..., Any], *, dependencies: list[Dependency] | None = None, **options: Any
    ) -> None:
        needed = [*(dependencies or ())]
        if path.startswith("/v1/"):
            needed.append(KNOWN_PARAMETERS)
        if not iscoroutinefunction(endpoint):
            needed.append(Depends(_turn, scope="function"))
        super().__init__(path, endpoint, dependencies=needed, **options)
        self.parameters = query_parameters(self)
        self._schemas: dict[str, Schema] = {}

    def schema_of(self, place: str) -> Schema:
        """The JSON schema of what the route takes in a place ("body", "query", "path"), made when it is asked for."""
        if place not in self._schemas:
            self._schemas[place] = schema_of(self, place)
        return self._schemas[place]

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """The handler, which of a coroutine without a body is given up once its client has gone."""
        handle = super().get_route_handler()
        if self.methods != {"GET"} or not iscoroutinefunction(self.endpoint):
            return handle

        async def handle_unless_gone(request: Request) -> Response:
            async with unless_gone(gone(request)):
                return await handle(request)

        return handle_unless_gone
