"""Pages that lead somewhere."""

import importlib.metadata
import re
from pathlib import Path

import pytest

import db
import estimators
import service
import slipcore
import stiction_client

ROOT = Path(__file__).parents[1]
PAGES = [*sorted(ROOT.glob("*.md")), ROOT / "clients" / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_link_of_a_page_leads_to_a_file(page: Path) -> None:
    targets = re.findall(r"\]\((?!https?://|#)([^)#\s]+)", page.read_text(encoding="utf-8"))
    missing = [target for target in targets if not (page.parent / target).exists()]
    assert not missing


def test_every_page_can_be_reached_from_the_readme() -> None:
    reached, waiting = set(), [ROOT / "README.md"]
    while waiting:
        page = waiting.pop().resolve()
        if page in reached or page.suffix != ".md" or not page.exists():
            continue
        reached.add(page)
        waiting += [page.parent / target for target in re.findall(r"\]\((?!https?://|#)([^)#\s]+)", page.read_text())]
    assert {page.resolve() for page in PAGES} - {ROOT / "clients" / "README.md"} <= reached


def test_the_version_is_the_same_wherever_it_stands() -> None:
    versions = {package.__version__ for package in (slipcore, estimators, db, service, stiction_client)}
    assert versions == {importlib.metadata.version("stiction")} == {importlib.metadata.version("stiction-client")}
    (version,) = versions
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text()
    assert f"## [{version}]" in (ROOT / "CHANGELOG.md").read_text()
