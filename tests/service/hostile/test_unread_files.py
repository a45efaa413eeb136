"""Files that are made for an answer lie on the disk until it is read: so many at once, however slowly that goes."""

import asyncio
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from service.processes import fair_queue
from service.processes.fair_queue import FairQueue

pytestmark = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)

SHARE = 2
"""Of one address; as many again are of others."""


@pytest.fixture
def caller(reach: Callable[..., Any]) -> Any:
    """Somebody who asks an application with little room."""
    made = reach("open")
    made.app.state.context = replace(made.app.state.context, answers=FairQueue(2 * SHARE, "answered"))
    return made


@pytest.fixture
def file(caller: Any, content: bytes) -> str:
    """The address of a stored log's file."""
    headers = {"content-type": "application/vnd.stiction.grasp-log+npz"}
    accepted = caller.request("POST", "/v1/grasp-logs", content=content, headers=headers)
    return f"/v1/grasp-logs/{accepted.json()['id']}/file"


def files_there(caller: Any) -> int:
    with caller.app.state.context.blobs.spool() as spool:
        return len({*spool.path.parent.iterdir()} - {spool.path})


def asked_while_unread(caller: Any, unread: str, count: int, *asked: str) -> tuple[int, list[Any]]:
    """Files that are there while ``count`` answers are not read, and what is answered then."""
    app = caller.app

    async def ask_for_unread(began: asyncio.Event) -> None:
        async def send(_: Any) -> None:
            began.set()
            await asyncio.Event().wait()

        async def receive() -> Any:
            await asyncio.Event().wait()

        path, _, query = unread.partition("?")
        ends = {"scheme": "http", "client": (caller.address, 50000), "server": (caller.server, 80)}
        scope = {"type": "http", "method": "GET", "path": path, "query_string": query.encode(), "headers": [], **ends}
        await app(scope, receive, send)

    async def ask() -> tuple[int, list[Any]]:
        events = [asyncio.Event() for _ in range(count)]
        tasks = [asyncio.create_task(ask_for_unread(each)) for each in events]
        try:
            await asyncio.wait_for(asyncio.gather(*(each.wait() for each in events)), 30.0)
            with pytest.MonkeyPatch.context() as changed:
                changed.setattr(fair_queue, "WAIT_SECONDS", 0.05)
                return files_there(caller), [await caller._request("GET", path) for path in asked]
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    return asyncio.run(ask())


def test_converted_files_that_are_not_read_are_bounded_and_go_with_their_answers(caller: Any, file: str) -> None:
    parquet = f"{file}?format=parquet"
    there, (converted, as_stored) = asked_while_unread(caller, parquet, SHARE, parquet, file)
    assert there == SHARE
    assert (converted.status_code, converted.json()["type"]) == (503, "/problems/too-many-uploads")
    assert "retry-after" in converted.headers
    assert as_stored.status_code == 200, "nothing is made for it"
    assert files_there(caller) == 0
    assert caller.get(parquet).status_code == 200


def test_files_as_they_are_stored_take_no_room(caller: Any, file: str) -> None:
    assert caller.get(f"{file}?format=parquet").status_code == 200  # from here on there is a reader
    _, (converted,) = asked_while_unread(caller, file, 2 * SHARE, f"{file}?format=parquet")
    assert converted.status_code == 200


@pytest.mark.parametrize("path", ["/logs/x/frames", "/logs/x/report", "/materials/x/samples", "/materials/x/report"])
def test_pages_for_which_files_are_made_wait_for_the_same_room(
    caller: Any, path: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fair_queue, "WAIT_SECONDS", 0.05)
    assert caller.get(path).status_code == 404

    async def ask_beside_others() -> Any:
        queue = caller.app.state.context.answers
        async with queue.turn(f"address {caller.address}", SHARE):
            return await caller._request("GET", path)

    assert asyncio.run(ask_beside_others()).status_code == 503
