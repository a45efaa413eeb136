import asyncio
import time
from functools import partial
from pathlib import Path

import pytest

from service.jobs import worker
from service.jobs.process_lane import ProcessLane
from service.jobs.worker import Place


def test_a_worker_that_still_warms_up_holds_no_stop_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker, "warm_up", partial(time.sleep, 600.0))

    async def stop() -> float:
        lane = ProcessLane(Place("sqlite:///x", tmp_path), 300.0)
        hiring = asyncio.create_task(lane.hire())
        await asyncio.sleep(2.0)  # by now the process sleeps, or starts still
        began = time.monotonic()
        hiring.cancel()
        await asyncio.wait([hiring])
        await lane.close()
        return time.monotonic() - began

    assert asyncio.run(stop()) < 60.0  # not 600 s
