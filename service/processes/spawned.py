"""Processes that the server starts: they end with it, and with it only."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable
from concurrent.futures import Executor, ProcessPoolExecutor
from multiprocessing.connection import wait

from service.observability import logs, traces
from service.processes import freed_memory

CONTEXT = multiprocessing.get_context("spawn")
"""How they begin: as new interpreters, without the server's threads, locks and connections."""

NICENESS = 5
"""Of the processes that do jobs: on a busy machine the server gets three times as much of a core as each of them."""


def process(prepare: Callable[[], None] | None = None) -> ProcessPoolExecutor:
    """One process for numerics, or for what else the server keeps out of its own; it begins with ``prepare``."""
    return ProcessPoolExecutor(1, CONTEXT, start, (logs.current(), prepare))


def kill(pool: Executor | None) -> None:
    """End a pool's processes at once, whatever they do (what ``kill_workers`` does from Python 3.14 on)."""
    for process in dict(getattr(pool, "_processes", None) or {}).values():
        process.kill()


def process_id(pool: Executor | None) -> int | None:
    """The id of a pool's one process, once it has one."""
    return next(iter(dict(getattr(pool, "_processes", None) or {})), None)


def start(chosen: logs.Logs | None, prepare: Callable[[], None] | None = None) -> None:
    """Prepare the process: it ends when the server tells it to or is gone, not by a Ctrl-C meant for the server."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    logs.configure(chosen)
    freed_memory.keep()
    traces.start()
    if prepare is not None:
        prepare()


def lower_priority() -> None:
    """Prepare a process whose work can wait while somebody waits for an answer."""
    os.nice(NICENESS)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)  # a worker that waits for work would otherwise wait for ever
