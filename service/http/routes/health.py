"""Whether the process lives, and whether it can take work."""

from fastapi import APIRouter

from db.errors import StorageUnavailable
from service.http.dependencies import CurrentContext
from service.http.descriptions import problems
from service.http.fair_route import FairRoute
from service.http.problems import STORAGE_UNAVAILABLE, WORKERS_NOT_READY, Problem, storage_unavailable
from service.http.schemas.health import HealthOut, ReadyOut

router = APIRouter(tags=["health"], route_class=FairRoute)


@router.get("/healthz", summary="Does the process live?", response_model_exclude_none=True)
async def read_health(context: CurrentContext) -> HealthOut:
    """Touches neither database nor disk: it shows what was last seen of them, some seconds ago."""
    trouble = context.watch.trouble if context.watch is not None else None
    return HealthOut() if trouble is None else HealthOut(status="degraded", trouble=trouble)


@router.get("/readyz", summary="Can it take work?", responses=problems(STORAGE_UNAVAILABLE, WORKERS_NOT_READY))
def read_readiness(context: CurrentContext) -> ReadyOut:
    """Tries the database and the blob folder, and waits for the workers' warm-up; the problem names what is missing."""
    context.database.ping()
    context.blobs.ping()
    context.require_room()
    if context.watch is not None and context.watch.trouble is not None:
        raise storage_unavailable(StorageUnavailable(context.watch.trouble))
    if context.jobs.missing is not None:
        raise Problem(WORKERS_NOT_READY, context.jobs.missing)
    return ReadyOut()
