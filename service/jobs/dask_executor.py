"""An executor on the workers of a Dask cluster: the same jobs, on other machines.

The client lives in the event loop of the server. One of its own thread would be asked from here, and where it waits for
a scheduler that is gone, so would the server.
"""

import asyncio
import logging
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from distributed import Client, KilledWorker

from db.records import Claim
from service.jobs import worker
from service.jobs.executor import RETRY_SECONDS, WorkerDied
from service.jobs.worker import StoreConfig

logger = logging.getLogger(__name__)

CONNECT_SECONDS = 5.0
"""s that the scheduler may take to answer, and to say goodbye."""


class DaskExecutor:
    """One job at a time on whichever worker the scheduler chooses. The workers see the same database and folder.

    A job whose worker dies is done by another one as long as the scheduler puts up with it. A worker that lost touch
    and goes on stores the same, or nothing once the job has ended.
    """

    def __init__(self, config: StoreConfig, address: str) -> None:
        self._config, self._address = config, address
        self._client: Any = None
        self.missing: str | None = None

    async def start(self) -> None:
        """Wait for the scheduler, and for one of its workers to be warm."""
        while True:
            try:
                await self._connect()
                self.missing = f"no worker of the Dask scheduler {self._address} is warm yet"
                await self._do(worker.warm_up)
            except (OSError, WorkerDied) as error:
                self.missing = f"the Dask scheduler {self._address} does not answer"
                logger.error("%s: %s", self.missing, error)
                await asyncio.sleep(RETRY_SECONDS)
            else:
                self.missing = None
                return

    async def run(self, claim: Claim) -> None:
        """Do one job; raises ``WorkerDied`` where worker after worker died under it, or the scheduler did."""
        await self._do(worker.run_job, self._config, claim)

    def kill(self) -> None:
        """Nothing: a worker of the cluster has other work, and without its claim the job stores nothing."""

    async def close(self) -> None:
        """Leave the cluster; what it has not begun for us is forgotten there."""
        if self._client is not None:
            client, self._client = self._client, None
            with suppress(OSError):  # the scheduler is gone already
                await client.close(timeout=CONNECT_SECONDS)

    async def _connect(self) -> None:
        if self._client is not None and self._client.status == "running":
            return
        await self.close()
        self._client = Client(self._address, asynchronous=True, timeout=CONNECT_SECONDS, set_as_default=False)  # type: ignore[no-untyped-call]
        await self._client

    async def _do(self, do: Callable[..., None], *given: Any) -> None:
        future = asyncio.wrap_future(self._client.get_executor(pure=False).submit(do, *given))
        await asyncio.wait([future])  # who waits may be cancelled; to cancel the future would be to ask the scheduler
        if future.cancelled():
            raise WorkerDied(f"the connection to {self._address} is lost")
        try:
            future.result()
        except KilledWorker as error:
            raise WorkerDied(str(error)) from error
