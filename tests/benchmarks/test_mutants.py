"""Mutation testing itself: a tool that finds too little makes any tests look good."""

import json
import sqlite3
import subprocess
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest
from coverage.numbits import nums_to_numbits

from benchmarks.mutants import sample, verdicts
from benchmarks.mutants.__main__ import PAGE
from benchmarks.mutants.edits import Edit, edits
from benchmarks.mutants.nearby import Nearby
from benchmarks.mutants.page import tables
from benchmarks.mutants.reach import Reach
from benchmarks.mutants.scratch_copy import ScratchCopy
from benchmarks.mutants.trials import _names
from benchmarks.mutants.verdicts import Court, Verdict
from benchmarks.pages import renew

PROGRAM = '''\
"""A program."""

from typing import TYPE_CHECKING, cast

LIMIT = 3
if TYPE_CHECKING:
    UNUSED = 7


def is_large(x: "int | None") -> bool:
    return x is not None and x > LIMIT


def total(xs: list[int], start=0):
    """Adds up."""
    while xs:
        xs, start = xs[1:], start + xs[0]
    return cast("dict[int, int]", start)


def large_total(xs):
    return is_large(total(xs))
'''

TESTS = """\
from slipcore import program


def test_is_large():
    assert program.is_large(5)
    assert not program.is_large(2)


def test_total():
    assert program.total([1, 2]) == 3


def test_flaky():
    import pathlib
    mark = pathlib.Path("mark")
    mark.touch()
    assert program.is_large(4) and False
"""


KERNELS = """\
from numba import njit

def _doubled(x):
    return 2 * x

FACTOR = _doubled(8)

@njit
def square(x):
    return x * x

@njit
def fourth_power(x):
    return square(square(x))

def scaled(x):
    def inner():
        return FACTOR + x
    return inner()
"""

KERNEL_TESTS = """\
from slipcore import kernels


def test_fourth_power():
    assert kernels.fourth_power(2.0) == 16.0


def test_scaled():
    assert kernels.scaled(1) == 17
"""


@pytest.fixture
def copy(tmp_path: Path) -> ScratchCopy:
    """Of a small repository, as covered: ``test_total`` runs a loop, the others ``is_large``."""
    return copied(tmp_path)


def copied(folder: Path) -> ScratchCopy:
    checkout = folder / "checkout"
    for name, text in {
        "slipcore/__init__.py": "",
        "slipcore/program.py": PROGRAM,
        "tests/slipcore/test_program.py": TESTS,
        "pytest.ini": "[pytest]\naddopts = -p no:schemathesis -p no:anyio -p no:hypothesispytest -p no:cov",
        ".gitignore": "ignored.py",
        "ignored.py": "",
    }.items():
        (checkout / name).parent.mkdir(parents=True, exist_ok=True)
        (checkout / name).write_text(text)
    for package in ("estimators", "db", "service", "clients"):
        (checkout / package).mkdir()
        (checkout / package / "__init__.py").touch()
    subprocess.run(["git", "init", "--quiet"], cwd=checkout, check=True)
    copy = ScratchCopy(folder / "work", checkout)
    copy.root.mkdir(parents=True)
    copy.refresh()
    copy.keep()
    _cover(copy.data, {"test_is_large": [11], "test_flaky": [11], "test_total": [16, 17, 18]})
    copy.durations.write_text(json.dumps({"tests/slipcore/test_program.py::test_total": 0.1}))
    return copy


def _cover(data: Path, lines: dict[str, list[int]]) -> None:
    with closing(sqlite3.connect(data)) as database, database:
        database.execute("CREATE TABLE file (id, path)")
        database.execute("CREATE TABLE context (id, context)")
        database.execute("CREATE TABLE line_bits (file_id, context_id, numbits)")
        database.execute("INSERT INTO file VALUES (1, '/elsewhere/slipcore/program.py')")
        database.execute("INSERT INTO context VALUES (0, '')")
        database.execute("INSERT INTO line_bits VALUES (1, 0, ?)", [nums_to_numbits(range(1, 22))])
        for number, (test, own) in enumerate(lines.items(), 1):
            database.execute(
                "INSERT INTO context VALUES (?, ?)", [number, f"tests/slipcore/test_program.py::{test}|run"]
            )
            database.execute("INSERT INTO line_bits VALUES (1, ?, ?)", [number, nums_to_numbits(own)])


@pytest.fixture
def court(copy: ScratchCopy) -> Iterator[Court]:
    with closing(Court(copy, ["slipcore/program.py"], libraries="", least=0.5)) as court:
        yield court


def change(copy: ScratchCopy, old: str, new: str) -> Edit:
    return next(e for e in edits(copy.root, "slipcore/program.py") if (e.old, e.new) == (old, new))


def test_what_decides_is_changed_and_nothing_else(copy: ScratchCopy) -> None:
    found = {(edit.start[0], edit.old, edit.new) for edit in edits(copy.root, "slipcore/program.py")}
    assert found == {
        (5, "3", "4"),
        (11, "x is not None and x > LIMIT", "None"),
        (11, "is not", "is"),
        (11, "and", "or"),
        (11, ">", ">="),
        (11, ">", "<="),
        (14, "0", "1"),
        (17, "1", "2"),
        (17, "+", "-"),
        (17, "0", "1"),
        (18, 'cast("dict[int, int]", start)', "None"),
        (22, "is_large(total(xs))", "None"),
    }


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("def f(a):\n    return a[-1]\n", "def f(a):\n    return a[1]\n"),
        ("def f(a):\n    if not a:\n        a.b()\n", "def f(a):\n    if a:\n        a.b()\n"),
        ("def f(a):\n    if a:\n        a.b()\n", "def f(a):\n    if not (a):\n        a.b()\n"),
        ("def f(a):\n    a.b()\n", "def f(a):\n    pass\n"),
        ("x = 'ä' * (2) # +\n", "x = 'ä' / (2) # +\n"),
        ("x = (a  # a + b\n     + b)\n", "x = (a  # a + b\n     - b)\n"),
        ("x = 0.0\n", "x = 1.0\n"),
        ("x = 2.0\n", "x = 3.0\n"),
        ("x = True\n", "x = False\n"),
        ("x += y\n", "x -= y\n"),
        ("for x in y:\n    break\n", "for x in y:\n    continue\n"),
        ("x = a not  in b\n", "x = a in b\n"),
    ],
)
def test_a_change_is_of_its_place_alone(tmp_path: Path, before: str, after: str) -> None:
    (tmp_path / "a.py").write_text(before)
    assert after.encode() in [edit.apply(before.encode()) for edit in edits(tmp_path, "a.py")]


def test_an_edit_is_known_again_where_lines_before_it_changed(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("x = 1 + 1\n")
    before = [edit.key for edit in edits(tmp_path, "a.py")]
    (tmp_path / "a.py").write_text("import b\nx = 1 + 1\n")
    assert [edit.key for edit in edits(tmp_path, "a.py")] == before
    assert len(set(before)) == 3


def test_packages_have_their_share_and_a_seed_draws_the_same(copy: ScratchCopy) -> None:
    assert sample.shares({"a": 30, "b": 10}, 5) == {"a": 4, "b": 2}
    drawn = sample.draw(copy.root, 4, seed=1)
    assert len(drawn) == 4
    assert drawn == sample.draw(copy.root, 4, seed=1)
    assert drawn != sample.draw(copy.root, 4, seed=2)
    more = sample.draw(copy.root, 8, seed=1)
    assert set(drawn) < set(more)
    assert sample.draw(copy.root, 4, seed=1, packages=["slipcore"]) == drawn


def test_tests_reach_a_line_directly_or_through_what_uses_it(copy: ScratchCopy) -> None:
    reach = Reach(copy.data, copy.covered, copy.root, ["slipcore/program.py"])
    large = {f"tests/slipcore/test_program.py::{name}" for name in ("test_is_large", "test_flaky")}
    total = {"tests/slipcore/test_program.py::test_total"}
    assert reach.of(change(copy, "and", "or")) == large
    assert reach.of(change(copy, "3", "4")) == large  # a constant: by the line that reads it
    assert reach.of(change(copy, "+", "-")) == total
    default = next(e for e in edits(copy.root, "slipcore/program.py") if e.start[0] == 14)
    assert reach.of(default) == total
    assert reach.of(change(copy, "is_large(total(xs))", "None")) == set()


def test_lines_that_moved_since_are_found(copy: ScratchCopy) -> None:
    path = copy.root / "slipcore/program.py"
    path.write_text(path.read_text().replace("LIMIT = 3\n", "# The largest of small ones.\nLIMIT = 3\n"))
    reach = Reach(copy.data, copy.covered, copy.root, ["slipcore/program.py"])
    assert len(reach.of(change(copy, "and", "or"))) == 2


def test_a_mutant_is_killed_survives_or_never_ends(copy: ScratchCopy, court: Court) -> None:
    killed = court.try_mutant(change(copy, "and", "or"))
    assert killed.is_killed
    assert killed.by == "tests/slipcore/test_program.py::test_is_large"
    assert not court.try_mutant(change(copy, ">", ">=")).is_killed
    endless = replace(change(copy, "1", "2"), new="0")
    assert court.try_mutant(endless).by == "time limit"
    assert not court.try_mutant(change(copy, "is_large(total(xs))", "None")).is_killed
    assert (copy.root / "slipcore/program.py").read_text() == PROGRAM


def test_no_bytecode_of_a_change_is_taken_for_that_of_the_next(copy: ScratchCopy) -> None:
    """Python knows it by the size of the source and the second of its last change."""
    path, stamps = copy.root / "slipcore/program.py", list[int]()
    before = path.stat().st_mtime_ns
    for new in ("4", "5", "6"):
        with copy.changed(replace(change(copy, "3", "4"), new=new)):
            stamps.append(int(path.stat().st_mtime))
    assert len(set(stamps)) == 3
    assert path.stat().st_mtime_ns == before


def test_where_nothing_is_known_of_lines_the_files_nearby_are_tried(copy: ScratchCopy) -> None:
    copy.data.unlink()
    with closing(Court(copy, ["slipcore/program.py"], libraries="", least=2.0)) as court:
        verdict = court.try_mutant(change(copy, "and", "or"))
    assert verdict.by == "tests/slipcore/test_program.py::test_is_large"
    assert verdict.tests == 3


@pytest.mark.parametrize(
    ("module", "files"),
    [
        ("slipcore/shape/cone.py", ["shape/test_cone.py", "test_names.py", "shape/test_solver.py"]),  # its own first
        (
            "slipcore/shape/hidden.py",
            ["shape/test_solver.py", "shape/test_cone.py"],
        ),  # no test imports it; what uses it has one
        ("slipcore/shape/unused.py", ["shape/test_cone.py", "shape/test_solver.py"]),
        ("slipcore/empty/unused.py", ["shape/test_cone.py", "shape/test_solver.py", "test_names.py"]),
    ],
)
def test_files_about_a_module_are_found_nearest_first(tmp_path: Path, module: str, files: list[str]) -> None:
    sources = {
        "slipcore/shape/cone.py": "def volume(): ...\n",
        "slipcore/shape/hidden.py": "",
        "slipcore/shape/unused.py": "",
        "slipcore/empty/unused.py": "",
        "slipcore/shape/solver.py": "from slipcore.shape import hidden\n",
        "tests/slipcore/shape/test_cone.py": "from slipcore.shape.cone import volume\n",
        "tests/slipcore/shape/test_solver.py": "import slipcore.shape.solver\n",
        "tests/slipcore/test_names.py": "from slipcore.shape import volume\n",
        "tests/db/test_cone.py": "",
    }
    for name, text in sources.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    nearby = Nearby(tmp_path, [name for name in sources if not name.startswith("tests")])
    assert nearby.files(module) == [f"tests/slipcore/{file}" for file in files]


@pytest.fixture(scope="module")
def in_place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[ScratchCopy, Court]]:
    """A copy with kernels and its court, for all changes: each is tried in a process of its own, and none stays."""
    copy = copied(tmp_path_factory.mktemp("in place"))
    (copy.root / "slipcore/kernels.py").write_text(KERNELS)
    (copy.root / "tests/slipcore/test_kernels.py").write_text(KERNEL_TESTS)
    copy.data.unlink()
    paths = ["slipcore/kernels.py", "slipcore/program.py"]
    with closing(Court(copy, paths, libraries="", least=2.0, in_place=True)) as court:
        yield copy, court


@pytest.mark.parametrize(
    ("path", "old", "new", "test"),
    [
        ("program", "and", "or", "test_program.py::test_is_large"),
        pytest.param("program", ">", ">=", "", marks=pytest.mark.long),
        ("program", "3", "4", ""),  # a constant of a module: imported anew
        pytest.param(  # of a function that ran at import
            "kernels", "*", "/", "test_kernels.py::test_scaled", marks=pytest.mark.long
        ),
        ("kernels", "x * x", "None", "test_kernels.py::test_fourth_power"),  # compiled, with what calls it
        pytest.param(  # of a function inside of another
            "kernels", "+", "-", "test_kernels.py::test_scaled", marks=pytest.mark.long
        ),
    ],
)
def test_a_change_made_in_place_is_noticed_as_one_that_is_imported(
    in_place: tuple[ScratchCopy, Court], path: str, old: str, new: str, test: str
) -> None:
    copy, court = in_place
    edit = next(e for e in edits(copy.root, f"slipcore/{path}.py") if (e.old, e.new) == (old, new))
    assert court.try_mutant(edit).by == (test and f"tests/slipcore/{test}")
    assert not court.try_mutant(edit.undone()).is_killed


def test_in_place_all_tests_are_tried_until_their_time_is_used(copy: ScratchCopy) -> None:
    copy.data.unlink()
    tests = [f"tests/slipcore/test_program.py::{name}" for name in ("test_is_large", "test_total", "test_flaky")]
    copy.durations.write_text(json.dumps(dict.fromkeys(tests, 3600.0)))  # on a machine that was busy
    with closing(Court(copy, ["slipcore/program.py"], libraries="", least=2.0, in_place=True)) as court:
        verdict = court.try_in_place(change(copy, ">", ">="))
        assert verdict is not None
        assert (verdict.by, verdict.tests, verdict.left_out) == ("", 3, 1)  # the one that fails without a change
        assert len(court._chosen(change(copy, ">", ">="), set(tests), verdicts.BUDGET)) == 1


def test_a_run_that_was_stopped_goes_on(tmp_path: Path) -> None:
    path = tmp_path / "verdicts.jsonl"
    first, second = (Verdict("a", 1, by, 2, 0, 0.5) for by in ("", "tests/test_a.py::test_b"))
    assert verdicts.known(path) == {}
    verdicts.append(path, first)
    verdicts.append(path, second)
    assert verdicts.known(path) == {"a": second}
    assert verdicts.known(path, at_first_sight=True) == {"a": first}
    assert json.loads(path.read_text().splitlines()[0])["by"] == ""


def test_the_copy_has_what_the_checkout_has(copy: ScratchCopy, tmp_path: Path) -> None:
    assert not (copy.root / "ignored.py").exists()
    (tmp_path / "checkout/slipcore/program.py").unlink()
    (tmp_path / "checkout/slipcore/other.py").write_text("x = 1\n")
    copy.refresh()
    assert {path.name for path in (copy.root / "slipcore").glob("*.py")} == {"__init__.py", "other.py"}


def test_the_page_tells_score_and_survivors(copy: ScratchCopy) -> None:
    killed, explained, missed, waiting = (
        change(copy, *words) for words in (("and", "or"), (">", ">="), ("+", "-"), ("3", "4"))
    )
    drawn = [killed, explained, missed, waiting]
    found = {edit.key: Verdict(edit.key, 1, "a test" if edit is killed else "", 1, 0, 0.1) for edit in drawn[:3]}
    made = tables(drawn, found, {explained.key: "the limit itself is never met"}, {"slipcore": 20})
    assert "| slipcore | 20 | 4 | 3 | 1 | 1 | 1 | 50.0% | 9.5% to 90.5% |" in made["score"]
    assert made["explained"].endswith("x > LIMIT` | the limit itself is never met |")
    assert "`+` → `-`" in made["survivors"]
    assert "`>` → `>=`" not in made["survivors"]


def test_a_new_page_has_a_place_for_each_table(tmp_path: Path) -> None:
    page = tmp_path / "mutants.md"
    page.write_text(PAGE.read_text())
    renew(page, tables([], {}, {}, {"slipcore": 20}))
    assert "| slipcore | 20 | 0 | 0 | 0 | 0 | 0 | – | – |" in page.read_text()


@pytest.mark.long
def test_a_test_uses_what_functions_of_its_file_use() -> None:
    """``change`` asks for ``edits``, which the test itself does not name."""
    test = test_the_page_tells_score_and_survivors
    item = SimpleNamespace(_fixtureinfo=SimpleNamespace(name2fixturedefs={}), function=test)
    assert "edits" not in test.__code__.co_names
    assert {"change", "edits", "tables"} <= set(_names(cast("pytest.Item", item)))
