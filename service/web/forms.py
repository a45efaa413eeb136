"""What forms send: text for everything, and nothing for what was left empty."""

from collections.abc import Mapping
from typing import TypeVar

from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, BeforeValidator, ValidationError

Shape = TypeVar("Shape", bound=BaseModel)

EMPTY_IS_NONE = BeforeValidator(lambda text: None if text == "" else text)
"""Of a field that may be left empty."""


def checked(shape: type[Shape], fields: Mapping[str, str]) -> Shape:
    """What was sent, in the API's own shape and bounds; raises ``RequestValidationError``."""
    try:
        return shape.model_validate_strings({name: text for name, text in fields.items() if text != ""})
    except ValidationError as error:
        wrong = [{**each, "loc": ("form", *each["loc"])} for each in error.errors()]
        raise RequestValidationError(wrong) from error
