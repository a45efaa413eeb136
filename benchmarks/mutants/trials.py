"""Runs chosen tests in a copy of the repository, each time in a new process that is forked from this one.

Started as a file, with the copy as its working folder. It reads one request a line (tests, each with the seconds that
it may take) and answers each by one line of JSON.

With names of libraries as arguments, these alone are loaded before, and none of our modules: each trial imports the
copy as it is then. With ``--collected`` all modules and tests are, and kernels: the first line of output names the
tests, and a request has the path of a file and its source before and after a change, which is made in place. Where
that is not the same as a new import, the answer is ``{"needs_import": true}``.
"""

import contextlib
import gc
import importlib
import json
import multiprocessing
import os
import re
import resource
import signal
import sys
import tempfile
import time
from collections.abc import Callable
from functools import cache, partial
from itertools import groupby
from pathlib import Path
from types import CodeType, FunctionType, SimpleNamespace
from typing import Any, TextIO

import pytest

COLLECTING = 120.0
"""Seconds in which the tests of a file are found."""

CLOCKS = {signal.ITIMER_VIRTUAL: 1.0, signal.ITIMER_REAL: 8.0}
"""What ends a test that takes too long, each as a multiple of its limit: computing, or waiting on a shared machine."""

PAUSE = 5.0
"""Seconds without a look at a trial, after which all processes were stopped meanwhile: the trial is made again."""

MEMORY = 16 * 2**30
"""Bytes of address space: a mutant that never stops allocating fails before the machine runs out."""

PACKAGES = ("slipcore", "estimators", "db", "service", "clients")
SHARED = ("-q", "--tb=no", "-p", "no:xdist", "-p", "no:cacheprovider")


class Chosen:
    """Keeps the wished tests, stops the process if one takes too long, and remembers the first that fails."""

    def __init__(self, limits: dict[str, float], running: Path) -> None:
        self._limits, self._running = limits, running
        self.ran, self.failed = 0, ""
        self.durations = dict.fromkeys(limits, 0.0)

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
        self.durations[report.nodeid] += report.duration
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


class Suite:
    """All tests, collected once, and the functions that they run."""

    def __init__(self, coverage: Any) -> None:
        self._coverage = coverage

    @pytest.hookimpl(tryfirst=True)
    def pytest_collection_finish(self) -> None:
        """Find the functions, before they are hidden from the garbage collector."""
        self._coverage.stop()
        data = self._coverage.get_data()
        from hypothesis.internal.conjecture import engine
        from in_place import Functions

        engine.MAX_SHRINKING_SECONDS = 0  # that there is a counterexample is enough
        self._functions = Functions({file: set(data.lines(file)) for file in data.measured_files()})

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Answer requests in place of running all tests."""
        _load_kernels(self._functions.kernels)
        _let_processes_fork()
        items = {item.nodeid: item for item in session.items}
        _say({name: _names(item) for name, item in items.items()})
        for line in sys.stdin:
            request = json.loads(line)
            sources = (request[name].encode() for name in ("before", "after"))
            changes = self._functions.changes(str(Path(request["path"]).resolve()), *sources)
            if changes is None or (request["is_quick"] and self._functions.compile(changes)):
                _say({"needs_import": True})
                continue
            change = partial(self._functions.make, changes)
            told = _trial(request["limits"], partial(_run_items, items, change, request["budget"]))
            _say({**told, "needs_import": not told["failed"] and self._functions.have_run(changes)})
        return True


def main() -> None:
    """Answer requests until there are no more."""
    _output()
    if sys.argv[1:] == ["--collected"]:
        _serve_collected()
        return
    for library in sys.argv[1:]:
        importlib.import_module(library)
    for line in sys.stdin:
        _say(_trial(json.loads(line)["limits"], _run_files))


def _serve_collected() -> None:
    from coverage import Coverage

    sys.path.append(str(Path(__file__).parent))
    seen = Coverage(data_file=None, config_file=False, source=[*PACKAGES], messages=False)
    seen.start()
    os.dup2(2, 1)
    pytest.main([*SHARED, "-s", "-p", "no:cov", "-m", "not long", "tests"], plugins=[Suite(seen)])


@cache
def _output() -> TextIO:
    """Where answers go, wherever what is printed goes by then."""
    return os.fdopen(os.dup(1), "w")


def _say(answer: Any) -> None:
    print(json.dumps(answer), file=_output(), flush=True)


def _names(item: pytest.Item) -> list[str]:
    """A test's fixtures, what it, these and functions of its file use by name, and the words of their texts: commands,
    columns, addresses.
    """
    fixtures = [made[-1].func for made in item._fixtureinfo.name2fixturedefs.values()]  # type: ignore[attr-defined]
    functions = [getattr(item, "function", None), *fixtures]
    waiting = [(function.__code__, function.__globals__) for function in functions if hasattr(function, "__code__")]
    found = set(item._fixtureinfo.name2fixturedefs)  # type: ignore[attr-defined]
    seen = set[CodeType]()
    while waiting:
        code, around = waiting.pop()
        seen.add(code)
        found.update(code.co_names)
        found.update(word for text in code.co_consts if isinstance(text, str) for word in re.findall(r"\w+", text))
        helpers = [around[name] for name in code.co_names if isinstance(around.get(name), FunctionType)]
        own = [helper.__code__ for helper in helpers if helper.__globals__ is around]
        parts = [part for part in code.co_consts if isinstance(part, CodeType)]
        waiting += [(part, around) for part in [*own, *parts] if part not in seen]
    return sorted(found)


def _load_kernels(kernels: list[Any]) -> None:
    """What is compiled already, once for all trials."""
    for kernel in kernels:
        with contextlib.suppress(AttributeError):
            for signature, *_ in kernel._cache._cache_file._load_index():
                kernel.compile(signature)
    gc.collect()
    gc.freeze()


def _let_processes_fork() -> None:
    """Those that a server in a test starts have all that is loaded, and the change."""
    if forking := sys.modules.get("tests.forking"):
        forking.Context = multiprocessing.get_context("fork").__class__
        forking.begin = lambda: None


def _trial(limits: dict[str, float], run: Callable[[Chosen, Path], None]) -> dict[str, Any]:
    """The verdict on the copy as it is: the test that failed, one that took too long, or neither."""
    began, was_stopped = _cpu(), True
    while was_stopped:
        with tempfile.TemporaryDirectory(
            dir=os.environ.get("PYTEST_DEBUG_TEMPROOT"), ignore_cleanup_errors=True
        ) as folder:
            answer, running = Path(folder, "answer.json"), Path(folder, "running.txt")
            process = os.fork()
            if not process:
                _begin_trial(Chosen(limits, running), Path(folder), run)
            is_over, was_stopped = _wait(process, time.monotonic() + 2.0 * sum(limits.values()) + 600.0)
            told = {"ran": 0, "failed": (running.read_text() or "collection") if running.exists() else "crash"}
            if answer.exists():
                told = json.loads(answer.read_text())
    return {**told, "out_of_time": not is_over, "seconds": round(_cpu() - began, 1)}


def _cpu() -> float:
    """Seconds that trials computed so far."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _begin_trial(chosen: Chosen, folder: Path, run: Callable[[Chosen, Path], None]) -> None:
    """The trial itself, in its own group of processes."""
    os.setsid()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    with (folder / "output.txt").open("wb") as output:
        os.dup2(output.fileno(), 1)
        os.dup2(output.fileno(), 2)
    _leave_compiling_out()
    with contextlib.suppress(BaseException):
        run(chosen, folder)
    told = {"ran": chosen.ran, "failed": chosen.failed, "durations": chosen.durations}
    (folder / "answer.json").write_text(json.dumps(told))
    os._exit(0)


def _run_files(chosen: Chosen, folder: Path) -> None:
    """File by file, so that no more are imported than are needed."""
    options = [*SHARED, "-x", f"--basetemp={folder / 'tests'}"]
    options += ["-W", "ignore::pytest.PytestAssertRewriteWarning"]  # of plugins that are loaded already
    for file, _ in groupby(chosen.durations, lambda test: test.partition("::")[0]):
        status: int | None = None
        with contextlib.suppress(BaseException):
            status = int(pytest.main([*options, file], plugins=[chosen]))
        if status not in {0, 5} or chosen.failed:
            chosen.failed = chosen.failed or file
            break


def _run_items(
    items: dict[str, pytest.Item], change: Callable[[], None], budget: float, chosen: Chosen, folder: Path
) -> None:
    """Tests that are collected already, one after the other."""
    change()
    wished = [items[test] for test in chosen.durations]
    config = wished[0].config
    config._tmp_path_factory._given_basetemp = folder / "tests"  # type: ignore[attr-defined]
    config.pluginmanager.register(chosen)
    for item, following in zip(wished, [*wished[1:], None], strict=True):
        try:
            config.hook.pytest_runtest_protocol(item=item, nextitem=following)
        except BaseException:
            chosen.failed = chosen.failed or item.nodeid
        if chosen.failed or time.process_time() - compiled.seconds > budget:
            break


compiled = SimpleNamespace(seconds=0.0)
"""What compiling took in this process."""


def _leave_compiling_out() -> None:
    """Stop the clocks while numba compiles: a changed kernel takes a hundred times as long as it does from its file."""
    if "numba" not in sys.modules:
        return
    from numba.core import event

    class Pause(event.Listener):  # type: ignore[misc]
        depth = 0

        def on_start(self, _event: object) -> None:
            if not self.depth:
                compiled.seconds -= time.process_time()
                self.left = {clock: signal.setitimer(clock, 0.0)[0] for clock in CLOCKS}
            self.depth += 1

        def on_end(self, _event: object) -> None:
            self.depth -= 1
            if not self.depth:
                compiled.seconds += time.process_time()
                for clock, left in self.left.items():
                    signal.setitimer(clock, left)

    event.register("numba:compile", Pause())


def _wait(process: int, deadline: float) -> tuple[bool, bool]:
    """Whether a trial ends by itself, and whether it ran into a time limit while all was stopped; nothing is left."""
    done = status = 0
    seen, was_stopped = time.monotonic(), False
    while not done and time.monotonic() < deadline:
        done, status = os.waitpid(process, os.WNOHANG)
        time.sleep(0.02)
        was_stopped |= time.monotonic() - seen > PAUSE
        seen = time.monotonic()
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process, signal.SIGKILL)
    if not done:
        os.waitpid(process, 0)
    is_over = bool(done) and not (os.WIFSIGNALED(status) and os.WTERMSIG(status) in {signal.SIGVTALRM, signal.SIGALRM})
    return is_over, was_stopped and not is_over


if __name__ == "__main__":
    main()
