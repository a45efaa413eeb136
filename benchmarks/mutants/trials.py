"""Runs chosen tests in a copy of the repository, each time in a new process that has the libraries loaded.

Started as a file, with the names of libraries as arguments and the copy as its working folder: no module of ours is
imported before a trial, so that each trial sees the copy as it is then. Reads one request a line (tests, each with the
seconds that it may take) and answers each by one line of JSON.
"""

import contextlib
import importlib
import json
import os
import resource
import signal
import sys
import tempfile
import time
from itertools import groupby
from pathlib import Path
from typing import Any

import pytest

COLLECTING = 120.0
"""Seconds in which the tests of a file are found."""

CLOCKS = {signal.ITIMER_VIRTUAL: 1.0, signal.ITIMER_REAL: 8.0}
"""What ends a test that takes too long, each as a multiple of its limit: computing, or waiting on a shared machine."""

MEMORY = 12 * 2**30
"""Bytes of address space: a mutant that never stops allocating fails before the machine runs out."""


class Chosen:
    """Keeps the wished tests, stops the process if one takes too long, and remembers the first that fails."""

    def __init__(self, limits: dict[str, float], running: Path) -> None:
        self._limits, self._running = limits, running
        self.ran, self.failed = 0, ""

    def pytest_sessionstart(self) -> None:
        """A module may hang when it is imported."""
        self._begin("", COLLECTING)

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        """Note which test runs, for the case that it never ends."""
        self._begin(nodeid, self._limits[nodeid])

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Leave the others out."""
        items[:] = [item for item in items if item.nodeid in self._limits]

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Count, and keep the first failure."""
        self.ran += report.when == "call"
        if report.failed and not self.failed:
            self.failed = report.nodeid

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """A module that cannot be imported fails as well."""
        if report.failed and not self.failed:
            self.failed = report.nodeid or "collection"

    def _begin(self, test: str, limit: float) -> None:
        self._running.write_text(test)
        for clock, times in CLOCKS.items():
            signal.setitimer(clock, times * limit)


def main() -> None:
    """Answer requests until there are no more."""
    for library in sys.argv[1:]:
        importlib.import_module(library)
    for line in sys.stdin:
        request = json.loads(line)
        print(json.dumps(_trial(request["limits"])), flush=True)


def _trial(limits: dict[str, float]) -> dict[str, Any]:
    """The verdict on the copy as it is: the test that failed, one that took too long, or neither."""
    began = time.monotonic()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        answer, running = Path(folder, "answer.json"), Path(folder, "running.txt")
        process = os.fork()
        if not process:
            _run(Chosen(limits, running), limits, answer)
        is_over = _wait(process, began + 2.0 * sum(limits.values()) + 600.0)
        told = {"ran": 0, "failed": (running.read_text() or "collection") if running.exists() else "crash"}
        if answer.exists():
            told = json.loads(answer.read_text())
    return {**told, "out_of_time": not is_over, "seconds": round(time.monotonic() - began, 1)}


def _run(chosen: Chosen, limits: dict[str, float], answer: Path) -> None:
    """The trial itself, in its own group of processes: file by file, so that no more are imported than are needed."""
    os.setsid()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    with answer.with_name("output.txt").open("wb") as output:
        os.dup2(output.fileno(), 1)
        os.dup2(output.fileno(), 2)
    _leave_compiling_out()
    options = ["-x", "-q", "-p", "no:xdist", "-p", "no:cacheprovider", f"--basetemp={answer.with_name('tests')}"]
    options += ["-W", "ignore::pytest.PytestAssertRewriteWarning"]  # of plugins that are loaded already
    for file, _ in groupby(limits, lambda test: test.partition("::")[0]):
        status: int | None = None
        with contextlib.suppress(BaseException):
            status = int(pytest.main([*options, file], plugins=[chosen]))
        if status not in {0, 5} or chosen.failed:
            chosen.failed = chosen.failed or file
            break
    answer.write_text(json.dumps({"ran": chosen.ran, "failed": chosen.failed}))
    os._exit(0)


def _leave_compiling_out() -> None:
    """Stop the clocks while numba compiles: a changed kernel takes a hundred times as long as it does from its file."""
    if "numba" not in sys.modules:
        return
    from numba.core import event

    class Pause(event.Listener):  # type: ignore[misc]
        depth = 0

        def on_start(self, _event: object) -> None:
            if not self.depth:
                self.left = {clock: signal.setitimer(clock, 0.0)[0] for clock in CLOCKS}
            self.depth += 1

        def on_end(self, _event: object) -> None:
            self.depth -= 1
            if not self.depth:
                for clock, left in self.left.items():
                    signal.setitimer(clock, left)

    event.register("numba:compile", Pause())


def _wait(process: int, deadline: float) -> bool:
    """Whether a trial ends by itself; nothing of it is left."""
    done = status = 0
    while not done and time.monotonic() < deadline:
        done, status = os.waitpid(process, os.WNOHANG)
        time.sleep(0.02)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process, signal.SIGKILL)
    if not done:
        os.waitpid(process, 0)
    return bool(done) and not (os.WIFSIGNALED(status) and os.WTERMSIG(status) in {signal.SIGVTALRM, signal.SIGALRM})


if __name__ == "__main__":
    main()
