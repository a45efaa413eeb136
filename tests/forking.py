"""Processes that begin with the imports and kernels behind them which a new interpreter takes three seconds for."""

import multiprocessing
import os
import runpy
import site
import sys
import threading
from collections.abc import Callable
from contextlib import chdir
from functools import cache
from multiprocessing import forkserver, resource_tracker
from multiprocessing.connection import wait
from multiprocessing.context import ForkServerContext, ForkServerProcess
from multiprocessing.process import BaseProcess
from multiprocessing.reduction import DupFd
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PRELOADED = ["tests.warm", "service.cli.running", "service.serving"]
OUTPUTS = (1, 2)


class ForkedProcess(ForkServerProcess):
    """Forked from a process that runs nothing else, with what a new interpreter has of the one that starts it: the
    environment, the outputs and the file permissions of the moment.
    """

    def start(self) -> None:
        begin()
        super().start()

    def __getstate__(self) -> dict[str, Any]:
        given = dict(os.environ), [DupFd(number) for number in OUTPUTS], umask()
        return self.__dict__ | {"_given": given}

    def run(self) -> None:
        environment, outputs, withheld = self.__dict__["_given"]
        os.environ.clear()
        os.environ.update(environment)
        os.umask(withheld)
        for number, output in zip(OUTPUTS, outputs, strict=True):
            os.dup2(output.detach(), number)
        super().run()


class Context(ForkServerContext):
    """A way to begin processes, for whatever asks for one."""

    Process = ForkedProcess  # type: ignore[assignment]


def umask() -> int:
    """Read without being set, which other threads would notice."""
    lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    return next(int(line.split()[1], 8) for line in lines if line.startswith("Umask:"))


@cache
def begin() -> None:
    """Start the process that all others are forked from, and wait until it is warm; it ends with this one.

    A server that would have to wait for it could answer nobody meanwhile.
    """
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(PRELOADED)
    with chdir(ROOT):  # where it finds the modules of the tests
        forkserver.ensure_running()
    first = context.Process(target=int)
    first.start()
    first.join()


def exit_code(target: Callable[..., object], *given: object, seconds: float = 120.0) -> int | None:
    """Of a process that does this; ``seconds`` are only against waiting for ever."""
    return exit_codes((target, *given), seconds=seconds)[0]


def exit_codes(*jobs: tuple[Any, ...], seconds: float = 240.0) -> list[int | None]:
    """Of processes that run at once, each of which does a job: what to call, and with what."""
    processes = [Context().Process(target=target, args=given) for target, *given in jobs]
    for process in processes:
        process.start()
    for process in processes:
        process.join(seconds)
        process.kill()
        process.join()
    return [process.exitcode for process in processes]


def start_module(command: tuple[str, ...], environment: dict[str, str], log: Path) -> BaseProcess:
    """``python -m command`` with more in its environment, and its outputs in the log."""
    begin()
    process = multiprocessing.get_context("forkserver").Process(target=_run_module, args=(command, environment, log))
    process.start()
    return process


class Command:
    """A command ``python -m ...`` as of ``subprocess.Popen``, by a process that has the imports behind it."""

    def __init__(self, command: list[str], env: dict[str, str], stdout: Any, **_: object) -> None:
        assert command[:2] == [sys.executable, "-m"]
        self._process = start_module(tuple(command[2:]), env, Path(stdout.name))
        self.terminate = self._process.terminate

    def poll(self) -> int | None:
        return self._process.exitcode

    def wait(self, timeout: float) -> None:
        self._process.join(timeout)
        assert self._process.exitcode is not None


def _run_module(command: tuple[str, ...], environment: dict[str, str], log: Path) -> None:
    threading.Thread(target=_end_with_parent, daemon=True).start()
    resource_tracker._resource_tracker.__init__()  # its own one tells of what a killed process leaves in its own log
    with log.open("ab") as stream:
        for output in OUTPUTS:
            os.dup2(stream.fileno(), output)
    os.environ.update(environment)
    sys.path[:0] = environment.get("PYTHONPATH", "").split(os.pathsep)
    sys.modules.pop("sitecustomize", None)  # Debian's Python has one of its own, which was imported before the path was
    site.execsitecustomize()  # as at the start of an interpreter
    sys.argv[:] = command
    runpy.run_module(command[0], run_name="__main__", alter_sys=True)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    wait([parent.sentinel])
    os._exit(1)
