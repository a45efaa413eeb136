"""Authentication before all routes: finds out who asks, and refuses who may not."""

import math
import re
import time
from functools import lru_cache

from fastapi import Request
from starlette.concurrency import run_in_threadpool
from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Receive, Scope, Send

from db.database import Database
from db.errors import NotFound, StorageUnavailable
from db.records import AccessKey
from db.repositories import access_keys
from service.domain.access import keys
from service.domain.access.keys import NO_KEY, is_loopback
from service.domain.access.networks import network_of
from service.domain.resources.context import Context
from service.http import origin, problems, sessions
from service.http.access import CHALLENGE, CHALLENGE_OF_INVALID_KEY, EVERYTHING, Access, is_public
from service.http.problems import (
    INVALID_KEY,
    KEY_REQUIRED,
    MISDIRECTED_REQUEST,
    STORAGE_UNAVAILABLE,
    TOO_MANY_REQUESTS,
    Problem,
)
from service.http.rate_limit import RateLimit
from service.processes.fair_queue import UnboundedFairQueue
from service.settings import Settings

KEPT_SECONDS = 2.0
"""s that a key read from the database is trusted: so long a revoked one may still work."""

MOST_KEPT = 10_000
"""Keys; more than a fleet has."""


LOOKS_AT_ONCE = 4
"""Keys that are read at once, those that one address sends half of them: anybody may send what is none."""


class KeyCache:
    """Keys of the database, each read once every few seconds at most.

    Whatever is wrong with a key, an unknown id or another secret, costs one question to the database and two
    comparisons: the time that a refusal takes does not show which ids there are.
    """

    def __init__(self) -> None:
        self._kept: dict[str, tuple[AccessKey, float]] = {}
        self._sessions: dict[str, tuple[AccessKey, float]] = {}
        self._looks = UnboundedFairQueue(LOOKS_AT_ONCE, "looked up", share=LOOKS_AT_ONCE // 2)

    async def find(self, database: Database, text: str, address: str) -> AccessKey | None:
        """The key with this text, if it is a valid one."""
        key_id = keys.key_id(text)
        if key_id is None:
            return None
        known = self.find_kept(text)
        if known is not None:
            return known
        async with self._looks.turn(address):
            known = await run_in_threadpool(_read, database, key_id)
        if not keys.is_key(text, known):
            return None
        _keep(self._kept, key_id, known)
        return known

    async def find_of_session(self, database: Database, token: str, address: str) -> AccessKey | None:
        """The key with which somebody logged in whose browser has this token, if it is valid still."""
        known, until = self._sessions.get(token, (None, 0.0))
        if time.monotonic() > until:
            async with self._looks.turn(address):
                known = await run_in_threadpool(sessions.find_key, database, token)
            if known is not None:
                _keep(self._sessions, token, known)
        return known if known is not None and keys.is_valid(known) else None

    def forget_session(self, token: str) -> None:
        """Believe a token no longer: somebody has logged out."""
        self._sessions.pop(token, None)

    def find_kept(self, text: str) -> AccessKey | None:
        """The same without a question to the database: None, too, where one would be needed."""
        known, until = self._kept.get(keys.key_id(text) or "", (NO_KEY, 0.0))
        return known if keys.is_key(text, known) and time.monotonic() <= until else None

    def id_of_found(self, text: str) -> str | None:
        """The id of a key that was found once, though it may be none by now."""
        known, _ = self._kept.get(keys.key_id(text) or "", (NO_KEY, 0.0))
        return known.id if keys.is_key(text, known) else None


class Authentication:
    """Gives the routes who asks (``request.state.access``); answers by itself who has no key where one is needed."""

    def __init__(self, app: ASGIApp, authenticator: "Authenticator") -> None:
        self.app = app
        self._authenticator = authenticator

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        if scope["type"] not in {"http", "websocket"} or is_public(scope["path"]):
            await self.app(scope, receive, send)
            return
        connection = HTTPConnection(scope)
        try:
            connection.state.access = await self._authenticator.authenticate(connection)
        except Problem as problem:
            await problems.problem_response(Request({**scope, "type": "http"}), problem)(scope, receive, send)
            return
        await self.app(scope, receive, send)


class Authenticator:
    """Finds out who asks, and counts how often."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._keys = KeyCache()
        self._rate = RateLimit(settings.rate_limit)

    async def authenticate(self, connection: HTTPConnection) -> Access:
        """Who asks, and not too often; raises ``Problem`` for who may not."""
        try:
            admitted = await self._identify(connection)
        except Problem:
            self._count(_address(connection))  # before it is said what is wrong with the key: nobody tries many
            raise
        self._count(_counted_as(admitted, connection))
        return admitted

    async def still_admits(self, connection: HTTPConnection) -> bool:
        """Whether who was let in still may be here; while the database is away, that is assumed."""
        try:
            await self._identify(connection)
        except Problem as problem:
            return problem.kind is STORAGE_UNAVAILABLE
        return True

    def allows_at_once(self, connection: HTTPConnection) -> bool:
        """Whether somebody may ask who is known without waiting; for all others ``admit`` has to say."""
        known = self.known(connection)
        who = None if known is None else _counted_as(known, connection)
        return known is not None and (who is None or self._rate.wait(who) == 0.0)

    def known(self, connection: HTTPConnection) -> Access | None:
        """Who asks, where that is known without waiting and they may; does not count."""
        if sessions.sent_token(connection) is not None:
            return None
        try:
            text = self._sent_key(connection)
        except Problem:
            return None
        if text is None:
            return EVERYTHING
        found = self._keys.find_kept(text)
        return None if found is None else Access(found.id, found.scope)

    def starts_as(self, connection: HTTPConnection) -> str:
        """Among whose requests one waits to begin: those with its key, if it was one lately, else of its address."""
        kind, _, text = connection.headers.get("authorization", "").partition(" ")
        found = self._keys.id_of_found(text.strip()) if kind.lower() == "bearer" else None
        return found or _address(connection)

    def _count(self, who: str | None) -> None:
        seconds = 0.0 if who is None else self._rate.wait(who)
        if seconds > 0.0:
            headers = {"Retry-After": str(math.ceil(seconds))}
            detail = f"more than {self._settings.rate_limit:g} requests a second; try again in {seconds:.3f} s"
            raise Problem(TOO_MANY_REQUESTS, detail, headers=headers)

    async def find_key(self, connection: HTTPConnection, text: str) -> AccessKey:
        """The key with this text; raises ``Problem`` for what is none, or where an address asks too often."""
        self._count(_address(connection))
        return await self._find(connection, text)

    def forget_session(self, token: str) -> None:
        """Believe a token no longer: somebody has logged out."""
        self._keys.forget_session(token)

    async def _identify(self, connection: HTTPConnection) -> Access:
        found = await self._key_of_session(connection)
        if found is None:
            text = self._sent_key(connection)
            if text is None:
                return EVERYTHING
            found = await self._find(connection, text)
        return Access(found.id, found.scope, found.group)

    async def _key_of_session(self, connection: HTTPConnection) -> AccessKey | None:
        """The key of a browser's session; one that has ended is as if none was sent."""
        token = sessions.sent_token(connection)
        if token is None:
            return None
        context: Context = connection.app.state.context
        try:
            found = await self._keys.find_of_session(context.database, token, _address(connection))
        except StorageUnavailable as error:
            raise problems.storage_unavailable(error) from error
        if found is not None:
            origin.check_site(connection, is_browser=True)
        return found

    async def _find(self, connection: HTTPConnection, text: str) -> AccessKey:
        context: Context = connection.app.state.context
        try:
            found = await self._keys.find(context.database, text, _address(connection))
        except StorageUnavailable as error:
            raise problems.storage_unavailable(error) from error
        if found is None:
            headers = {"WWW-Authenticate": CHALLENGE_OF_INVALID_KEY}
            raise Problem(INVALID_KEY, "the access key is unknown, revoked, expired or garbled", headers=headers)
        return found

    def _sent_key(self, connection: HTTPConnection) -> str | None:
        """The key that was sent, which counts even where none is needed; None where none was and that is well."""
        kind, _, text = connection.headers.get("authorization", "").partition(" ")
        if kind.lower() != "bearer":
            if self._needs_key(connection.scope):
                raise Problem(KEY_REQUIRED, _key_needed(connection), headers={"WWW-Authenticate": CHALLENGE})
            _check_host(connection)
            origin.check_site(connection)
            return None
        return text.strip()

    def _needs_key(self, scope: Scope) -> bool:
        """Without a setting, all but those who are on this machine themselves, behind no proxy."""
        if self._settings.access == "auto":
            return not _is_local(scope) or origin.is_forwarded(scope)
        return self._settings.access == "keys"


def _keep(kept: dict[str, tuple[AccessKey, float]], name: str, known: AccessKey) -> None:
    if len(kept) >= MOST_KEPT:
        kept.clear()
    kept[name] = (known, time.monotonic() + KEPT_SECONDS)


def _counted_as(admitted: Access, connection: HTTPConnection) -> str | None:
    """Whose requests this one counts among; those on this machine of whom no key is asked may ask at any rate."""
    if admitted.key_id is not None:
        return admitted.key_id
    return None if _is_local(connection.scope) else _address(connection)


def _address(connection: HTTPConnection) -> str:
    return f"address {network_of(connection.client.host) if connection.client else ''}"


def _key_needed(connection: HTTPConnection) -> str:
    """What to do, without a word of what the header says: it may be a key in the wrong form."""
    sent = "another scheme was sent" if "authorization" in connection.headers else "no such header was sent"
    passed = "; the request passed a proxy" if origin.is_forwarded(connection.scope) else ""
    return f"send an access key: Authorization: Bearer KEY; {sent}{passed}"


def _check_host(connection: HTTPConnection) -> None:
    """Refuse a request that needs no key, since it comes from this machine, but is meant for another one.

    A page of that name has been made to lead here, and a browser on this machine now asks for it (DNS rebinding).
    """
    host = connection.headers.get("host", "localhost")
    if _is_local(connection.scope) and not _is_own_name(host):
        allowed = "localhost or a loopback address, or a request with a key"
        raise Problem.wrong_value(MISDIRECTED_REQUEST, "Host", host, allowed)


@lru_cache(maxsize=256)
def _is_own_name(host: str) -> bool:
    name = host.rpartition(":")[0] if re.search(r":\d*$", host) else host
    return is_loopback(name.strip("[]").lower())


def _is_local(scope: Scope) -> bool:
    """Whether both ends of the connection are on this machine, as far as is known."""
    server, client = scope.get("server") or ("",), scope.get("client") or ("",)
    return is_loopback(server[0]) and is_loopback(client[0])


def _read(database: Database, key_id: str) -> AccessKey:
    with database.read() as session:
        try:
            return access_keys.get(session, key_id)
        except NotFound:
            return NO_KEY
