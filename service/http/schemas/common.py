"""What the schemas of several resources share: text, names, numbers and the base of request bodies."""

from typing import Annotated

from fastapi import Query
from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from db.text import is_storable

NAME_PATTERN = r"^[A-Za-z0-9]([A-Za-z0-9 ._-]{0,98}[A-Za-z0-9._-])?$"
"""A space at an end nobody sees: two materials would seem to have one name."""
MOMENT_EXAMPLE = "2026-11-21T08:41:00.123456Z"

MOST = 1000
"""Entries of one answer: a megabyte of materials with their models."""

USUAL = 100
Limit = Annotated[int, Query(ge=1, le=MOST, description="How many entries at most")]
CursorText = Annotated[
    str | None, Query(max_length=1000, description="Where to go on: `next` of the answer before, asked the same way")
]

LARGEST_FORCE, LARGEST_VELOCITY = 1e4, 1e3
"""N on one element, as of an uploaded log, and m/s: beyond, a question is a mistake of units."""


def _storable(text: str) -> str:
    if not is_storable(text):
        raise ValueError("text without NUL and lone surrogates")
    return text


NAME_RULE = "1 to 100 letters, digits, spaces and `._-`, of which the first is a letter or digit and the last no space."
Name = Annotated[str, Field(pattern=NAME_PATTERN, description=NAME_RULE)]
Text = Annotated[str, Field(max_length=10_000), AfterValidator(_storable)]
Reason = Annotated[str, Field(min_length=1, max_length=1_000), AfterValidator(_storable)]
"""Why a log counts no more: kept with the log and in the audit trail. Those from before may be longer."""

Reference = Annotated[str, AfterValidator(_storable)]
"""The name or id of what may be stored."""

Velocity = Annotated[float, Field(ge=0.0, le=LARGEST_VELOCITY, allow_inf_nan=False)]
Force = Annotated[float, Field(ge=0.0, le=LARGEST_FORCE, allow_inf_nan=False)]
Area = Annotated[float, Field(gt=1e-12, le=1.0, allow_inf_nan=False, description="m²")]
Next = Annotated[str | None, Field(description="The `cursor` of what comes after these; null at the end")]


class Body(BaseModel):
    """What a request may say: known fields only, and of their own types: neither ``true`` nor ``"1"`` is a number."""

    model_config = ConfigDict(extra="forbid", strict=True)
