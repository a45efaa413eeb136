from collections.abc import Callable
from html.parser import HTMLParser
from typing import Any

import httpx
import pytest

from db.database import Database
from db.repositories import materials

HTML = {"accept": "text/html"}
OWN = {"sec-fetch-site": "same-origin"}
"""Of a form that one of our own pages sends."""

HOSTILE = [
    "<script>alert(1)</script>",
    "'\"><img src=x onerror=alert(1)>",
    "x" * 10_000,
    "\u202eشبكة مطاطية",
    "🧤🖐🏽",
    "{{ 7*7 }}",
]


class Elements(HTMLParser):
    """The elements of a page, each with its attributes, and its text."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(page)

    def handle_starttag(self, tag: str, attributes: Any) -> None:
        self.found.append((tag, dict(attributes)))

    def handle_data(self, data: str) -> None:
        self.text += data

    def foreign(self) -> list[str]:
        """Elements and attributes that none of our templates has: markup that somebody typed."""
        scripts = [given.get("src") or "" for tag, given in self.found if tag in {"script", "img"}]
        handlers = [name for _, given in self.found for name in given if name.startswith("on") or name == "style"]
        return [source for source in scripts if not source.startswith("/assets/")] + handlers


@pytest.fixture(scope="session")
def elements() -> Callable[[str], Elements]:
    return Elements


@pytest.fixture(scope="session")
def links_of_list() -> Callable[[httpx.Client, str], list[str]]:
    """What a list links to, on all of its pages: how many there are depends on the tests before."""

    def follow(client: httpx.Client, path: str) -> list[str]:
        links: list[str] = []
        after: str | None = path
        while after is not None:
            answer = client.get(after, headers=HTML)
            assert answer.status_code == 200, answer.text
            found = [given["href"] or "" for tag, given in Elements(answer.text).found if tag == "a"]
            links += found
            after = next((httpx.URL(path).join(link) for link in found if "cursor=" in link), None)
        return links

    return follow


@pytest.fixture
def browser(reach: Any) -> Any:
    """Somebody at this machine's browser, of whom no key is asked."""
    caller = reach("open")
    caller.headers |= HTML
    return caller


@pytest.fixture
def session_of(reach: Any, make: Callable[..., str]) -> Callable[[str], Any]:
    """Log a browser on another machine in, with a new key of a scope."""

    def log_in(scope: str) -> Any:
        caller = reach("keys")
        caller.headers |= HTML | OWN
        answer = caller.request("POST", "/login", data={"key": make(scope)})
        caller.headers["cookie"] = answer.headers["set-cookie"].partition(";")[0]
        return caller

    return log_in


@pytest.fixture
def add(database: Database) -> Callable[..., int]:
    """Make a material known."""

    def add_material(name: str, description: str = "") -> int:
        with database.write() as session:
            return materials.create(session, name, description).id

    return add_material
