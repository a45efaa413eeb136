"""What became of each mutant, kept in a file after each trial: a run that was stopped goes on."""

import json
import subprocess
import sys
from collections import defaultdict
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from benchmarks.mutants.edits import Edit
from benchmarks.mutants.nearby import Nearby
from benchmarks.mutants.reach import Reach
from benchmarks.mutants.scratch_copy import ScratchCopy

BUDGET = 60.0
"""Seconds of tests that one mutant is tried with, as long as they took when they were covered."""

PATIENCE = 10.0
"""How many times as long a test may take, before a mutant counts as one that never ends; without what it compiles."""

USUAL = 0.2
"""Seconds of a test that was never timed."""

LEAST = 15.0
"""Seconds that each test may take, however quick it was."""

SERVER = "postgresql"
"""In the names of tests that start a database server, in each trial anew."""

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


def known(path: Path) -> dict[str, Verdict]:
    """The verdicts of a file, by the key of their edits; the last of each counts."""
    if not path.exists():
        return {}
    return {verdict.key: verdict for line in path.read_text().splitlines() for verdict in [Verdict(**json.loads(line))]}


def append(path: Path, verdict: Verdict) -> None:
    """Add a verdict to the file."""
    with path.open("a") as file:
        file.write(json.dumps(asdict(verdict)) + "\n")


class Court:
    """Tries mutants in a copy, one at a time."""

    def __init__(self, copy: ScratchCopy, paths: list[str], libraries: str = LIBRARIES, least: float = LEAST) -> None:
        self._copy, self._least, self._nearby = copy, least, Nearby(copy.root, paths)
        self._reach = Reach(copy.data, copy.covered, copy.root, paths) if copy.data.exists() else None
        self._durations: dict[str, float] = json.loads(copy.durations.read_text()) if copy.durations.exists() else {}
        self._steady: dict[str, bool] = {}
        self._runner = subprocess.Popen(
            [sys.executable, "-P", str(Path(__file__).with_name("trials.py")), *libraries.split()],
            cwd=copy.root,
            env=copy.environment(copy.kernels.with_name("kernels-of-mutant")),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def try_mutant(self, edit: Edit) -> Verdict:
        """Run the tests that reach an edit; one that fails without the edit as well does not count."""
        reached = self._tests_of(edit)
        spent = 0.0
        while True:
            tests = self._chosen(edit, {test for test in reached if self._steady.get(test, True)})
            with self._copy.changed(edit):
                told = self._ask(tests)
            spent += told["seconds"]
            if not told["failed"] or self._is_steady(told["failed"] if "::" in told["failed"] else tests[0], edit):
                break
        by = "time limit" if told["out_of_time"] else told["failed"]
        return Verdict(edit.key, edit.start[0], by, len(reached), len(reached) - len(tests), round(spent, 1))

    def close(self) -> None:
        """End the process that runs trials."""
        self._runner.communicate()

    def _tests_of(self, edit: Edit) -> set[str]:
        """The tests that run the changed code; while nothing is known of that, quick ones of the files nearby."""
        if self._reach is not None:
            return self._reach.of(edit)
        files = set(self._nearby.files(edit.path))
        return {test for test in self._copy.collected() if _file(test) in files and SERVER not in test}

    def _chosen(self, edit: Edit, tests: set[str]) -> list[str]:
        """Tests as far as time allows: those nearby, then the package's in quick files; a database server's at last."""
        cost: dict[str, float] = defaultdict(float)
        for test in tests:
            cost[_file(test)] += self._durations.get(test, USUAL)
        package = edit.path.split("/")[0]
        near = {file: place for place, file in enumerate(self._nearby.files(edit.path))}
        files = sorted(cost, key=lambda file: (near.get(file, len(near)), file.split("/")[1] != package, cost[file]))

        def rank(test: str) -> tuple[bool, int, float, str]:
            return SERVER in test, files.index(_file(test)), self._durations.get(test, USUAL), test

        chosen, spent = [], 0.0
        for test in sorted(tests, key=rank):
            spent += self._durations.get(test, USUAL)
            if chosen and spent > BUDGET:
                break
            chosen.append(test)
        return chosen

    def _is_steady(self, test: str, edit: Edit) -> bool:
        """Whether a test passes in its time where nothing is changed; known once."""
        if test not in self._steady:
            with self._copy.changed(edit.undone()):
                told = self._ask([test])
            self._steady[test] = not told["failed"] and told["ran"] > 0
            if not self._steady[test]:
                print(f"does not count, since it fails without a change: {test}", file=sys.stderr, flush=True)
        return self._steady[test]

    def _ask(self, tests: list[str]) -> dict[str, Any]:
        if not tests:
            return {"failed": "", "out_of_time": False, "ran": 0, "seconds": 0.0}
        assert self._runner.stdin is not None
        assert self._runner.stdout is not None
        limits = {test: self._least + PATIENCE * self._durations.get(test, USUAL) for test in tests}
        print(json.dumps({"limits": limits}), file=self._runner.stdin, flush=True)
        return dict(json.loads(self._runner.stdout.readline()))


def _file(test: str) -> str:
    return test.partition("::")[0]
