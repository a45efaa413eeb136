"""Whether the process lives, and whether it can take work."""

from fastapi import APIRouter

from service.context import Given
from service.http.problems import STORAGE_UNAVAILABLE, WORKERS_NOT_READY, Problem
from service.http.routes.common import problems
from service.http.schemas import HealthOut, ReadyOut

router = APIRouter(tags=["health"])


@router.get("/healthz", summary="Does the process live?")
async def read_health() -> HealthOut:
    """Touches neither database nor disk."""
    return HealthOut()


@router.get("/readyz", summary="Can it take work?", responses=problems(STORAGE_UNAVAILABLE, WORKERS_NOT_READY))
def read_readiness(context: Given) -> ReadyOut:
    """Tries the database and the blob folder, and waits for the workers' warm-up; the problem names what is missing."""
    context.database.ping()
    context.blobs.ping()
    if context.jobs.missing is not None:
        raise Problem(WORKERS_NOT_READY, context.jobs.missing)
    return ReadyOut()
