import asyncio
import logging
from typing import Any

import pytest
from prometheus_client import CollectorRegistry, Histogram

from service.observability import access_log as module
from service.observability.access_log import LOGGED_A_SECOND, AccessLog

ROUTE = "/v1/materials/{name}/friction"


@pytest.fixture
def seconds() -> Histogram:
    return Histogram("seconds", "s", ("method", "route", "status"), registry=CollectorRegistry())


def noted(caplog: pytest.LogCaptureFixture) -> list[tuple[str, Any]]:
    return [(record.getMessage(), getattr(record, "about")) for record in caplog.records]  # noqa: B009


def note(seconds: Histogram, count: int, method: str = "GET", status: int = 200) -> None:
    async def go() -> None:
        log = AccessLog(seconds)
        for number in range(count):
            log.record(method, ROUTE, status, 0.25, f"request-{number}")
        log.flush()
        log.flush()

    asyncio.run(go())


def test_few_requests_have_a_record_each(seconds: Histogram, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO):
        note(seconds, 3)
    assert [about["request_id"] for _, about in noted(caplog)] == ["request-0", "request-1", "request-2"]


def test_many_in_a_second_are_told_together_and_counted_one_by_one(
    seconds: Histogram, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.INFO):
        note(seconds, LOGGED_A_SECOND + 40)
    *each, (message, about) = noted(caplog)
    assert len(each) == LOGGED_A_SECOND
    assert message == "answered many"
    assert about == {"requests": 40, "method": "GET", "route": ROUTE, "status": 200, "seconds": 10.0}
    assert sum(bucket.get() for bucket in seconds.labels("GET", ROUTE, "200")._buckets) == LOGGED_A_SECOND + 40


@pytest.mark.parametrize(("method", "status"), [("POST", 202), ("GET", 404), ("GET", 0), ("BREW", 200)])
def test_changes_and_errors_have_a_record_each(
    seconds: Histogram, caplog: pytest.LogCaptureFixture, method: str, status: int
) -> None:
    with caplog.at_level(logging.INFO):
        note(seconds, LOGGED_A_SECOND + 40, method, status)
    assert len(noted(caplog)) == LOGGED_A_SECOND + 40


def test_a_second_ends_by_itself(
    seconds: Histogram, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "LOGGED_A_SECOND", 1)
    monkeypatch.setattr(module, "FLUSH_SECONDS", 0.01)

    async def go() -> None:
        log = AccessLog(seconds)
        for _ in range(2):
            for _ in range(3):
                log.record("GET", ROUTE, 200, 0.25, "id")
            await asyncio.sleep(0.05)

    with caplog.at_level(logging.INFO):
        asyncio.run(go())
    assert [message for message, _ in noted(caplog)] == ["answered", "answered many"] * 2
