"""To whom a long computation reports how far it is."""

from collections.abc import Callable

Progress = Callable[[float], None]
"""Takes the part that is done, from 0 to 1."""


def no_progress(part: float) -> None:
    """Reports to nobody."""
