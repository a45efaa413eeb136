"""Signs of life of a command that takes longer than a moment."""

import os
import re
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter
from traceback import walk_stack
from types import FrameType
from typing import TypeVar

import typer

MOMENT = 1.0
"""Seconds after which a user wants to know that something is going on."""

AGAIN = 0.05
"""Seconds after which an interrupt that came within the compiler is sent once more."""

COMPILER = re.compile(r"[/\\](llvmlite|numba)[/\\]")
"""Whose code an exception may not pass: it is called from C++, which loses it or ends the process."""

COMPILES = ", compiling numerics, which are kept"
"""What a line says besides while kernels are compiled: it takes minutes, and only the first time."""

Thing = TypeVar("Thing")


class Line:
    """A line on standard error: what is being done, for how long and, once it is told the part is done, for how much
    longer. It is written anew on a terminal; in a file or a pipe one follows the other, each after twice the time.
    """

    def __init__(self, doing: str) -> None:
        self._doing, self._part, self._began, self._said = doing, 0.0, perf_counter(), ""
        self._is_rewritten, self._next = is_terminal(), 0.0

    def tell(self, part: float, doing: str | None = None) -> None:
        """Note which part is done, from 0 to 1, and what is being done by now."""
        self._part, self._doing = part, self._doing if doing is None else doing

    def say(self, besides: str = "") -> None:
        """Write the line, where one is due, and what is to be said ``besides``."""
        seconds = perf_counter() - self._began
        text = self._text(seconds) + besides
        if self._is_rewritten:
            typer.echo(f"\r{text:<{len(self._said)}}", err=True, nl=False)
        elif seconds < self._next:
            return
        else:
            typer.echo(text, err=True)
        self._said, self._next = text, 2.0 * seconds

    def end(self) -> None:
        """Write it a last time, if it was ever written."""
        if self._said:
            self._next = 0.0
            self.say()
            if self._is_rewritten:
                typer.echo(err=True)

    def _text(self, seconds: float) -> str:
        left = f", {_rounded(seconds * (1.0 / self._part - 1.0))} left" if 0.0 < self._part < 1.0 else ""
        return f"{self._doing}: {_rounded(seconds)}{left}"


def is_terminal() -> bool:
    """Whether somebody looks at standard error as it is written."""
    return sys.stderr is not None and sys.stderr.isatty()


def counted(things: Iterable[Thing], total: int, name: str) -> Iterator[Thing]:
    """The same things, while it is said how many are done and how long the others will take."""
    with shown_progress(f"0 of {total} {name}") as tell:
        for count, thing in enumerate(things, 1):
            tell(count / total, f"{count} of {total} {name}")
            yield thing


def resumable(things: Iterable[Thing], total: int, name: str, folder: Path) -> list[Thing]:
    """All things, ``counted``, each kept in a folder once it is there; Ctrl-C says how to have the others."""
    made = list[Thing]()
    try:
        for thing in counted(things, total, name):
            made.append(thing)
    except KeyboardInterrupt:
        typer.echo(f"{len(made)} of {total} {name} are in {folder}; the same command makes the others", err=True)
        raise
    return made


@contextmanager
def shown_progress(doing: str) -> Iterator[Callable[..., None]]:
    """Say on standard error what is being done, on a terminal once a second; nothing if it is done in a moment.

    Gives whom to tell the part that is done (``Line.tell``), who raises ``KeyboardInterrupt`` where one was lost.
    """
    done, line, caller = threading.Event(), Line(doing), threading.get_ident()

    def report() -> None:
        while not done.wait(MOMENT):
            line.say(COMPILES if _within_compiler(sys._current_frames().get(caller)) else "")

    thread = threading.Thread(target=report, daemon=True)
    thread.start()
    try:
        with _noted_interrupts() as raise_lost:

            def tell(part: float, doing: str | None = None) -> None:
                raise_lost()
                line.tell(part, doing)

            yield tell
    finally:
        done.set()
        thread.join()
        line.end()


@contextmanager
def _noted_interrupts() -> Iterator[Callable[[], None]]:
    """Ctrl-C is raised only once no kernel is being compiled or loaded; gives what raises one that came and was lost.

    Once: what is sent once more would come upon whoever cleans up after the first.
    """
    came, before = threading.Event(), signal.getsignal(signal.SIGINT)
    again = threading.Timer(AGAIN, os.kill, (os.getpid(), signal.SIGINT))

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal again
        came.set()
        again.cancel()
        if _within_compiler(frame):
            again = threading.Timer(AGAIN, os.kill, (os.getpid(), number))
            again.start()
        else:
            signal.default_int_handler(number, frame)

    def raise_lost() -> None:
        if came.is_set():
            again.cancel()
            raise KeyboardInterrupt

    if before is signal.default_int_handler and threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, note)
    try:
        yield raise_lost
    except (Exception, KeyboardInterrupt) as error:
        again.cancel()
        if came.is_set() and isinstance(error, Exception):
            raise KeyboardInterrupt from error
        raise
    finally:
        if signal.getsignal(signal.SIGINT) is note:
            signal.signal(signal.SIGINT, before)


def _within_compiler(frame: FrameType | None) -> bool:
    """Whether a kernel is being compiled or loaded by the calls that led to a ``frame``."""
    return frame is not None and any(COMPILER.search(each.f_code.co_filename) for each, _ in walk_stack(frame))


def _rounded(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 100 else f"{seconds / 60:.0f} min"
