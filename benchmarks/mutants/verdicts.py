"""What became of each mutant, kept in a file after each trial: a run that was stopped goes on."""

import json
import math
import subprocess
import sys
from collections import defaultdict
from contextlib import nullcontext
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from benchmarks.mutants.edits import Edit
from benchmarks.mutants.nearby import Nearby, defined
from benchmarks.mutants.reach import Reach
from benchmarks.mutants.scratch_copy import ScratchCopy

BUDGET = 30.0
"""Seconds of tests that one mutant is tried with: as long as they took before, or as they compute, in place."""

PATIENCE = 6.0
"""How many times as long a test may take, before a mutant counts as one that never ends; without what it compiles."""

USUAL = 0.06
"""Seconds of a test that was never timed."""

LEAST = 8.0
"""Seconds that each test may take, however quick it was."""

WITH_KERNELS = ("slipcore/", "estimators/")
"""Where a changed file would have other processes compile all kernels that depend on it anew."""

SERVER = "postgresql"
"""In the names of tests that start a database server, in each trial anew."""

STARTS = {"served", "serving", "fleet"}
"""Fixtures that start servers with processes of their own: these tests come last."""

STARTS_ANEW = {"Popen", "subprocess", "running_postgresql"}
"""What tests call that start programs, which load everything anew: none of these is tried nearby."""

LIBRARIES = """
numpy scipy.fft scipy.optimize scipy.sparse scipy.spatial scipy.special scipy.stats numba pandas statsmodels.api emcee
sqlalchemy.orm sqlalchemy.dialects.postgresql alembic.command obstore
fastapi.testclient uvicorn httpx pydantic_settings typer rich msgspec jinja2 prometheus_client hypothesis
"""
"""What trials share, so that none of them loads it."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """How a mutant was found, or that it was not."""

    key: str
    line: int
    by: str
    """The first test that failed, "time limit", or nothing."""

    tests: int
    """How many tests run the changed code."""

    left_out: int
    """How many of these were more than a trial has time for."""

    seconds: float

    @property
    def is_killed(self) -> bool:
        """Whether a test noticed."""
        return bool(self.by)


def known(path: Path, *, at_first_sight: bool = False) -> dict[str, Verdict]:
    """The verdicts of a file, by the key of their edits; of each the last counts, or the first."""
    if not path.exists():
        return {}
    told = [Verdict(**json.loads(line)) for line in path.read_text().splitlines()]
    return {verdict.key: verdict for verdict in (reversed(told) if at_first_sight else told)}


def append(path: Path, verdict: Verdict) -> None:
    """Add a verdict to the file."""
    with path.open("a") as file:
        file.write(json.dumps(asdict(verdict)) + "\n")


class Court:
    """Tries mutants in a copy, one at a time; where it can, in place, with all modules and tests loaded once."""

    def __init__(
        self,
        copy: ScratchCopy,
        paths: list[str],
        libraries: str = LIBRARIES,
        least: float = LEAST,
        budget: float = BUDGET,
        in_place: bool = False,
    ) -> None:
        self._copy, self._least, self._budget = copy, least, budget
        self._nearby = Nearby(copy.root, paths)
        self._reach = Reach(copy.data, copy.covered, copy.root, paths) if copy.data.exists() else None
        self._durations: dict[str, float] = json.loads(copy.durations.read_text()) if copy.durations.exists() else {}
        self._importing = Runner(copy, copy.kernels.with_name("kernels-of-mutant"), libraries.split())
        self._collected = Runner(copy, copy.kernels, ["--collected"]) if in_place else None
        self._names: dict[str, list[str]] = self._collected.read() if self._collected else {}

    def try_mutant(self, edit: Edit) -> Verdict:
        """Run the tests that reach an edit: in place if that tells, and otherwise by a new import of all modules."""
        return self.try_in_place(edit) or self._try(edit, importing=True)

    def try_in_place(self, edit: Edit) -> Verdict | None:
        """The same without what takes longest: none where an import is needed."""
        return self._try(edit) if self._collected else None

    def try_quickly(self, edit: Edit) -> Verdict | None:
        """The same for what need not even be compiled."""
        return self._try(edit, is_quick=True) if self._collected else None

    def _try(self, edit: Edit, *, importing: bool = False, is_quick: bool = False) -> Verdict | None:
        """A test that fails without the edit as well does not count."""
        reached = self._tests_of(edit)
        spent, unsteady = 0.0, set[str]()
        while True:
            tests = self._chosen(edit, reached - unsteady, self._budget if importing else math.inf)
            told = self._ask(edit, tests, importing=importing, is_quick=is_quick)
            spent += told["seconds"]
            if not importing and told["needs_import"]:
                return None
            if not told["failed"] or not (fails := self._fails_anyway(edit, tests, told["failed"], importing)):
                break
            print(f"does not count, since it fails without a change: {fails}", file=sys.stderr, flush=True)
            unsteady.add(fails)
        by = "time limit" if told["out_of_time"] else told["failed"]
        return Verdict(edit.key, edit.start[0], by, len(reached), len(reached) - len(tests), round(spent, 1))

    def close(self) -> None:
        """End the processes that run trials, and keep what tests took."""
        self._copy.durations.write_text(json.dumps(self._durations, indent=0))
        self._importing.close()
        if self._collected:
            self._collected.close()

    def _tests_of(self, edit: Edit) -> set[str]:
        """The tests that run the changed code; while nothing is known of that, those of the files nearby."""
        if self._reach is not None:
            return self._reach.of(edit)
        files = set(self._nearby.files(edit.path))
        tests = self._names or self._copy.collected()
        return {test for test in tests if _file(test) in files and not self._calls(test, STARTS_ANEW)}

    def _chosen(self, edit: Edit, tests: set[str], budget: float) -> list[str]:
        """Tests of ``budget`` s in all, as long as they took before: first those that name what is changed or something
        of its module, then others of the files nearby, then the package's in quick files; what starts servers at last.
        """
        cost: dict[str, float] = defaultdict(float)
        for test in tests:
            cost[_file(test)] += self._durations.get(test, USUAL)
        package = edit.path.split("/")[0]
        changed, public = set(edit.scope.split(".")), defined(self._copy.root / edit.path)
        near = {file: place for place, file in enumerate(self._nearby.files(edit.path))}
        files = sorted(cost, key=lambda file: (near.get(file, len(near)), file.split("/")[1] != package, cost[file]))

        def rank(test: str) -> tuple[bool, int, int, float, str]:
            names = set(self._names.get(test, ()))
            distance = 0 if names & changed else 1 if names & public else 2
            return (
                self._calls(test, STARTS | STARTS_ANEW),
                distance,
                files.index(_file(test)),
                self._durations.get(test, USUAL),
                test,
            )

        chosen, spent = [], 0.0
        for test in sorted(tests, key=rank):
            spent += self._durations.get(test, USUAL)
            if chosen and spent > budget:
                continue
            chosen.append(test)
        return chosen

    def _calls(self, test: str, names: set[str]) -> bool:
        return SERVER in test or not names.isdisjoint(self._names.get(test, ()))

    def _fails_anyway(self, edit: Edit, tests: list[str], failed: str, importing: bool) -> str:
        """The first of the tests, as far as they were run, that fails without the edit, tried in the same way."""
        last = tests.index(failed) if failed in tests else 0
        again = self._ask(edit.undone(), tests[: last + 1], importing=importing)
        return str(again["failed"] or ("" if again["ran"] else tests[0]))

    def _ask(self, edit: Edit, tests: list[str], *, importing: bool = False, is_quick: bool = False) -> dict[str, Any]:
        """In place if that is possible, and by a new import of all modules if not."""
        told: dict[str, Any] = {"failed": "", "out_of_time": False, "ran": 0, "seconds": 0.0, "needs_import": importing}
        if not tests:
            return told
        limits = {test: self._least + PATIENCE * self._durations.get(test, USUAL) for test in tests}
        if self._collected and not importing:
            source = (self._copy.root / edit.path).read_bytes()
            request: dict[str, Any] = {
                "path": edit.path,
                "before": source.decode(),
                "after": edit.apply(source).decode(),
            }
            request |= {"is_quick": is_quick, "budget": math.inf if edit.new == edit.old else self._budget}
            with nullcontext() if edit.path.startswith(WITH_KERNELS) else self._copy.changed(edit):
                told |= self._collected.ask({"limits": limits} | request)
        elif importing:
            with self._copy.changed(edit):
                told |= self._importing.ask({"limits": limits})
        self._note(told)
        return told

    def _note(self, told: dict[str, Any]) -> None:
        """Remember what tests took that did not fail."""
        for test, seconds in told.get("durations", {}).items():
            if seconds and test != told["failed"]:
                self._durations[test] = min(seconds, self._durations.get(test, seconds))


class Runner:
    """A process that runs trials."""

    def __init__(self, copy: ScratchCopy, kernels: Path, arguments: list[str]) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-P", str(Path(__file__).with_name("trials.py")), *arguments],
            cwd=copy.root,
            env=copy.environment(kernels),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        """The verdict of one trial."""
        assert self._process.stdin is not None
        print(json.dumps(request), file=self._process.stdin, flush=True)
        return dict(self.read())

    def read(self) -> Any:
        """What the process says next."""
        assert self._process.stdout is not None
        return json.loads(self._process.stdout.readline())

    def close(self) -> None:
        """End the process."""
        self._process.communicate()


def _file(test: str) -> str:
    return test.partition("::")[0]
