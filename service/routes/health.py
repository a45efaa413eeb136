"""Whether the process lives, and whether it can take work."""

from fastapi import APIRouter

from service.context import Given
from service.problems import STORAGE_UNAVAILABLE
from service.routes.common import problems
from service.schemas import HealthOut, ReadyOut

router = APIRouter(tags=["health"])


@router.get("/healthz", summary="Does the process live?")
async def read_health() -> HealthOut:
    """Touches neither database nor disk."""
    return HealthOut()


@router.get("/readyz", summary="Can it take work?", responses=problems(STORAGE_UNAVAILABLE))
def read_readiness(context: Given) -> ReadyOut:
    """Tries the database and the blob folder; the problem names what is missing."""
    context.database.ping()
    context.blobs.ping()
    return ReadyOut()
