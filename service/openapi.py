"""The application's own description, OpenAPI."""

from typing import Any

from fastapi import FastAPI
from fastapi.routing import APIRoute

from service.problems import INSUFFICIENT_SCOPE, INVALID_KEY, KEY_REQUIRED, MEDIA_TYPE
from service.routes.common import description_of

AT_THE_GATE = (KEY_REQUIRED, INVALID_KEY, INSUFFICIENT_SCOPE)
"""Problems of every route that needs a key."""


def operation_id(route: APIRoute) -> str:
    """The route's function names the operation, and so the functions of generated clients."""
    return route.name


def describe_problems(app: FastAPI) -> None:
    """Say of every error that it is answered as problem details: the framework would say JSON of its own.

    To be called once all routes are there; the description is made once and kept.
    """
    description = app.openapi()
    for operations in description["paths"].values():
        for operation in operations.values():
            if "security" in operation:
                operation["responses"] |= _turned_away()
            for status, response in operation["responses"].items():
                if int(status) >= 400:
                    response["content"] = {MEDIA_TYPE: response["content"].pop("application/json")}
    for name in ("HTTPValidationError", "ValidationError"):
        description["components"]["schemas"].pop(name, None)


def _turned_away() -> dict[str, Any]:
    schema = {"application/json": {"schema": {"$ref": "#/components/schemas/ProblemOut"}}}
    described = description_of(*AT_THE_GATE)
    return {str(status): {"description": text, "content": dict(schema)} for status, text in described.items()}
