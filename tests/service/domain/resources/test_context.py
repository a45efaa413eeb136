"""The stores of an application, as its use cases reach them."""

import asyncio
from threading import Event
from typing import Any, cast

import pytest

from db.blobs import BlobStore
from service.domain.resources.context import Context
from service.processes.fair_threads import LONG_AT_ONCE, SHORT_AT_ONCE


@pytest.fixture
def context(blobs: BlobStore) -> Context:
    nothing = cast(Any, None)
    return Context(nothing, nothing, blobs, nothing)


def test_files_come_in_the_order_in_which_they_are_asked_for(context: Context, blobs: BlobStore) -> None:
    hashes = [blobs.put(content) for content in (b"history", b"samples", b"upload")]
    for wanted in (hashes, hashes[::-1], hashes[:1], []):
        assert asyncio.run(context.files("owner", wanted)) == [blobs.path(sha256) for sha256 in wanted]


def test_who_asks_for_many_files_of_a_slow_store_leaves_room_for_what_is_quick(
    context: Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    """His own as well as that of others."""
    is_there, begun = Event(), []

    def slow(_: BlobStore, sha256: str, *__: object) -> str:
        begun.append(sha256)
        is_there.wait(20.0)
        return sha256

    monkeypatch.setattr(BlobStore, "path", slow)

    async def ask() -> None:
        looks = [asyncio.ensure_future(context.files("owner", [str(k)])) for k in range(2 * SHORT_AT_ONCE)]
        assert await context.store_threads.run("owner", lambda: 1) == 1
        assert await context.store_threads.run("other", lambda: 2) == 2
        assert len(begun) < LONG_AT_ONCE
        is_there.set()
        await asyncio.gather(*looks)

    asyncio.run(asyncio.wait_for(ask(), 60.0))
