"""Signs of life of a command that takes longer than a moment."""

import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from time import perf_counter
from typing import TypeVar

import typer

MOMENT = 1.0
"""Seconds after which a user wants to know that something is going on."""


Thing = TypeVar("Thing")


def counted(things: Iterable[Thing], total: int, name: str) -> Iterator[Thing]:
    """The same things; where there are several, how many are done and the time left are said on standard error."""
    if total == 1:
        yield from things
        return
    typer.echo(f"0 of {total} {name}", err=True, nl=False)
    began = perf_counter()
    for count, thing in enumerate(things, 1):
        left = (perf_counter() - began) / count * (total - count)
        typer.echo(f"\r{count} of {total} {name}, {_left(left)} left ", err=True, nl=False)
        yield thing
    typer.echo(err=True)


def _left(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 100 else f"{seconds / 60:.0f} min"


@contextmanager
def patience(doing: str) -> Iterator[None]:
    """Say on standard error what is being done, and for how long, once a second; nothing if it is done in a moment."""
    done, began = threading.Event(), perf_counter()

    def report() -> None:
        while not done.wait(MOMENT):
            typer.echo(f"\r{doing}: {perf_counter() - began:.0f} s", err=True, nl=False)

    thread = threading.Thread(target=report, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
        if perf_counter() - began > MOMENT:
            typer.echo(err=True)
