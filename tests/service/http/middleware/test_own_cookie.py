"""Which cookies the application sees, and what it sees of HEAD."""

import asyncio
from typing import Any

import pytest

from service.http.middleware.head_requests import IS_HEAD, HeadRequests
from service.http.middleware.own_cookie import OwnCookie
from service.http.sessions import COOKIE

Headers = list[tuple[bytes, bytes]]
OTHER = (b"accept", b"text/html")


def seen(headers: Headers | None) -> Headers | None:
    """What the application is given of these headers."""
    scopes: list[Any] = []

    async def app(scope: Any, *_: Any) -> None:
        scopes.append(scope)

    asyncio.run(OwnCookie(app)({} if headers is None else {"headers": headers}, None, None))  # type: ignore[arg-type]
    found: Headers | None = scopes[0].get("headers")
    return found


@pytest.mark.parametrize(
    "sent",
    [f"{COOKIE}=a-Z_9", f"x=1; {COOKIE}=a-Z_9 ; y=2", f'bad="\\"";\t{COOKIE}=a-Z_9', f"x{COOKIE}=b;{COOKIE}=a-Z_9"],
)
def test_the_service_s_own_cookie_is_handed_on_alone(sent: str) -> None:
    assert seen([(b"cookie", sent.encode()), OTHER]) == [OTHER, (b"cookie", f"{COOKIE}=a-Z_9".encode())]


def test_a_cookie_may_come_in_a_header_of_its_own() -> None:
    own = (b"cookie", f"{COOKIE}=a".encode())
    assert seen([(b"cookie", b"x=1"), OTHER, own]) == [OTHER, own]


@pytest.mark.parametrize("sent", ["x=1", f"x{COOKIE}=a", f"{COOKIE}=", f"{COOKIE}=a,b", f"{COOKIE}={'a' * 65}"])
def test_what_is_no_token_of_the_service_is_dropped(sent: str) -> None:
    assert seen([(b"cookie", sent.encode()), OTHER]) == [OTHER]
    assert seen([(b"cookie", f"{COOKIE}={'a' * 64}".encode())]) == [(b"cookie", f"{COOKIE}={'a' * 64}".encode())]


def test_what_has_no_cookie_is_left_as_it_is() -> None:
    assert seen([OTHER]) == [OTHER]
    assert seen(None) is None


@pytest.mark.parametrize(("method", "body"), [("HEAD", b""), ("GET", b"text")])
def test_head_is_answered_as_get_without_the_body(method: str, body: bytes) -> None:
    sent: list[Any] = []
    scope: Any = {"type": "http", "method": method}

    async def app(inner: Any, _: Any, send: Any) -> None:
        assert (inner["method"], inner.get(IS_HEAD, False)) == ("GET", method == "HEAD")
        inner["route"] = "the route"
        await send({"type": "http.response.start", "status": 200})
        await send({"type": "http.response.body", "body": b"text"})

    async def send(message: Any) -> None:
        sent.append(message)

    asyncio.run(HeadRequests(app)(scope, None, send))  # type: ignore[arg-type]
    assert [message.get("body") for message in sent] == [None, body]
    assert (scope["method"], scope["route"]) == (method, "the route")
