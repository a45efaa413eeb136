"""The same log sent to several servers at once is one log."""

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import repeat
from typing import Any

import httpx
import pytest
from sqlalchemy import func, select

from db.blobs import BlobStore
from db.tables import GraspLogRow, JobRow

AT_ONCE = 3
"""Uploads to each of two servers."""


@pytest.fixture
def send_all(fleet: Any) -> Iterator[Callable[..., list[httpx.Response]]]:
    """Sends a log to both servers several times at once, and returns the answers."""
    servers = [fleet.serve(), fleet.serve()] * AT_ONCE
    servers[0].make_material()
    together = threading.Barrier(len(servers))

    def send(server: Any, content: bytes, headers: dict[str, str]) -> httpx.Response:
        with httpx.Client(base_url=server.url, timeout=server.client.timeout) as client:
            together.wait()
            return server.upload(content, client, **headers)  # type: ignore[no-any-return]

    with ThreadPoolExecutor(len(servers)) as threads:
        yield lambda content, **headers: list(threads.map(send, servers, repeat(content), repeat(headers)))


def test_identical_uploads_to_two_servers_at_once_are_one_log(
    fleet: Any, contents: Callable[[int], list[bytes]], send_all: Callable[..., list[httpx.Response]]
) -> None:
    logs = contents(6)
    for content in logs[::2]:
        answers = send_all(content)
        assert len({answer.json()["id"] for answer in answers}) == 1
        assert sorted(answer.status_code for answer in answers) == [200] * (2 * AT_ONCE - 1) + [202]
    for number, content in enumerate(logs[1::2]):
        answers = send_all(content, **{"idempotency-key": f"upload-{number}"})
        assert {(answer.status_code, answer.content) for answer in answers} == {(202, answers[0].content)}
    fleet.check_consistent()
    with fleet.database.read() as session:
        for table in (GraspLogRow, JobRow):
            assert session.scalar(select(func.count()).select_from(table)) == len(logs)
    assert len(list(BlobStore(fleet.folder).hashes())) == len(logs)
    fleet.wait_until(lambda: not list((fleet.folder / "spool").iterdir()), "the files of the uploads to go")
