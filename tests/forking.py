"""Processes that begin with the imports and kernels behind them which a new interpreter takes three seconds for."""

import multiprocessing
import os
from contextlib import chdir
from functools import cache
from multiprocessing import forkserver
from multiprocessing.context import ForkServerContext, ForkServerProcess
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
