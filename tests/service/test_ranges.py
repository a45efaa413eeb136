"""Ranges of numbers in words, wherever in a schema they stand."""

from typing import Annotated, Any, Literal

import pytest
from pydantic import BaseModel, Field, TypeAdapter

from service.ranges import range_at, range_in_words


class Press(BaseModel):
    force: Annotated[float, Field(ge=0.0, le=1e4)] | None = None


class Round(BaseModel):
    kind: Literal["round"]
    radius: Annotated[float, Field(gt=1e-9, lt=1.0)]


class Asked(BaseModel):
    presses: list[Press]
    shape: Annotated[Round | Press, Field()]
    times: list[Annotated[int, Field(ge=1, lt=2**32)]]
    either: Annotated[int, Field(ge=0, le=1)] | Annotated[float, Field(ge=2.0, le=3.0)]
    least: Annotated[float, Field(ge=0.0)]
    name: str


@pytest.mark.parametrize(
    ("path", "told"),
    [
        (("presses", 3, "force"), "a number, 0 to 10000"),
        (("shape", "Round", "radius"), "a number, above 1e-9 to below 1"),
        (("times", 0), "a whole number, 1 to below 4294967296"),
        (("either",), None),
        (("least",), None),
        (("name",), None),
        (("unknown",), None),
        ((), None),
    ],
)
def test_a_number_s_range_is_found_where_it_stands(path: tuple[str | int, ...], told: str | None) -> None:
    assert range_at(TypeAdapter(Asked).json_schema(), path) == told


@pytest.mark.parametrize(
    ("low", "high", "told"),
    [
        (0.5, 600.0, "0.5 to 600"),
        (1e-12, 0.999999999999, "1e-12 to 0.999999999999"),
        (-1e9, 1e9, "-1e9 to 1e9"),
        (67108864, 2**50, "67108864 to 1125899906842624"),
    ],
)
def test_numbers_are_told_in_short_and_without_loss(low: Any, high: Any, told: str) -> None:
    assert range_in_words({"minimum": low, "maximum": high}) == f"a number, {told}"
