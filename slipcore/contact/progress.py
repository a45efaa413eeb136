"""Whom a long computation tells how far it is."""

from collections.abc import Callable

Progress = Callable[[float], None]
"""Is told which part is done, from 0 to 1."""


def no_progress(part: float) -> None:
    """Nobody is told."""
