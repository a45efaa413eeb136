"""PostgreSQL is stopped and started again under load: what is asked meanwhile waits or is told so, nothing is lost."""

import logging
import signal
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from itertools import islice
from typing import Any

import httpx
import numpy as np
import pytest
from sqlalchemy import select

from db.tables import JobRow
from slipcore import GraspLog
from stiction_client.errors import ConnectionFailed
from stiction_client.stream import SlipStream

logger = logging.getLogger(__name__)

IMMEDIATE, FAST = signal.SIGQUIT, signal.SIGINT
READ = (
    "/v1/materials/paper/friction?fn=0.05",
    "/v1/materials/paper/friction?fn=0.05&method=robust",
    "/v1/materials/paper",
    "/v1/materials",
    "/v1/jobs",
    "/v1/grasp-logs?material=paper",
    "/metrics",
    "/readyz",
)
OUTAGES = 20

pytestmark = pytest.mark.parametrize("engine_name", ["postgresql"], indirect=True)


class Load:
    """Uploads one after the other, each sent until it is accepted, and all kinds of reading, at each server."""

    def __init__(self, servers: list[Any], logs: list[bytes]) -> None:
        self._servers, self._logs = servers, iter(logs)
        self._stop = threading.Event()
        self.accepted: list[str] = []
        self.uploads: Counter[Any] = Counter()
        self.reads: Counter[Any] = Counter()

    @contextmanager
    def running(self) -> Iterator[None]:
        threads = [
            threading.Thread(target=do, args=(each,)) for each in self._servers for do in (self._send, self._read)
        ]
        for thread in threads:
            thread.start()
        try:
            yield
        finally:
            self._stop.set()
            for thread in threads:
                thread.join()

    def _send(self, server: Any) -> None:
        for content in self._logs:
            while not (answer := server.upload(content)).is_success:
                self.uploads[kind(answer)] += 1
                time.sleep(0.05)
            self.uploads[kind(answer)] += 1
            self.accepted.append(answer.json()["id"])
            if self._stop.wait(0.1):
                return

    def _read(self, server: Any) -> None:
        with httpx.Client(base_url=server.url, timeout=server.client.timeout) as client:
            while not self._stop.wait(0.02):
                for path in READ:
                    self.reads[kind(client.get(path))] += 1


def kind(answer: httpx.Response) -> tuple[int, str | None]:
    return answer.status_code, None if answer.is_success else answer.json()["type"]


AWAY = (503, "/problems/storage-unavailable")


def serve_under_load(fleet: Any, load: Load, outages: Iterable[Callable[[], None]]) -> list[str]:
    """Go through the outages; nothing may be answered wrongly, and no job lose an attempt. Returns the logs' ids."""
    with load.running():
        for outage in outages:
            time.sleep(0.5)
            outage()
            for server in fleet.servers:
                fleet.wait_until(server.is_ready, "the server to have its database back")
    assert {(202, None), AWAY} <= set(load.uploads) <= {(202, None), (200, None), AWAY}  # 200: its answer was lost
    assert set(load.reads) == {(200, None), AWAY, (409, "/problems/no-model")}
    fleet.wait_until(fleet.all_ended, "all jobs to end")
    with fleet.database.read() as session:
        assert set(session.scalars(select(JobRow.deaths))) == {0}
    return load.accepted


@pytest.fixture
def first(fleet: Any, postgresql: Any, contents: Callable[[int], list[bytes]]) -> list[str]:
    """A log that is done already."""
    postgresql.keep_commits(fleet.database.url)
    server = fleet.serve(workers=1)
    server.make_material()
    accepted = [server.accept(contents(1)[0])]
    fleet.wait_until(fleet.all_ended, "the first job to end")
    return accepted


@pytest.mark.long
def test_a_database_that_is_away_under_load_loses_nothing(
    fleet: Any, postgresql: Any, first: list[str], contents: Callable[[int], list[bytes]], ramp: GraspLog
) -> None:
    (server,) = fleet.servers
    frames = zip(ramp.time, ramp.displacement, ramp.force, ramp.object_pose, strict=True)

    def step(count: int) -> None:
        for frame in islice(frames, count):
            assert stream.step(*frame)["type"] == "state"

    def is_away(how: signal.Signals) -> None:
        step(len(ramp) // 3)
        with postgresql.stopped(how):
            step(1)
            with pytest.raises(ConnectionFailed, match=r"the service ended the stream: database.*\(4503\)"):
                stream.finish(store=True)
            time.sleep(0.5)

    load = Load([server], contents(30)[1:])
    with SlipStream(server.url, ramp.position, ramp.element_area, material="paper", keep=True) as stream:
        accepted = serve_under_load(fleet, load, [partial(is_away, how) for how in (IMMEDIATE, FAST)])
        step(len(ramp))
        stored = stream.finish(store=True)
    assert stored is not None
    fleet.check_complete([*first, *accepted, stored["id"]])


@pytest.mark.long
def test_a_database_that_comes_and_goes_under_load_loses_nothing(
    fleet: Any, postgresql: Any, first: list[str], contents: Callable[[int], list[bytes]]
) -> None:
    fleet.serve()
    fleet.work()
    rng = np.random.default_rng(1)

    def is_away(how: signal.Signals, seconds: float) -> None:
        with postgresql.stopped(how):
            time.sleep(seconds)

    outages = [partial(is_away, how, rng.uniform(0.0, 3.0)) for how in (IMMEDIATE, FAST) * (OUTAGES // 2)]
    load = Load(list(fleet.servers), contents(400)[1:])
    accepted = serve_under_load(fleet, load, outages)
    logger.info("uploads: %s; reads: %s", load.uploads, load.reads)
    fleet.check_complete(first + accepted)
