from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import httpx
import pytest

from service.demo import inputs
from service.settings import Settings
from tests.service.web.conftest import HTML, OWN
from tests.waiting import wait_until

FRICTION = {"cardboard": 0.45}


@pytest.fixture
def empty(
    serving: Callable[[Settings], AbstractContextManager[httpx.Client]],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> Iterator[httpx.Client]:
    """A server of its own, without a worker, whose demo has two grasps of one material."""
    monkeypatch.setattr(inputs, "FRICTION", FRICTION)
    monkeypatch.setattr(inputs, "NORMAL_FORCES", inputs.NORMAL_FORCES[:2])
    with serving(Settings(data_folder=tmp_path, workers=0)) as client:
        client.headers.update(HTML | OWN)
        yield client


def test_a_button_uploads_the_simulated_grasps_once(empty: httpx.Client, tmp_path: Path) -> None:
    for _ in range(2):
        answer = empty.post("/practice")
        assert (answer.status_code, answer.headers["location"]) == (303, "/jobs"), answer.text
        found = empty.get("/v1/grasp-logs").json()["items"]
        assert [(log["material"], log["job"]["status"]) for log in found] == [("simulated cardboard", "queued")] * 2
    assert "simulated cardboard" in empty.get("/").text
    uploaded: list[Any] = empty.get("/v1/audit?action=grasp_log.uploaded").json()["items"]
    assert [entry["details"]["new"] for entry in uploaded] == [True, True]
    wait_until(lambda: not list((tmp_path / "spool").iterdir()), "the files of the uploads to go")
