"""The shortest way to a look-up: what planners ask most often, answered from memory without the framework."""

import re
from functools import lru_cache
from types import SimpleNamespace

from fastapi import Request, Response
from starlette.types import ASGIApp, Receive, Scope, Send

from service.context import Context
from service.domain.look_up import Question, look_up
from service.http.conditional import conditional
from service.http.schemas import LARGEST_FORCE, LARGEST_VELOCITY, SMALLEST_TAIL
from service.observability import traces

MOST_ANSWERS = 1000
"""Answers kept with a model, half a kB each: planners ask the same again and again."""

ROUTE = SimpleNamespace(path="/v1/materials/{name}/friction")
"""Under which the look-ups are counted, as those that the route itself answers."""

_PATH = re.compile(r"/v1/materials/([A-Za-z0-9][A-Za-z0-9 ._-]{0,99})/friction")
_METHODS = frozenset({"ols", "robust", "conjugate", "bayes"})
_NUMBER = re.compile(r"[0-9]{1,20}(\.[0-9]{1,20})?(e-?[0-9]{1,2})?")
_LIMITS = {"v": (0.0, LARGEST_VELOCITY), "fn": (0.0, LARGEST_FORCE), "quantile": (SMALLEST_TAIL, 1.0 - SMALLEST_TAIL)}


class Lookups:
    """Answers a well-formed look-up of a model in memory; hands anything else on to the route, which says the same.

    To be put behind the gate: whoever has come so far may read.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        answer = _answer(scope) if scope["type"] == "http" and scope["method"] == "GET" else None
        await (self.app if answer is None else answer)(scope, receive, send)


def _answer(scope: Scope) -> Response | None:
    found = _PATH.fullmatch(scope["path"])
    asked = scope["query_string"] if found else b""
    read = _read(asked.decode("latin-1")) if asked else None
    if found is None or read is None:
        return None
    method, question = read
    context: Context = scope["app"].state.context
    known = context.models.fresh(found[1], method)
    if known is None:
        return None
    context.models.renew(context.database, known, found[1], method)
    body = known.answers.get(question)
    if body is None:
        body = look_up(known, question).model_dump_json()
        if len(known.answers) < MOST_ANSWERS:
            known.answers[question] = body
    scope["route"] = ROUTE
    traces.name_request("GET", ROUTE.path)
    return conditional(Request(scope), known.tag, lambda: body)


@lru_cache(maxsize=4096)
def _read(query: str) -> tuple[str, Question] | None:
    """Method and question of a query in its simplest form, None for any other."""
    method, numbers = "ols", dict[str, float]()
    for part in query.split("&"):
        name, _, value = part.partition("=")
        if name == "method" and value in _METHODS and query.count("method=") == 1:
            method = value
        elif name in _LIMITS and name not in numbers and _NUMBER.fullmatch(value):
            low, high = _LIMITS[name]
            numbers[name] = float(value)
            if not low <= numbers[name] <= high:
                return None
        else:
            return None
    if "fn" not in numbers:
        return None
    return method, Question(numbers.get("v", 0.0), numbers["fn"], numbers.get("quantile"))
