"""Requests that are to be done once, however often they come: the header ``Idempotency-Key``."""

import hashlib
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from datetime import timedelta
from typing import Annotated, Any

from fastapi import Depends, Header, Request
from fastapi.responses import JSONResponse
from sqlalchemy.orm import Session

from db.errors import AlreadyExists
from db.repositories import idempotency_keys
from service.http.access import Access
from service.http.dependencies import CurrentContext
from service.http.problems import IDEMPOTENCY_KEY_REUSED, INVALID_REQUEST, Problem

LONGEST_KEY = 200
KEY_PATTERN = rf"^[!-~]{{1,{LONGEST_KEY}}}$"
KEY_RULE = f"1 to {LONGEST_KEY} visible ASCII characters"

KeyHeader = Annotated[
    str | None,
    Header(
        alias="Idempotency-Key",
        description="Anything of your own, such as a UUID: the same request under the same key is done once",
        pattern=KEY_PATTERN,
    ),
]


@dataclass(frozen=True, slots=True)
class RepeatableResponse:
    """A status, a place and a JSON body."""

    status: int
    location: str
    body: dict[str, Any]

    def response(self) -> JSONResponse:
        """The response of the framework."""
        return JSONResponse(self.body, self.status, {"Location": self.location} if self.location else {})


class NothingDone(RepeatableResponse):
    """To a request that changed nothing, and may be made again under its key."""


@dataclass(frozen=True, slots=True)
class IdempotencyKey:
    """A request's key, whose it is, how long it counts, and what is asked under it, as a digest."""

    owner: str
    text: str
    lifetime: timedelta
    fingerprint: str

    def for_body(self, body_digest: str) -> "IdempotencyKey":
        """The same with a body that was not there yet."""
        return replace(self, fingerprint=_digest(self.fingerprint.encode(), body_digest.encode()))


@dataclass(frozen=True, slots=True)
class EarlierResponse:
    """What was answered under a key, and to which request, as a digest."""

    fingerprint: str
    response: RepeatableResponse

    def to(self, key: IdempotencyKey) -> RepeatableResponse:
        """The response, to the same request; raises ``Problem`` for another."""
        if key.fingerprint != self.fingerprint:
            raise _reused(key)
        return self.response


def find_earlier(session: Session, key: IdempotencyKey) -> EarlierResponse | None:
    """What was answered under this key, whatever was asked."""
    found = idempotency_keys.find(session, key.owner, key.text, key.lifetime)
    return None if found is None else EarlierResponse(found[0], RepeatableResponse(**found[1]))


def respond_once(
    session: Session, key: IdempotencyKey | None, make: Callable[[], RepeatableResponse]
) -> RepeatableResponse:
    """The response that ``make`` gives in this transaction, or the one that it gave under the same key.

    ``NothingDone`` is not kept, so that no key stores more by asking for what is there. Raises ``Problem`` for a key
    under which something else was asked.
    """
    if key is None:
        return make()
    try:
        earlier = idempotency_keys.claim(session, key.owner, key.text, key.fingerprint, key.lifetime)
    except AlreadyExists as error:
        raise _reused(key) from error
    if earlier is not None:
        return RepeatableResponse(**earlier)
    response = make()
    if isinstance(response, NothingDone):
        idempotency_keys.release(session, key.owner, key.text)
    else:
        idempotency_keys.keep(session, key.owner, key.text, asdict(response))
    return response


def _reused(key: IdempotencyKey) -> Problem:
    allowed = "another key, or the very request that was sent under it"
    return Problem.wrong_value(IDEMPOTENCY_KEY_REUSED, "Idempotency-Key", key.text, allowed)


async def _key_without_body(context: CurrentContext, request: Request, text: KeyHeader = None) -> IdempotencyKey | None:
    if text is None:
        return None
    if len(all_of_it := request.headers.getlist("Idempotency-Key")) > 1:
        raise Problem.wrong_value(INVALID_REQUEST, "Idempotency-Key", ", ".join(all_of_it), "one header of this name")
    access: Access = request.state.access
    asked = (request.method, request.url.path, request.url.query)
    lifetime = timedelta(hours=context.settings.idempotency_hours)
    return IdempotencyKey(access.key_id or "", text, lifetime, _digest(*(part.encode() for part in asked)))


KeyWithoutBody = Annotated[IdempotencyKey | None, Depends(_key_without_body)]
"""What a route takes that reads its body by itself."""


async def _key_with_body(request: Request, key: KeyWithoutBody) -> IdempotencyKey | None:
    return None if key is None else key.for_body(_digest(await request.body()))


KeyWithBody = Annotated[IdempotencyKey | None, Depends(_key_with_body)]
"""What a route takes whose body is read already."""


def _digest(*parts: bytes) -> str:
    hashed = hashlib.sha256()
    for part in parts:
        hashed.update(len(part).to_bytes(8, "big") + part)
    return hashed.hexdigest()
