"""Answers that need not be sent again to who has them, and changes of what is as somebody knows it (RFC 9110, 13.1)."""

import hashlib
from collections.abc import Callable
from typing import Annotated, Any

from fastapi import Header, Request, Response

from service.http.problems import PRECONDITION_FAILED, Problem

IfMatch = Annotated[str | None, Header(description="Tags (`ETag`) of which what is to be changed has to have one")]

NOT_MODIFIED: dict[int | str, dict[str, Any]] = {
    304: {"description": "What was asked for is what `If-None-Match` says that the client has"}
}
"""Description of a route whose answers carry an ETag."""

KEEP_AND_ASK = "private, no-cache"
"""Cache-Control: keep it, but ask before it is used again; a proxy keeps nothing, since not everybody may ask."""


LONGEST_LIST = 1024
"""Characters of `If-None-Match`: some thirty tags."""


def conditional(request: Request, tag: str, body: Callable[[], str]) -> Response:
    """The JSON ``body`` with its tag, or only that it has not changed; then it is not even made."""
    if is_one_of(tag, request.headers.get("if-none-match", "")):
        return unchanged(tag)
    return whole(tag, body())


def whole(tag: str, body: str) -> Response:
    """The JSON ``body`` with its tag."""
    return Response(body, 200, {"ETag": tag, "Cache-Control": KEEP_AND_ASK}, "application/json")


def unchanged(tag: str) -> Response:
    """That the client has it already."""
    return Response(None, 304, {"ETag": tag, "Cache-Control": KEEP_AND_ASK})


def tagged(request: Request, body: str) -> Response:
    """The same for a body that has no version of its own."""
    return conditional(request, _tag(body), lambda: body)


def changed(body: str) -> Response:
    """The JSON ``body`` of what was changed, with the tag by which it may be changed again."""
    return Response(body, 200, {"ETag": _tag(body)}, "application/json")


def require_match(if_match: str | None, body: Callable[[], str]) -> None:
    """Raise ``Problem`` where the tag of a ``body`` that ``tagged`` answers with is none of ``If-Match``; a weak one is
    never its.
    """
    if if_match is None or if_match.strip() == "*":
        return
    tag = _tag(body())
    if tag not in (each.strip() for each in if_match.split(",")):
        raise Problem.wrong_value(PRECONDITION_FAILED, "If-Match", if_match, tag)


def _tag(body: str) -> str:
    return f'"{hashlib.blake2b(body.encode(), digest_size=12).hexdigest()}"'


def is_one_of(tag: str, listed: str) -> bool:
    """Whether ``If-None-Match`` names the tag; of a list that is longer than any client's all is taken for unknown."""
    return len(listed) <= LONGEST_LIST and any(
        each.strip().removeprefix("W/") in {tag, "*"} for each in listed.split(",")
    )
