"""Headers by which a request tells where it comes from."""

import pytest
from starlette.requests import HTTPConnection
from starlette.types import Scope

from service.http.origin import check_site, is_forwarded
from service.http.problems import Problem


def scope(method: str = "POST", kind: str = "http", **headers: str) -> Scope:
    told = [(name.replace("_", "-").encode(), value.encode()) for name, value in headers.items()]
    return {"type": kind, "method": method, "headers": told}


def check(asked: Scope, *, is_browser: bool = False) -> None:
    check_site(HTTPConnection(asked), is_browser=is_browser)


@pytest.mark.parametrize(
    ("header", "forwarded"),
    [
        ("via", True),
        ("cdn_loop", True),
        ("x_real_ip", True),
        ("forwarded", True),
        ("x_forwarded_for", True),
        ("cf_ray", True),
        ("x_request_id", False),
        ("accept", False),
        ("a_via", False),
    ],
)
def test_a_proxy_is_known_by_what_only_proxies_send(header: str, forwarded: bool) -> None:
    assert is_forwarded(scope(host="a", **{header: "b"})) is forwarded
    assert not is_forwarded(scope(host="a"))


@pytest.mark.parametrize("method", ["GET", "HEAD", "OPTIONS"])
def test_a_page_of_another_site_may_ask_for_what_it_cannot_read(method: str) -> None:
    check(scope(method, sec_fetch_site="cross-site", origin="http://evil.example", host="here"), is_browser=True)


@pytest.mark.parametrize("site", ["cross-site", "same-site", ""])
def test_a_change_comes_from_a_page_of_this_service(site: str) -> None:
    with pytest.raises(
        Problem, match=r"Sec-Fetch-Site is .*; allowed: a page of this service, or no browser"
    ) as refusal:
        check(scope(sec_fetch_site=site, origin="http://here", host="here"))
    assert refusal.value.kind.status == 403
    for own in ("same-origin", "none"):
        check(scope(sec_fetch_site=own, origin="http://evil.example", host="here"))


def test_a_live_stream_is_asked_for_as_a_change_is() -> None:
    with pytest.raises(Problem, match="Sec-Fetch-Site is cross-site"):
        check(scope("GET", "websocket", sec_fetch_site="cross-site"))


@pytest.mark.parametrize(
    ("origin", "host", "is_own"),
    [
        ("http://here", "here", True),
        ("http://here", "here:80", True),
        ("http://here:80", "here", True),
        ("https://here", "here:443", True),
        ("HTTP://Here", "hERE", True),
        ("http://here:8000", "here:8000", True),
        ("http://[::1]:8000", "[::1]:8000", True),
        ("http://[::1]", "[::1]:80", True),
        ("https://here", "here:80", False),
        ("http://here:8000", "here", False),
        ("http://here", "here:8000", False),
        ("http://here.example", "here", False),
        ("http://[::1]", "[::2]", False),
        ("ftp://here", "here", False),
        ("null", "here", False),
        ("null", "", False),
        ("here", "here", False),
    ],
)
def test_an_origin_is_own_by_its_host_and_port(origin: str, host: str, is_own: bool) -> None:
    if is_own:
        check(scope(origin=origin, host=host))
        return
    with pytest.raises(Problem, match="Origin is "):
        check(scope(origin=origin, host=host))


def test_a_browser_says_where_it_is() -> None:
    with pytest.raises(Problem, match="Origin is missing"):
        check(scope(host="here"), is_browser=True)
    check(scope(host="here"))
    check(scope(host="here", origin="http://here"), is_browser=True)
    check(scope(host="here", sec_fetch_site="none"), is_browser=True)
