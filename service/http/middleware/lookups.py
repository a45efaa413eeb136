"""The shortest way to a look-up: what planners ask most often, answered from memory before all other layers."""

import re
import time
from dataclasses import dataclass
from functools import lru_cache
from types import SimpleNamespace
from urllib.parse import parse_qsl

from fastapi import Response
from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Receive, Scope, Send

from db.errors import NotFound, StorageUnavailable
from service.domain.errors import NoModel
from service.domain.models.model_cache import KnownModel
from service.domain.planning.look_up import FrictionQuery, look_up
from service.domain.resources.context import Context
from service.http.conditional import is_one_of, unchanged, whole
from service.http.middleware.authentication import Authenticator
from service.http.middleware.request_middleware import (
    Headers,
    id_header,
    request_id_of,
    size_of_headers,
    with_common_headers,
)
from service.http.parameters import numbers_among, wrong_parameter
from service.http.schemas.models import FrictionOut, LookUpQuery
from service.observability import traces
from service.observability.access_log import AccessLog

MOST_RESPONSES = 10_000
"""Answers kept of all models together, 3 kB each: planners ask the same again and again. When there are more, all are
made anew."""

LONGEST_HEADERS = 4096
"""Bytes; who sends more waits for a turn, as for all else: reading them takes longer than the look-up."""

LONGEST_QUERY = 200
"""Bytes; what is longer is no question that many ask, and is not remembered."""

ROUTE = SimpleNamespace(path="/v1/materials/{name}/friction")
"""Under which the look-ups are counted, as those that the route itself answers."""

_PARAMETERS = numbers_among((name, field.annotation) for name, field in LookUpQuery.model_fields.items())

_PATH = re.compile(r"/v1/materials/([A-Za-z0-9][A-Za-z0-9 ._-]{0,99})/friction")


@dataclass(frozen=True, slots=True)
class CachedResponse:
    """What is sent but for the request's id: status, headers and body."""

    status: int
    headers: Headers
    body: bytes

    @classmethod
    def of(cls, response: Response, scope: Scope) -> "CachedResponse":
        """A response with the headers that every one has."""
        return cls(
            response.status_code,
            with_common_headers(response.raw_headers, scope),
            bytes(response.body),
        )


class Lookups:
    """Answers a well-formed look-up of a model that is or was in memory; hands all else on to the route, which says
    the same.

    Who asks is admitted, counted and logged as by the layers that are passed over. When a model has changed all who
    ask for it wait for one reading; each through the route, they would keep everybody waiting for ten times as long.
    """

    def __init__(self, app: ASGIApp, authenticator: Authenticator, access_log: AccessLog) -> None:
        self.app = app
        self._authenticator, self._access_log = authenticator, access_log
        self._kept: dict[tuple[str, bytes | None, str], CachedResponse] = {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        begin = time.perf_counter()
        answer = await self._answer(scope) if scope["type"] == "http" and scope["method"] == "GET" else None
        if answer is None:
            await self.app(scope, receive, send)
            return
        request_id = request_id_of(scope)
        headers = [id_header(request_id), *answer.headers]
        await send({"type": "http.response.start", "status": answer.status, "headers": headers})
        await send({"type": "http.response.body", "body": answer.body})
        self._access_log.record("GET", ROUTE.path, answer.status, time.perf_counter() - begin, request_id)

    async def _answer(self, scope: Scope) -> CachedResponse | None:
        found = _PATH.fullmatch(scope["path"])
        asked = _read(scope["query_string"]) if found and len(scope["query_string"]) <= LONGEST_QUERY else None
        if found is None or asked is None or size_of_headers(scope) > LONGEST_HEADERS:
            return None
        connection, (method, question) = HTTPConnection(scope), asked
        known = await self._model(connection, found[1], method)
        if known is None or not self._authenticator.allows_at_once(connection):
            return None
        traces.name_request("GET", ROUTE.path)
        listed = connection.headers.get("if-none-match")
        has_it = listed is not None and is_one_of(known.tag, listed)
        return self._kept_or_made(known, None if has_it else question, scope)

    async def _model(self, connection: HTTPConnection, material: str, method: str) -> KnownModel | None:
        """The model, read anew where it has to be; None where that is not ours to do, or fails."""
        context: Context = connection.app.state.context
        models = context.models
        if models.fresh(material, method) is None and (
            not models.has_known(material, method) or self._authenticator.known(connection) is None
        ):
            return None
        try:
            return await models.get(context.database, material, method)
        except (NotFound, NoModel, StorageUnavailable):
            return None

    def _kept_or_made(self, known: KnownModel, question: FrictionQuery | None, scope: Scope) -> CachedResponse:
        """The answer to a question, made where nobody asked it yet so; without one, to who has the answer already."""
        key = known.tag, None if question is None else scope["query_string"], scope["scheme"]
        answer = self._kept.get(key)
        if answer is None:
            if question is None:
                response = unchanged(known.tag)
            else:
                response = whole(known.tag, FrictionOut.json_of(look_up(known, question)))
            if len(self._kept) >= MOST_RESPONSES:
                self._kept.clear()
            answer = self._kept[key] = CachedResponse.of(response, scope)
        return answer


@lru_cache(maxsize=4096)
def _read(query: bytes) -> tuple[str, FrictionQuery] | None:
    """Method and question of a query, None for one that has to be refused."""
    if b"%00" in query:
        return None
    try:
        given = parse_qsl(query.decode("latin-1"), keep_blank_values=True)
        asked = LookUpQuery.model_validate(dict(given))
    except ValueError:  # pydantic's, or of the address
        return None
    if wrong_parameter(given, _PARAMETERS) is not None:
        return None
    return asked.method, asked.question()
