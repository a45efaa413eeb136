"""Which lanes a service has, by its settings."""

from db.errors import DriverMissing
from service.jobs.lane import Lane
from service.jobs.process_lane import ProcessLane
from service.jobs.worker import Place


def lanes(place: Place, count: int, dask_address: str | None, cpu_seconds: float) -> list[Lane]:
    """So many worker processes on this machine, or jobs at once on the workers of a Dask scheduler.

    A job of this machine may take ``cpu_seconds``. Raises ``DriverMissing`` for the latter without the library.
    """
    if dask_address is None:
        return [ProcessLane(place, cpu_seconds) for _ in range(count)]
    try:
        from service.jobs.dask_lane import DaskLane  # an extra, and takes a second to load
    except ModuleNotFoundError as error:
        raise DriverMissing(dask_address, error.name or str(error), "Dask cluster", "dask") from error
    return [DaskLane(place, dask_address) for _ in range(count)]


def lane_for_short_jobs(place: Place, count: int, dask_address: str | None, cpu_seconds: float) -> Lane | None:
    """One more worker process beside the ``count`` of ``lanes``, started when somebody hires it.

    None without lanes, and on a Dask cluster: a lane more would get no worker of it while long jobs have them all.
    """
    return None if count == 0 or dask_address is not None else ProcessLane(place, cpu_seconds)
