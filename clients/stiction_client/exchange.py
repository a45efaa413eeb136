"""How a call asks the service: requests, pauses, what is asked again, and what an answer holds, without any I/O.

A call is a generator: it yields a ``Request`` or a ``Pause``, is sent the ``Reply``, and returns the result. The
clients only carry requests out, one waiting, the other awaiting, so nothing is written twice.
"""

import json
import math
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field
from typing import Any, Generic, NoReturn, TypeVar
from urllib.parse import quote
from uuid import uuid4

import httpx

from stiction_client import problems
from stiction_client.errors import (
    AnswerTooLarge,
    ConnectionFailed,
    InvalidArgument,
    ProblemError,
    StictionError,
    UnexpectedAnswer,
)

ATTEMPTS = 3
"""Times that a request is tried before a broken connection, or a service that is busy, is an error."""

AWAY = frozenset({502, 503, 504})
"""Statuses by which a service, or a proxy before it, says that it is not there now."""
NOT_DONE = frozenset({429, 503})
"""Statuses with which the service says that it did nothing."""
MAY_BE_DONE = frozenset({None, "/problems/stopping"})
"""Types of problem with these statuses, None of answers that are no problem of the service's, which do not say so."""
BUSY = AWAY | NOT_DONE
"""Statuses after which what may be asked twice is asked again."""

LONGEST_RETRY = 30.0
"""s; a service that asks to be left alone for longer is not waited for."""

RETRY_PAUSE = 0.2
"""s before the second attempt; doubled for each one after."""

NOT_JSON = (ValueError, RecursionError)
"""What an answer raises that is no JSON, or nested too deeply, or has a number of thousands of digits."""

OF_PROBLEMS = frozenset({"type", "title", "status", "detail", "instance", "name", "value", "allowed"})
"""Members of a problem that are arguments of their own, or say what is known: RFC 9457's, and this service's."""


@dataclass(frozen=True, slots=True)
class Request:
    """One HTTP request; ``is_repeatable``: harmless twice, or done once under its ``idempotency_key``.

    ``wait_seconds``: for which the service is asked to keep its answer back; ``tag``: that of its answer before.
    """

    method: str
    path: str
    params: Mapping[str, str | float] = field(default_factory=dict)
    json: Mapping[str, Any] | None = None
    content: bytes | None = None
    content_type: str | None = None
    idempotency_key: str | None = None
    wait_seconds: float = 0.0
    tag: str | None = None
    is_repeatable: bool = True


@dataclass(frozen=True, slots=True)
class Pause:
    """Wait this many seconds."""

    seconds: float


T = TypeVar("T")
Call = Generator[Request | Pause, httpx.Response | None, T]
Reply = httpx.Response | ConnectionFailed | AnswerTooLarge | None
"""What a client got for a step: for a request a response, or why there is none, and nothing for a pause."""


@dataclass(frozen=True, slots=True)
class Ended(Generic[T]):
    """A call is through."""

    result: T


def advance(call: Call[T], answer: Reply) -> Request | Pause | Ended[T]:
    """Give a call the result of its last step (None at the start) and get its next one."""
    try:
        return call.throw(answer) if isinstance(answer, StictionError) else call.send(answer)
    except StopIteration as end:
        return Ended(end.value)


def get(path: str, params: Mapping[str, str | float] | None = None) -> Call[Any]:
    """Ask for what is at a path."""
    return (yield from ask(Request("GET", path, params or {})))


def post(path: str, body: Mapping[str, Any]) -> Request:
    """A request that would be done again if it came twice."""
    return Request("POST", path, json=body, is_repeatable=False)


def post_once(path: str, body: Mapping[str, Any]) -> Request:
    """A request that is done once, however often it comes."""
    return Request("POST", path, json=body, idempotency_key=uuid4().hex)


def ask(request: Request) -> Call[Any]:
    """Send a request, again where the connection breaks, and return the JSON of a good answer."""
    return content_of((yield from send(request)))


def send(request: Request) -> Call[httpx.Response]:
    """Send a request, again where the connection breaks or the service is busy, and return what is answered.

    One that is not repeatable is sent again only where the answer says that nothing was done.
    """
    for attempt in range(ATTEMPTS):
        pause = RETRY_PAUSE * 2**attempt
        try:
            response = yield request
        except ConnectionFailed:
            if attempt == ATTEMPTS - 1 or not request.is_repeatable:
                raise
        else:
            assert response is not None  # what a driver sends for a request
            pause = max(_retry_after(response, pause), 0.0)
            if not _is_to_ask_again(request, response) or attempt == ATTEMPTS - 1 or pause > LONGEST_RETRY:
                return response
        yield Pause(pause)
    raise AssertionError("the last attempt returns or raises")


def _is_to_ask_again(request: Request, response: httpx.Response) -> bool:
    """Whether it was not done, or may be done twice; a proxy says 503 of what it had passed on, too."""
    if request.is_repeatable:
        return response.status_code in BUSY
    return response.status_code in NOT_DONE and _type_of_problem(response) not in MAY_BE_DONE


def _type_of_problem(response: httpx.Response) -> str | None:
    """As the service names it; None of an answer that is none of its problems."""
    try:
        kind = str(_json(response)["type"])
    except (*NOT_JSON, KeyError, TypeError):
        return None
    return kind if kind.startswith("/problems/") else None


def _retry_after(response: httpx.Response, default: float) -> float:
    """s that the service asks to wait; ``default`` where it doesn't say."""
    try:
        seconds = float(response.headers.get("retry-after", default))
    except ValueError:  # a date, of which it is not known by which clock
        return default
    return default if math.isnan(seconds) else seconds


def content_of(response: httpx.Response) -> Any:
    """The JSON of a good answer; raises ``ProblemError`` for a problem, ``UnexpectedAnswer`` for anything else."""
    if not response.is_success:
        _refuse(response)
    if response.status_code == httpx.codes.NO_CONTENT:
        return None
    try:
        return _json(response)
    except NOT_JSON as error:
        raise UnexpectedAnswer(f"{summary_of(response)}, which is not JSON") from error


def _json(response: httpx.Response) -> Any:
    """What it says in JSON, which is UTF-8 between services (RFC 8259); raises one of ``NOT_JSON``."""
    return json.loads(response.content.decode())


def _refuse(response: httpx.Response) -> NoReturn:
    try:
        problem = _json(response)
        kind, detail = str(problem["type"]), str(problem.get("detail") or problem.get("title", ""))
    except (*NOT_JSON, KeyError, TypeError, AttributeError) as error:
        raise UnexpectedAnswer(f"{summary_of(response)}, which is no problem+json") from error
    named = {name: None if problem.get(name) is None else str(problem[name]) for name in ("name", "value", "allowed")}
    facts = {name: value for name, value in problem.items() if name not in OF_PROBLEMS}
    raise problems.BY_TYPE.get(kind, ProblemError)(kind, response.status_code, detail, **named, facts=facts)


def read_as(read: Callable[[Any], T], record: Any) -> T:
    """What an answer holds, by its reader; raises ``UnexpectedAnswer`` where it cannot be read."""
    try:
        return read(record)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise UnexpectedAnswer(f"the service's answer lacks or garbles {error}") from error


def summary_of(response: httpx.Response) -> str:
    """A response in a few words, for an error's message."""
    begin = response.content[:80].decode(errors="replace")  # whatever charset it says it has
    return f"{response.request.url} answered {response.status_code} with {begin!r}"


def without_none(**params: str | float | None) -> dict[str, str | float]:
    """Parameters without those that are None."""
    return {name: value for name, value in params.items() if value is not None}


def segment(text: str) -> str:
    """One segment of a path; a name of dots or nothing would lead to another route, and None is no name."""
    if not isinstance(text, str) or not text.strip("."):
        raise InvalidArgument("name", repr(text), "a letter or digit, then letters, digits, space, '.', '_' or '-'")
    return quote(text, safe="")
