"""Where a request without a key comes from: a page of another site, or a proxy that speaks for somebody else."""

from starlette.requests import HTTPConnection
from starlette.types import Scope

from service.http.problems import CROSS_SITE_REQUEST, Problem

FORWARDING = frozenset(
    {
        b"via",
        b"x-real-ip",
        b"x-client-ip",
        b"x-cluster-client-ip",
        b"x-remote-addr",
        b"x-remote-ip",
        b"x-proxyuser-ip",
        b"x-rewrite-url",
        b"true-client-ip",
        b"fastly-client-ip",
        b"fly-client-ip",
        b"client-ip",
        b"cdn-loop",
    }
)
"""Headers that only a proxy sends."""

FORWARDING_PREFIXES = (
    b"forwarded",
    b"x-forward",
    b"x-original-",
    b"x-originating-",
    b"x-envoy-",
    b"x-amzn-",
    b"x-azure-",
    b"x-appengine-",
    b"cf-",
)
"""How more of them begin."""

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
"""Of requests that change nothing (RFC 9110); a page of another site cannot read what they are answered."""

DEFAULT_PORTS = {"http": "80", "https": "443"}


def is_forwarded(scope: Scope) -> bool:
    """Whether somebody asks for somebody else: both ends of the connection then say nothing of who asks."""
    return any(name in FORWARDING or name.startswith(FORWARDING_PREFIXES) for name, _ in scope["headers"])


def check_site(connection: HTTPConnection, *, is_browser: bool = False) -> None:
    """Refuse what a page of another site asks for in the name of its visitor: a change, or a live stream.

    A browser sends such requests with the right of whoever sits before it, and says where they come from by headers
    that no page can forge: ``Sec-Fetch-Site``, and ``Origin``; one that is known to be a browser (``is_browser``) has
    to. Raises ``Problem``.
    """
    if connection.scope["type"] == "http" and connection.scope["method"] in SAFE_METHODS:
        return
    site, origin = connection.headers.get("sec-fetch-site"), connection.headers.get("origin")
    allowed = "a page of this service, or no browser; another site's page needs an access key"
    if site is not None and site not in {"same-origin", "none"}:
        raise Problem.wrong_value(CROSS_SITE_REQUEST, "Sec-Fetch-Site", site, allowed)
    if is_browser and site is None and origin is None:
        raise Problem.wrong_value(CROSS_SITE_REQUEST, "Origin", "missing", allowed)
    if site is None and origin is not None and not _is_own(origin, connection.headers.get("host", "")):
        raise Problem.wrong_value(CROSS_SITE_REQUEST, "Origin", origin, allowed)


def _is_own(origin: str, host: str) -> bool:
    """Whether an origin (RFC 6454) is that of the host which the request names; ``null`` is nobody's."""
    scheme, _, authority = origin.lower().partition("://")
    default = DEFAULT_PORTS.get(scheme)
    return default is not None and _with_port(authority, default) == _with_port(host.lower(), default)


def _with_port(authority: str, default: str) -> str:
    has_port = authority.rpartition("]")[2].count(":") == 1
    return authority if has_port else f"{authority}:{default}"
