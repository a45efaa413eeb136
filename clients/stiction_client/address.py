"""The address of a service: what a caller gives, checked before anything is sent."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

import httpx

from stiction_client.arguments import of_kind
from stiction_client.errors import InvalidArgument

DEFAULT_URL = "http://127.0.0.1:8000"

SHOWN_URL = 80
"""Characters of an address that an error shows."""

MOST_PORT = 65535


def authorization(key: str | None) -> dict[str, str]:
    """The header of an access key, by default that of ``STICTION_KEY``; raises ``InvalidArgument`` for what it cannot
    hold.
    """
    key = os.environ.get("STICTION_KEY") if key is None else key
    if key and not (isinstance(key, str) and key.isascii() and key.isprintable()):  # it is not shown
        what = "one with other characters" if isinstance(key, str) else f"of type {type(key).__name__}"
        raise InvalidArgument("key", what, "printable ASCII, as `stiction keys create` prints it")
    return {"Authorization": f"Bearer {key}"} if key else {}


def service_address(url: str | None) -> httpx.URL:
    """The address of a service in its parts, by default that of ``STICTION_URL``, or of a service on this machine;
    raises ``InvalidArgument`` for one that no service can have.
    """
    url = os.environ.get("STICTION_URL", DEFAULT_URL) if url is None else url
    of_kind("address", url, str)
    with checked(url):
        address = httpx.URL(url)
    if address.scheme not in ("http", "https"):
        raise _refusal(url, "it begins with neither http:// nor https://")
    if not address.host:
        raise _refusal(url, "it names no host")
    if address.port is not None and not 0 < address.port <= MOST_PORT:
        raise _refusal(url, f"its port is not 1 to {MOST_PORT}")
    return address


@contextmanager
def checked(url: str) -> Iterator[None]:
    """Say whose fault it is that ``url`` cannot be asked."""
    try:
        yield
    except (httpx.InvalidURL, UnicodeError) as error:
        raise _refusal(url, str(error)) from error


def _refusal(url: str, why: str) -> InvalidArgument:
    shown = ascii(url) if len(url) <= SHOWN_URL else f"{url[:SHOWN_URL]!a}… ({len(url)} characters)"
    return InvalidArgument("address", f"{shown} ({why})", f"one such as {DEFAULT_URL}, in UTF-8")
