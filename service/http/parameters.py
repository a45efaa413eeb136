"""Parameters of addresses: those that a route knows, each once."""

from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from typing import Annotated, Any, get_args

from fastapi import Depends, Request
from fastapi.dependencies.utils import get_flat_params
from fastapi.params import Cookie, Header, Path
from fastapi.routing import APIRoute
from pydantic import TypeAdapter

from service.domain.errors import shown
from service.http.problems import INVALID_REQUEST, Problem
from service.ranges import Schema

ELSEWHERE = (Path, Header, Cookie)
"""What is no parameter of the address's query."""

LONGEST_SHOWN = 60
"""Characters of a parameter's name that are told."""


def wrong_parameter(given: Collection[tuple[str, str]], known: Mapping[str, bool]) -> Problem | None:
    """What is wrong with parameters of these names and values, where ``known`` are each taken once, and are numbers or
    not; None where nothing is.

    One that is passed over would change the answer without a word: ``quantil=0.05`` would be answered by the mean. So
    would a number in which a sign was lost: Python reads ``1_0`` as 10.
    """
    for name, times in Counter(name for name, _ in given).items():
        if name not in known:
            label = shown(name)[:LONGEST_SHOWN] or "a parameter without a name"
            return Problem.wrong_value(INVALID_REQUEST, label, "unknown", ", ".join(known) or "no parameters")
        if times > 1:
            return Problem.wrong_value(INVALID_REQUEST, name, f"given {times} times", "once")
    for name, value in given:
        if known[name] and "_" in value:
            return Problem.wrong_value(INVALID_REQUEST, name, value, "a number")
    return None


def numbers_among(fields: Iterable[tuple[str, Any]]) -> dict[str, bool]:
    """Of fields by name and type, which are numbers."""
    return {name: bool({int, float} & {kind, *_parts(kind)}) for name, kind in fields}


def query_parameters(route: APIRoute) -> dict[str, bool]:
    """Names of the parameters that a route takes in its address, and whether they are numbers."""
    taken = (each for each in get_flat_params(route.dependant) if not isinstance(each.field_info, ELSEWHERE))
    return numbers_among((each.alias, each.field_info.annotation) for each in taken)


def schema_of(route: APIRoute, place: str) -> Schema:
    """The JSON schema of a route's body, or of its parameters in a "path" or "query"; an empty one of what has none."""
    if place == "body":
        return {} if route.body_field is None else _schema(route.body_field.field_info.annotation)
    schema: dict[str, Any] = {"properties": {}, "$defs": {}}
    for field in {"path": route.dependant.path_params, "query": route.dependant.query_params}.get(place, ()):
        own = _schema(Annotated[field.field_info.annotation, field.field_info])
        schema["$defs"] |= own.get("$defs", {})
        schema["properties"] |= own.get("properties", {field.alias: own})  # a model of parameters has its own
    return schema


def _schema(kind: Any) -> dict[str, Any]:
    return TypeAdapter(kind).json_schema()


def _parts(kind: Any) -> Iterable[Any]:
    """The types that stand in another, at any depth."""
    for part in get_args(kind):
        yield part
        yield from _parts(part)


async def _refuse_wrong(request: Request) -> None:
    wrong = wrong_parameter(request.query_params.multi_items(), request.scope["route"].parameters)
    if wrong is not None:
        raise wrong


KNOWN_PARAMETERS = Depends(_refuse_wrong)
"""Of a route that holds its ``parameters``."""
