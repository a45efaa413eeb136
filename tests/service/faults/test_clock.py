"""Clocks are set ahead and back, and differ: that of the server, and that of the worker."""

import os
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from email.utils import parsedate_to_datetime
from functools import partial
from pathlib import Path
from typing import Any

import httpx
import pytest

HOUR, DAY = 3600.0, 86400.0
AHEAD = (
    (5 * HOUR, 5 * HOUR),  # of the server, of the worker
    (5 * HOUR, -2 * DAY),
    (-2 * DAY, -2 * DAY),
    (-2 * DAY, 400 * DAY),
    (30 * DAY, -400 * DAY),
    (0.0, 0.0),
)
LOOKUP = "/v1/materials/paper/friction?fn=0.05"
RATE = 20
Clocks = Callable[..., None]


@pytest.fixture
def set_clocks(tmp_path: Path) -> Clocks:
    """Sets the clocks of the processes, those of a server and of a worker, so many seconds ahead."""

    def change(**ahead: float) -> None:
        for name, seconds in ahead.items():
            (tmp_path / f"{name}.new").write_text(repr(seconds))
            (tmp_path / f"{name}.new").replace(tmp_path / name)

    return change


@pytest.fixture
def server(fleet: Any, tmp_path: Path, set_clocks: Clocks) -> Any:
    """With a worker beside it, whose clock is another."""
    set_clocks(server=0.0, worker=0.0)
    path = [str(Path(__file__).parent / "clock"), *filter(None, [os.environ.get("PYTHONPATH")])]
    fleet.environment |= {"PYTHONPATH": os.pathsep.join(path), "STICTION_RATE_LIMIT": str(RATE)}
    fleet.environment["CLOCK_AHEAD"] = str(tmp_path / "worker")
    fleet.work()
    fleet.environment["CLOCK_AHEAD"] = str(tmp_path / "server")
    server = fleet.serve()
    server.make_material()
    return server


def is_ahead(server: Any, seconds: timedelta) -> bool:
    """Whether the server's clock is so far ahead of ours."""
    told = parsedate_to_datetime(server.client.get("/healthz").headers["date"])
    return abs(told - datetime.now(UTC) - seconds) < timedelta(minutes=10)


def send(server: Any, number: int, content: bytes) -> dict[str, Any]:
    """Upload under a key, twice, with one answer."""
    answers = [server.upload(content, **{"idempotency-key": f"upload-{number}"}) for _ in range(2)]
    assert [answer.status_code for answer in answers] == [202, 202]
    assert answers[0].content == answers[1].content
    log: dict[str, Any] = answers[0].json()
    return log


def fitted(fleet: Any, server: Any, log: dict[str, Any]) -> dict[str, Any]:
    """The answer to a look-up right after the job's end was seen, whatever was looked up before."""

    def has_ended() -> bool:
        server.client.get(LOOKUP)
        return server.client.get(f"/v1/jobs/{log['job']['id']}").json()["status"] == "done"

    fleet.wait_until(has_ended, "the job to end")
    answer = server.client.get(LOOKUP)
    again = server.client.get(LOOKUP, headers={"if-none-match": answer.headers["etag"]})
    assert again.status_code == httpx.codes.NOT_MODIFIED
    found: dict[str, Any] = answer.raise_for_status().json()
    return found


def listed(server: Any, sort: str, meanwhile: Callable[[], None]) -> list[str]:
    """All logs, two at a time; something happens after the first two."""
    asked = {"limit": "2", "sort": sort}
    page = server.client.get("/v1/grasp-logs", params=asked).json()
    ids = [item["id"] for item in page["items"]]
    meanwhile()
    while page["next"] is not None:
        page = server.client.get("/v1/grasp-logs", params=asked | {"cursor": page["next"]}).json()
        ids += [item["id"] for item in page["items"]]
    return ids


def is_let_in_again(fleet: Any, server: Any) -> None:
    """Whoever was told to come more slowly is so for a second, and not until the clock is where it was."""

    def asked() -> int:
        return int(server.client.get("/v1/jobs", headers={"authorization": "Bearer x"}).status_code)

    fleet.wait_until(lambda: asked() == httpx.codes.TOO_MANY_REQUESTS, "the limit")
    fleet.wait_until(lambda: asked() == httpx.codes.UNAUTHORIZED, "an answer")


@pytest.mark.long
def test_clocks_that_are_set_and_differ_change_nothing(
    fleet: Any, server: Any, set_clocks: Clocks, contents: Callable[[int], list[bytes]]
) -> None:
    first, *others = contents(1 + len(AHEAD))
    logs = [send(server, 0, first)]
    assert fitted(fleet, server, logs[0])["version"] == 1
    runners = fleet.runners()
    for number, (content, (ahead, of_worker)) in enumerate(zip(others, AHEAD, strict=True), start=1):
        logs.append(send(server, number, content))  # under way when the clocks are set
        known = sorted(log["id"] for log in logs)
        assert sorted(listed(server, "created_at", partial(set_clocks, server=ahead, worker=of_worker))) == known
        fleet.wait_until(partial(is_ahead, server, timedelta(seconds=ahead)), "the server's clock to be set")
        assert sorted(listed(server, "-created_at", partial(set_clocks, worker=0.0))) == known
        set_clocks(worker=of_worker)
        assert fitted(fleet, server, logs[-1])["version"] == len(logs)
        again = server.upload(first, **{"idempotency-key": "upload-0"})
        assert (again.is_success, again.json()["id"]) == (True, logs[0]["id"])  # its key may have expired
        is_let_in_again(fleet, server)
    assert fleet.runners() == runners  # none was taken for dead
    jobs = server.client.get("/v1/jobs").json()["items"]
    assert [(job["status"], job["deaths"]) for job in jobs] == [("done", 0)] * len(logs)
    set_clocks(server=-2 * DAY, worker=0.0)
    fleet.check_complete([log["id"] for log in logs])  # after a sweep under a clock that was set back
