"""Sessions of browsers: a key that was given once on the login page, and a random token for it in a cookie.

The cookie goes to this service only, is sent by its own pages only (SameSite) and read by no script (HttpOnly).
"""

import secrets
from datetime import UTC, datetime, timedelta

from fastapi import Response
from starlette.requests import HTTPConnection

from db.database import Database
from db.records import AccessKey
from db.repositories import browser_sessions
from service.domain.access.keys import digest

COOKIE = "stiction_session"
LIFETIME = timedelta(hours=12)
"""A working day; a key that is revoked or expires ends its sessions before."""

MOST_OF_A_KEY = 100
"""Sessions: a person has one in each browser, a key of a whole laboratory some tens; who logs in by a script, more."""


def sent_token(connection: HTTPConnection) -> str | None:
    """The token that a browser sent; a key in the request's header counts before it."""
    headers = connection.headers
    if "cookie" not in headers or "authorization" in headers:
        return None
    return connection.cookies.get(COOKIE) or None


def find_key(database: Database, token: str) -> AccessKey | None:
    """The key, valid or not, with which this session was begun, unless it has ended."""
    with database.read() as session:
        return browser_sessions.find_key(session, digest(token))


def begin(database: Database, key: AccessKey, connection: HTTPConnection, response: Response) -> None:
    """Store a new session of the key, whose oldest ends where it has too many; give its cookie to the browser."""
    token = secrets.token_urlsafe(32)
    with database.write() as session:
        browser_sessions.add(session, digest(token), key.id, datetime.now(UTC) + LIFETIME)
        browser_sessions.keep_newest(session, key.id, MOST_OF_A_KEY)
    is_tls = connection.scope["scheme"] in {"https", "wss"}
    seconds = int(LIFETIME.total_seconds())
    response.set_cookie(COOKIE, token, max_age=seconds, httponly=True, samesite="strict", secure=is_tls)


def end(database: Database, token: str, response: Response) -> None:
    """Delete a session, and its cookie."""
    with database.write() as session:
        browser_sessions.remove(session, digest(token))
    response.delete_cookie(COOKIE, httponly=True, samesite="strict")
