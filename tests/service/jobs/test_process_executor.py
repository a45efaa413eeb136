import asyncio
import time
from functools import partial
from pathlib import Path

import pytest

from service.jobs import worker
from service.jobs.process_executor import ProcessExecutor
from service.jobs.worker import StoreConfig


def test_a_worker_that_still_warms_up_holds_no_stop_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker, "warm_up", partial(time.sleep, 600.0))

    async def stop() -> float:
        executor = ProcessExecutor(StoreConfig("sqlite:///x", tmp_path), 300.0)
        starting = asyncio.create_task(executor.start())
        await asyncio.sleep(2.0)  # by now the process sleeps, or starts still
        began = time.monotonic()
        starting.cancel()
        await asyncio.wait([starting])
        await executor.close()
        return time.monotonic() - began

    assert asyncio.run(stop()) < 60.0  # not 600 s
