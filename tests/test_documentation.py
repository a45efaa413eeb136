"""Pages that lead somewhere, and tell of what is there and of nothing else."""

import importlib.metadata
import importlib.util
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

import pytest
import typer

import db
import estimators
import service
import slipcore
import stiction_client
from estimators import fitting
from service import cli
from slipcore import contact, forces
from slipcore.contact import reference
from tests.service.web import chromium

ROOT = Path(__file__).parents[1]
PAGES = [*sorted(ROOT.glob("*.md")), ROOT / "clients" / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def quoted_commands(page: Path) -> list[str]:
    """Commands that a page quotes, as code in a line or in a block, without what is behind a comment or a pipe."""
    text = page.read_text(encoding="utf-8")
    found = re.findall(r"`((?:stiction|make|python -m) [^`]+)`", text)
    found += re.findall(r"^(?: {4}|\$ )?(?:\S+=\S+ )*(?:\.venv/bin/)?((?:stiction|make|python -m) [^\n]+)", text, re.M)
    return [re.split(r"\s+(?:#|\||&|2>)", line)[0].strip() for line in found]


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


def walk(command: Any, path: str = "stiction") -> Iterator[tuple[str, Any]]:
    """Every command of the command line."""
    if hasattr(command, "commands"):
        for name, inner in command.commands.items():
            yield from walk(inner, f"{path} {name}")
    else:
        yield path, command


COMMANDS = {
    path: {option for parameter in command.params for option in parameter.opts} | {"--help"}
    for path, command in walk(typer.main.get_command(cli.app))
}
QUOTED = sorted({line for page in PAGES for line in quoted_commands(page)})


@pytest.mark.parametrize("command", COMMANDS)
def test_each_command_is_documented(command: str) -> None:
    page = (ROOT / "docs" / "cli.md").read_text(encoding="utf-8")
    *group, last = command.removeprefix("stiction ").split()
    named = rf"`stiction {' '.join(group)} ?[\w|\\]*\b{last}\b" if group else rf"`stiction {last}\b"
    assert re.search(named, page)


def test_each_option_says_what_it_is_for() -> None:
    silent = [
        f"{path} {parameter.name}"
        for path, command in walk(typer.main.get_command(cli.app))
        for parameter in command.params
        if not getattr(parameter, "help", None)
    ]
    assert silent == []


@pytest.mark.parametrize("line", [line for line in QUOTED if re.match("stiction [a-z]", line)])
def test_a_quoted_command_exists_with_its_options(line: str) -> None:
    words = line.split()
    name = " ".join(words[:3]) if " ".join(words[:3]) in COMMANDS else " ".join(words[:2])
    if "|" in line and name not in COMMANDS:  # a group with several of its commands: `stiction jobs list|cancel`
        group, choices = words[1], words[2].replace("\\", "").split("|")
        assert {f"stiction {group} {choice}" for choice in choices} <= set(COMMANDS)
        return
    assert name in COMMANDS or any(known.startswith(f"{name} ") for known in COMMANDS)
    given = {word.split("=")[0] for word in words if re.fullmatch(r"--[a-z-]+(=.*)?", word)}
    assert given <= COMMANDS.get(name, given)


@pytest.mark.parametrize("line", [line for line in QUOTED if line.startswith("make ")])
def test_a_quoted_make_target_exists(line: str) -> None:
    targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.M)
    wanted = [word for word in line.split()[1:] if "=" not in word]
    assert set(wanted) <= set(targets)


@pytest.mark.parametrize("line", [line for line in QUOTED if line.startswith("python -m ")])
def test_a_quoted_module_exists(line: str) -> None:
    assert importlib.util.find_spec(line.split()[2])


def test_before_a_commit_runs_what_lint_and_types_run() -> None:
    recipe = (ROOT / "Makefile").read_text().split("\nlint:")[1].split("\nunit:")[0]
    hooks = re.findall(r"entry: \.venv/bin/([^,]+),", (ROOT / ".pre-commit-config.yaml").read_text())
    assert hooks == re.findall(r"^\t\$\(BIN\)/(.+)$", recipe, re.M)


def test_each_metric_is_documented_and_nothing_else_is() -> None:
    page = (ROOT / "docs" / "operations.md").read_text(encoding="utf-8")
    source = (ROOT / "service" / "observability" / "metrics.py").read_text(encoding="utf-8")
    rows = "".join(line for line in page.splitlines() if line.startswith("| `stiction_"))
    named = set(re.findall(r"`(stiction_\w+)`", rows))
    assert named == set(re.findall(r'"(stiction_\w+)"', source))


@pytest.mark.parametrize(("page", "methods"), [("detector", [*slipcore.METHODS]), ("estimators", [*fitting.METHODS])])
def test_each_method_is_documented(page: str, methods: list[str]) -> None:
    text = (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
    assert [method for method in methods if f"`{method}`" not in text and f'"{method}"' not in text] == []


@pytest.mark.parametrize(
    "module", [slipcore, contact, reference, forces, estimators, stiction_client], ids=lambda m: m.__name__
)
def test_each_public_name_is_in_the_reference_with_a_docstring(module: ModuleType) -> None:
    assert f"::: {module.__name__}\n" in (ROOT / "docs" / "reference.md").read_text(encoding="utf-8")
    names = getattr(module, "__all__", [])
    made = [(name, getattr(module, name)) for name in names]
    assert [name for name, value in made if isinstance(value, type | FunctionType) and not value.__doc__] == []


def test_every_page_is_in_the_navigation_of_the_site() -> None:
    listed = set(re.findall(r": (\S+\.md)$", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"), re.M))
    pages = {page.name for page in PAGES if page.parent.name != "clients"}
    assert listed == pages


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--quiet", "--strict", "--site-dir", folder]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    return folder


def test_the_site_is_built_without_a_warning_and_asks_no_other_host(site: Path) -> None:
    html = "".join(page.read_text(encoding="utf-8") for page in site.rglob("*.html"))
    assert "slipcore.detect_slip" in html
    assert re.findall(r"<script[^>]+src=.https?://[^>]+|<link[^>]+href=.https?://[^>]+[.]css", html) == []
    assert "<code>stiction materials list|show</code>" in html.replace("&#124;", "|")


@pytest.mark.skipif(chromium.PROGRAM is None, reason="chromium is not installed: apt-get install chromium")
def test_the_site_is_searched_where_it_was_opened_as_a_file(site: Path, tmp_path: Path) -> None:
    with chromium.running(tmp_path) as tab:
        tab.go(f"file://{site}/faq.html")
        tab.run("document.querySelector('.md-search__input').focus()")
        tab.call("Input.insertText", text="quantile")
        assert tab.until("document.querySelectorAll('.md-search-result__item').length") > 1
        assert (tab.errors, [url for url in tab.requests if url.startswith("http")]) == ([], [])


@pytest.mark.parametrize("page", ["README", "docs/slip-benchmark"])
def test_figures_at_the_head_are_those_of_the_benchmark_s_table(page: str) -> None:
    table = re.search(r"<!-- table scores -->.*?<!-- end -->", (ROOT / "docs/slip-benchmark.md").read_text(), re.DOTALL)
    assert table
    head = next(line for line in (ROOT / f"{page}.md").read_text().splitlines() if "F1 of 0." in line)
    assert set(re.findall(r"0\.\d{3}", head)) <= set(re.findall(r"0\.\d{3}", table.group()))
