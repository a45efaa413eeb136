"""A time limit for the whole head of an answer: httpx limits single reads, so that one byte at a time takes minutes."""

import math
import time
from collections.abc import Callable, Mapping
from contextvars import ContextVar
from typing import Any

import httpx

_until: ContextVar[float] = ContextVar("until", default=math.inf)
"""Monotonic time, s, by which the head that is being read has to be complete."""

Trace = Callable[[str, Mapping[str, Any]], Any]
"""httpx's extension ``trace``: called with the name of each event of a request, and its details."""


def bounded(seconds: float) -> Trace:
    """Let the head of an answer be whole ``seconds`` after its request has left, or raise ``httpx.ReadTimeout``."""

    def trace(event: str, info: Mapping[str, Any]) -> None:
        what, _, state = event.rpartition(".")
        if what.endswith(("connect_tcp", "start_tls")) and state == "complete":
            _bound_reads(info["return_value"])
        elif what.endswith("receive_response_headers"):
            _until.set(time.monotonic() + seconds if state == "started" else math.inf)

    return trace


def bounded_async(seconds: float) -> Trace:
    """The same for asyncio."""
    plain = bounded(seconds)

    async def trace(event: str, info: Mapping[str, Any]) -> None:
        plain(event, info)

    return trace


def _bound_reads(stream: Any) -> None:
    """Let no read of a connection last longer than the head may, whether it waits or is awaited."""
    read = stream.read

    def bounded_read(most: int, timeout: float | None = None) -> Any:
        left = _until.get() - time.monotonic()
        if left <= 0.0:
            raise httpx.ReadTimeout("the head of the answer began, and was not whole in time")
        return read(most, left if timeout is None else min(timeout, left))

    stream.read = bounded_read
