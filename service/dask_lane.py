"""A lane on the workers of a Dask cluster: the same jobs, on other machines."""

import asyncio
import logging
from typing import Any

from distributed import Client, KilledWorker, Worker, WorkerPlugin

from db.records import Claim
from service import worker
from service.lanes import RETRY_SECONDS, WorkerDied
from service.worker import Place

logger = logging.getLogger(__name__)

CONNECT_SECONDS = 10
"""s that the scheduler may take to answer."""


class WarmUp(WorkerPlugin):
    """Every worker of the cluster, also one that joins later, is warm before its first job."""

    name = "stiction-warm-up"

    def setup(self, worker: Worker) -> None:  # noqa: ARG002
        """Warm this worker up."""
        from service.worker import warm_up

        warm_up()


class DaskLane:
    """One job at a time on whichever worker the scheduler chooses. The workers see the same database and folder."""

    def __init__(self, place: Place, address: str) -> None:
        self._place, self._address = place, address
        self._client: Any = None

    async def hire(self) -> None:
        """Make sure that the scheduler answers and that its workers are warm."""
        while self._client is None or self._client.status != "running":
            await self.close()
            try:
                self._client = await asyncio.to_thread(_connect, self._address)
            except OSError as error:
                logger.error("the Dask scheduler %s does not answer: %s", self._address, error)
                await asyncio.sleep(RETRY_SECONDS)

    async def run(self, claim: Claim) -> None:
        """Do one job; raises ``WorkerDied`` where its workers died one after the other, or the scheduler did."""
        future = self._client.get_executor(pure=False).submit(worker.run_job, self._place, claim)
        try:
            await asyncio.wrap_future(future)
        except (KilledWorker, OSError) as error:
            raise WorkerDied from error
        except asyncio.CancelledError:
            task = asyncio.current_task()
            if task is not None and task.cancelling():
                raise
            raise WorkerDied from None  # the scheduler is gone, and with it what it was to do

    def kill(self) -> None:
        """Nothing: a worker of the cluster has other work, and without its claim the job stores nothing."""

    async def close(self) -> None:
        """Leave the cluster."""
        if self._client is not None:
            client, self._client = self._client, None
            await asyncio.to_thread(client.close)


def _connect(address: str) -> Any:
    client: Any = Client(address, timeout=CONNECT_SECONDS, set_as_default=False)  # type: ignore[no-untyped-call]
    client.register_plugin(WarmUp())
    return client
