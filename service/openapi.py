"""The application's own description, OpenAPI."""

from fastapi import FastAPI
from fastapi.routing import APIRoute

from service.problems import MEDIA_TYPE


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
            for status, response in operation["responses"].items():
                if int(status) >= 400:
                    response["content"] = {MEDIA_TYPE: response["content"].pop("application/json")}
    for name in ("HTTPValidationError", "ValidationError"):
        description["components"]["schemas"].pop(name, None)
