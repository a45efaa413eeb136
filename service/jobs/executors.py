"""Which executors a service has, by its settings."""

from db.errors import DriverMissing
from service.jobs.executor import JobExecutor
from service.jobs.process_executor import ProcessExecutor
from service.jobs.worker import StoreConfig


def executors(config: StoreConfig, count: int, dask_address: str | None, cpu_seconds: float) -> list[JobExecutor]:
    """So many worker processes on this machine, or jobs at once on the workers of a Dask scheduler.

    A job of this machine may take ``cpu_seconds``. Raises ``DriverMissing`` for the latter without the library.
    """
    if dask_address is None:
        return [ProcessExecutor(config, cpu_seconds) for _ in range(count)]
    try:
        from service.jobs.dask_executor import DaskExecutor  # an extra, and takes a second to load
    except ModuleNotFoundError as error:
        raise DriverMissing(dask_address, error.name or str(error), "Dask cluster", "dask") from error
    return [DaskExecutor(config, dask_address) for _ in range(count)]


def executor_for_short_jobs(
    config: StoreConfig, count: int, dask_address: str | None, cpu_seconds: float
) -> JobExecutor | None:
    """One more worker process beside the ``count`` of ``executors``, which starts when it is needed.

    None without executors, and on a Dask cluster: one more would get no worker of it while long jobs have them all.
    """
    return None if count == 0 or dask_address is not None else ProcessExecutor(config, cpu_seconds)
