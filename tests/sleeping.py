"""Sleeps of event loops that a test replaces."""

import asyncio
import threading
from collections.abc import Awaitable, Callable

import pytest


def replace_sleep(monkeypatch: pytest.MonkeyPatch, replacement: Callable[[float], Awaitable[None]]) -> None:
    """Let ``replacement`` stand for ``asyncio.sleep`` in this thread alone.

    Servers that tests share run their loops in threads of this process: a sleep that ends at once would keep
    them busy, and what the test counts would be theirs, too.
    """
    mine, asleep = threading.get_ident(), asyncio.sleep

    async def sleep(seconds: float) -> None:
        await (replacement if threading.get_ident() == mine else asleep)(seconds)

    monkeypatch.setattr(asyncio, "sleep", sleep)
