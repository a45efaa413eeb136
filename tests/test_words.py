"""Private words that were replaced by the field's terms do not come back as names in the code."""

import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("slipcore", "estimators", "db", "migrations", "service", "clients/stiction_client", "examples")

FORMER = frozenset(
    {
        "presses_home",
        "sunk",
        "WILD",
        "Hindsight",
        "foreseen",
        "Opposite",
        "Wish",
        "Once",
        "Place",
        "hire",
        "give_way",
        "strays",
        "stray",
        "Lane",
        "live_lane",
        "_honest_covariance",
        "_hopeless",
        "Judged",
        "Shown",
        "Insight",
        "ImpurePress",
        "impurity",
        "Plateaus",
        "SinceTouch",
        "Felt",
        "felt",
        "PatientQueue",
        "OpenEndedQueue",
        "PATIENCE",
        "patience",
        "StillLooking",
        "Promise",
        "NotTaken",
        "Ran",
        "Seen",
        "Adopted",
        "refuse_greedy",
        "reforced",
        "domed",
        "unheard",
        "_told",
        "said",
        "stranger",
    }
)
"""Names that a reader who knows mechanics, statistics or web services had to learn."""

PHRASES = ("not to be had", "honest sign", "is without displacement", "hindsight")
"""The same of pages and messages."""


def names(source: str) -> Iterator[str]:
    """Each name of a module's code; what strings and comments hold is not code."""
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.NAME:
            yield token.string


@pytest.mark.parametrize("package", PACKAGES)
def test_no_name_is_a_private_word(package: str) -> None:
    files = sorted((ROOT / package).rglob("*.py"))
    assert files
    found = {str(path.relative_to(ROOT)): FORMER & set(names(path.read_text(encoding="utf-8"))) for path in files}
    assert {path: words for path, words in found.items() if words} == {}


@pytest.mark.parametrize("text", ["def patience(): ...", "class Felt: ...", "x.said(1)", "from a import Lane"])
def test_a_private_word_is_found(text: str) -> None:
    assert FORMER & set(names(text))


def pages() -> dict[str, str]:
    """The text of each page, by its name, in small letters."""
    paths = [*ROOT.glob("docs/*.md"), ROOT / "README.md", ROOT / "ARCHITECTURE.md", ROOT / "Makefile"]
    return {path.name: path.read_text(encoding="utf-8").lower() for path in paths}


def test_no_page_or_message_has_one_of_the_phrases() -> None:
    assert {name: phrase for name, text in pages().items() for phrase in PHRASES if phrase in text} == {}


TELL = re.compile(r".{0,30}\b(?:tells?|telling|told)\b(?! to\b).{0,30}")
"""Data determine, sensors measure, files state and pages say or report; nobody is told but to do something."""


def test_no_page_says_that_a_thing_tells_another() -> None:
    assert {name: found for name, text in pages().items() if (found := TELL.findall(text))} == {}


@pytest.mark.parametrize(("text", "is_found"), [("what the data tell", True), ("told to stop", False)])
def test_a_thing_that_tells_is_found(text: str, is_found: bool) -> None:
    assert bool(TELL.search(text)) == is_found
