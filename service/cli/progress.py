"""Signs of life of a command that takes longer than a moment."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter

import typer

MOMENT = 1.0
"""Seconds after which a user wants to know that something is going on."""


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
