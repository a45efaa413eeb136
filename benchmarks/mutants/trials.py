"""Runs chosen tests in a copy of the repository, each time in a new process that has the libraries loaded.

Started as a file, with the names of libraries as arguments and the copy as its working folder: no module of ours is
imported before a trial, so that each trial sees the copy as it is then. Reads one request a line (tests, seconds of
processor time) and answers each by one line of JSON.
"""

import contextlib
import importlib
import json
import math
import os
import resource
import signal
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import pytest

STANDSTILL = 20.0
"""Seconds that a trial may take for each of processor time that it may use: it may wait, and share the machine."""


class Chosen:
    """Keeps the wished tests, and remembers the first that fails."""

    def __init__(self, tests: list[str]) -> None:
        self._tests = set(tests)
        self.ran, self.failed = 0, ""

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Leave the others out."""
        items[:] = [item for item in items if item.nodeid in self._tests]

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Count, and keep the first failure."""
        self.ran += report.when == "call"
        if report.failed and not self.failed:
            self.failed = report.nodeid

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """A module that cannot be imported fails as well."""
        if report.failed and not self.failed:
            self.failed = report.nodeid or "collection"


def main() -> None:
    """Answer requests until there are no more."""
    for library in sys.argv[1:]:
        importlib.import_module(library)
    for line in sys.stdin:
        request = json.loads(line)
        print(json.dumps(_trial(request["tests"], request["seconds"])), flush=True)


def _trial(tests: list[str], seconds: float) -> dict[str, Any]:
    """The verdict on the copy as it is: the test that failed, a time limit, or neither."""
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        answer = Path(folder, "answer.json")
        process = os.fork()
        if not process:
            resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(seconds), math.ceil(seconds) + 1))
            _run(tests, answer, Path(folder))
        is_over = _wait(process, began + STANDSTILL * seconds)
        told = (
            json.loads(answer.read_text()) if answer.exists() else {"ran": 0, "failed": "" if not is_over else "crash"}
        )
    return {**told, "out_of_time": not is_over, "seconds": round(time.monotonic() - began, 1)}


def _run(tests: list[str], answer: Path, folder: Path) -> None:
    """The trial itself, in its own group of processes: file by file, so that no more are imported than are needed."""
    os.setsid()
    with (folder / "output.txt").open("wb") as output:
        os.dup2(output.fileno(), 1)
        os.dup2(output.fileno(), 2)
    chosen = Chosen(tests)
    options = ["-x", "-q", "-p", "no:xdist", "-p", "no:cacheprovider", f"--basetemp={folder / 'tests'}"]
    options += ["-W", "ignore::pytest.PytestAssertRewriteWarning"]  # of plugins that are loaded already
    for file in dict.fromkeys(test.partition("::")[0] for test in tests):
        status: int | None = None
        with contextlib.suppress(BaseException):
            status = int(pytest.main([*options, file], plugins=[chosen]))
        if status not in {0, 5} or chosen.failed:
            chosen.failed = chosen.failed or file
            break
    answer.write_text(json.dumps({"ran": chosen.ran, "failed": chosen.failed}))
    os._exit(0)


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
    return bool(done) and not (os.WIFSIGNALED(status) and os.WTERMSIG(status) in {signal.SIGXCPU, signal.SIGKILL})


if __name__ == "__main__":
    main()
