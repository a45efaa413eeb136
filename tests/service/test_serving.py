"""What the server does beside its application."""

import asyncio
import logging
from pathlib import Path

import pytest
import uvicorn

from service.processes import limits
from service.serving import Server, configuration, dashboard
from service.settings import Settings


async def nothing(_scope: object, _receive: object, _send: object) -> None:
    """An application that is never asked."""


def test_the_address_of_the_dashboard_is_told_once_it_listens(caplog: pytest.LogCaptureFixture) -> None:
    server = Server(uvicorn.Config(nothing, port=0, interface="asgi3", ws="none", lifespan="off", log_config=None))
    server.should_exit = True
    with caplog.at_level(logging.INFO, "service.serving"):
        asyncio.run(server.serve())
    assert "the dashboard is at http://127.0.0.1:" in caplog.text


@pytest.mark.parametrize(
    ("address", "told"),
    [
        (("127.0.0.1", 8000), "http://127.0.0.1:8000/"),
        (("0.0.0.0", 80), "http://127.0.0.1:80/"),
        (("::", 8000, 0, 0), "http://[::1]:8000/"),
        (("fe80::1", 8000, 0, 0), "http://[fe80::1]:8000/"),
    ],
)
def test_the_address_is_one_that_a_browser_can_open(address: tuple[str, int], told: str) -> None:
    assert dashboard(address) == told


@pytest.mark.parametrize(("allowed", "connections"), [(10**6, 1000), (2200, 1000), (1024, 412), (64, 1)])
def test_no_more_connections_are_taken_than_there_may_be_files_for(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    allowed: int,
    connections: int,
) -> None:
    """Else a few hundred bodies on their way leave no file for anybody, nor for the database."""
    wanted: list[int] = []
    monkeypatch.setattr(limits, "open_files", lambda files: wanted.append(files) or allowed)
    served = configuration(Settings(data_folder=tmp_path, max_connections=1000))
    assert (served.limit_concurrency, wanted) == (connections, [2200])
    assert ("LimitNOFILE" in caplog.text) == (connections < 1000)
