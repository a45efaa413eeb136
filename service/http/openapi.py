"""The application's own description, OpenAPI."""

import json
from collections.abc import Iterable
from functools import cached_property
from typing import Any

from fastapi import APIRouter, FastAPI, Request, Response
from fastapi.routing import APIRoute
from starlette.routing import BaseRoute

from service.http.descriptions import description_of
from service.http.problems import (
    BAD_REQUEST,
    HEADERS_TOO_LARGE,
    INSUFFICIENT_SCOPE,
    INVALID_KEY,
    KEY_REQUIRED,
    MEDIA_TYPE,
    MISDIRECTED_REQUEST,
    REQUEST_TIMEOUT,
    STOPPING,
    TOO_MANY_CONNECTIONS,
    TOO_MANY_REQUESTS,
    ProblemType,
)

OF_EVERY_ROUTE = (BAD_REQUEST, HEADERS_TOO_LARGE, STOPPING, TOO_MANY_CONNECTIONS)
"""Problems of every route, before it is known what is asked."""

OF_PROTECTED_ROUTES = (KEY_REQUIRED, INVALID_KEY, INSUFFICIENT_SCOPE, MISDIRECTED_REQUEST, TOO_MANY_REQUESTS)
"""Problems of every route that needs a key."""


class DescribedApp(FastAPI):
    """An application whose description says of every error that it is answered as problem details.

    The framework would say JSON of its own. The description is made when it is first asked for.
    """

    def take(self, router: APIRouter) -> None:
        """Answer the routes of a module as they are: ``include_router`` would build them anew for each application."""
        self.router.routes.extend(router.routes)

    def setup(self) -> None:
        """Answer the description, which is written once: anybody may ask for it, and it is long."""

        async def describe(_: Request) -> Response:
            return Response(self._written, media_type="application/json")

        self.add_route("/openapi.json", describe, include_in_schema=False)

    @cached_property
    def _written(self) -> bytes:
        return json.dumps(self.openapi(), ensure_ascii=False, separators=(",", ":")).encode()

    def openapi(self) -> dict[str, Any]:
        """The description of all routes."""
        if self.openapi_schema is None:
            description = super().openapi()
            _name_operations(description, self.routes)
            _describe_problems(description)
        assert self.openapi_schema is not None
        return self.openapi_schema


def _name_operations(description: dict[str, Any], routes: Iterable[BaseRoute]) -> None:
    """The route's function names the operation, and so the functions of generated clients."""
    for route in routes:
        if isinstance(route, APIRoute) and route.include_in_schema:
            for method in route.methods or ():
                description["paths"][route.path_format][method.lower()]["operationId"] = route.name


def _describe_problems(description: dict[str, Any]) -> None:
    for operations in description["paths"].values():
        for operation in operations.values():
            kinds = OF_EVERY_ROUTE + (OF_PROTECTED_ROUTES if "security" in operation else ())
            kinds += (REQUEST_TIMEOUT,) if "requestBody" in operation else ()
            operation["responses"] = _described(*kinds) | operation["responses"]
            for status, response in operation["responses"].items():
                if int(status) >= 400:
                    response["content"] = {MEDIA_TYPE: response["content"].pop("application/json")}
    for name in ("HTTPValidationError", "ValidationError"):
        description["components"]["schemas"].pop(name, None)


def _described(*kinds: ProblemType) -> dict[str, Any]:
    schema = {"application/json": {"schema": {"$ref": "#/components/schemas/ProblemOut"}}}
    texts = description_of(*kinds)
    return {str(status): {"description": text, "content": dict(schema)} for status, text in texts.items()}
