"""The connection of a command to a service."""

from collections.abc import Iterator
from contextlib import contextmanager
from difflib import get_close_matches
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from stiction_client import FrictionClient


@contextmanager
def reached(url: str) -> Iterator[None]:
    """Say of a service that can't be reached how to start one; not of one that is late, or refuses a stream."""
    from stiction_client.errors import AnswerTimedOut, ConnectionFailed, StreamEnded

    try:
        yield
    except ConnectionFailed as failure:
        if not isinstance(failure, AnswerTimedOut | StreamEnded):
            failure.add_note(f"is a service running at {url}? `stiction serve` starts one; --url names another")
        raise


@contextmanager
def connected(url: str, key: str | None) -> Iterator["FrictionClient"]:
    """A client of the service, whose errors say what to do where the service can't: a likely name, how to start one."""
    from stiction_client import FrictionClient, problems

    with reached(url), FrictionClient(url, key=key) as client:
        try:
            yield client
        except problems.UnknownMaterial as problem:
            near = get_close_matches(problem.value or "", [material.name for material in client.materials()])
            if near:
                problem.add_note(f"did you mean {' or '.join(near)}?")
            problem.add_note(
                "`stiction upload --create` makes a new one; `stiction materials list` shows those there are"
            )
            raise
