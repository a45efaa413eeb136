"""Ranges of numbers in words, both ends, as a JSON schema has them."""

from collections.abc import Iterator, Mapping
from typing import Any

Schema = Mapping[str, Any]


def range_in_words(number: Schema) -> str | None:
    """What a number of this schema may be; None where it has not both ends."""
    low = _end(number, "minimum", "exclusiveMinimum", "above ")
    high = _end(number, "maximum", "exclusiveMaximum", "below ")
    whole = "whole " if number.get("type") == "integer" else ""
    return None if low is None or high is None else f"a {whole}number, {low} to {high}"


def range_at(schema: Schema, path: tuple[str | int, ...]) -> str | None:
    """The range of the number at a path of names and places in what has this schema; None where it has no one range."""
    found = [schema]
    for part in path:
        found = [inner for each in found for inner in _inside(schema, each, part)] or found  # else a choice's own name
    ranges = {told for each in found for variant in _variants(schema, each) if (told := range_in_words(variant))}
    return ranges.pop() if len(ranges) == 1 else None


def _inside(root: Schema, schema: Schema, part: str | int) -> Iterator[Schema]:
    for variant in _variants(root, schema):
        inner = variant.get("items") if isinstance(part, int) else variant.get("properties", {}).get(part)
        if inner is not None:
            yield inner


def _variants(root: Schema, schema: Schema) -> Iterator[Schema]:
    """A schema's alternatives, with names looked up."""
    if "$ref" in schema:
        yield from _variants(root, root["$defs"][schema["$ref"].rpartition("/")[2]])
    elif alternatives := schema.get("anyOf") or schema.get("oneOf"):
        for each in alternatives:
            yield from _variants(root, each)
    else:
        yield schema


def _end(number: Schema, included: str, excluded: str, word: str) -> str | None:
    if included in number:
        return _short(number[included])
    return f"{word}{_short(number[excluded])}" if excluded in number else None


def _short(number: float) -> str:
    """Such as 0.5, 65535 and 1e-9, without loss."""
    short, _, power = f"{number:g}".partition("e")
    short += f"e{int(power)}" if power else ""
    return short if float(short) == number and isinstance(number, float) else str(number)
