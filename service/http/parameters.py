"""Parameters of addresses: those that a route knows, each once."""

from collections import Counter
from collections.abc import Collection, Iterable

from fastapi import Depends, Request
from fastapi.dependencies.utils import get_flat_params
from fastapi.params import Cookie, Header, Path
from fastapi.routing import APIRoute

from service.domain.errors import shown
from service.http.problems import INVALID_REQUEST, Problem

LONGEST_SHOWN = 60
"""Characters of a parameter's name that are told."""


def wrong_parameter(given: Iterable[str], known: Collection[str]) -> Problem | None:
    """What is wrong with parameters of these names, where ``known`` are each taken once; None where nothing is.

    One that is passed over would change the answer without a word: ``quantil=0.05`` would be answered by the mean.
    """
    for name, times in Counter(given).items():
        if name not in known:
            told = shown(name)[:LONGEST_SHOWN] or "a parameter without a name"
            return Problem.wrong_value(INVALID_REQUEST, told, "unknown", ", ".join(known) or "no parameters")
        if times > 1:
            return Problem.wrong_value(INVALID_REQUEST, name, f"given {times} times", "once")
    return None


def query_names(route: APIRoute) -> tuple[str, ...]:
    """Names of the parameters that a route takes in its address."""
    elsewhere = (Path, Header, Cookie)
    return tuple(each.alias for each in get_flat_params(route.dependant) if not isinstance(each.field_info, elsewhere))


async def _refuse_wrong(request: Request) -> None:
    wrong = wrong_parameter((name for name, _ in request.query_params.multi_items()), request.scope["route"].parameters)
    if wrong is not None:
        raise wrong


KNOWN_PARAMETERS = Depends(_refuse_wrong)
"""Of a route that holds its ``parameters``."""
