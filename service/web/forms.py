"""What forms send: text for everything, and nothing for what was left empty."""

from collections.abc import Callable, Coroutine, Mapping
from typing import Any, TypeVar

from fastapi import Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.routing import APIRoute
from pydantic import BaseModel, BeforeValidator, ValidationError

from service.http.routes.common import limited

MOST_FORM_BYTES = 2**18
"""Of a form without a file; the longest description takes half of that."""

Shape = TypeVar("Shape", bound=BaseModel)

EMPTY_IS_NONE = BeforeValidator(lambda text: None if text == "" else text)
"""Of a field that may be left empty."""


class FormRoute(APIRoute):
    """A route whose form is of bounded size: the framework parses all of it before it is asked who sends it."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """The handler, which receives no more than a form may have."""
        handle = super().get_route_handler()

        async def handle_form(request: Request) -> Response:
            return await handle(Request(request.scope, limited(request.receive, MOST_FORM_BYTES)))

        return handle_form


def checked(shape: type[Shape], fields: Mapping[str, str]) -> Shape:
    """What was sent, in the API's own shape and bounds; raises ``RequestValidationError``."""
    try:
        return shape.model_validate_strings({name: text for name, text in fields.items() if text != ""})
    except ValidationError as error:
        wrong = [{**each, "loc": ("form", *each["loc"])} for each in error.errors()]
        raise RequestValidationError(wrong) from error
