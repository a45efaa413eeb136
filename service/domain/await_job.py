"""Wait for a job, so that who wants its result need not ask again and again."""

import asyncio
import time
from contextlib import suppress

from db.records import Job
from db.repositories import jobs
from service.domain.context import Context
from service.domain.keys import check_not_ended

MOST_SECONDS = 10.0
"""s that an answer may be kept back: a proxy lets a silent connection live longer, a stopping server waits for it."""

LOOK_SECONDS = 0.25
"""s between two looks at a job that may be done elsewhere, whose end nobody tells."""


async def await_job(context: Context, job_id: str, seconds: float, key_id: str | None = None) -> Job:
    """The job once it has ended, or as it is after so many seconds.

    Raises ``NotFound``, and ``KeyEnded`` as soon as the key of who waits has ended.
    """
    deadline = time.monotonic() + seconds
    while True:
        ending = context.jobs.ending(job_id)  # before the look, so that no end falls between the two
        job = await asyncio.to_thread(_look, context, job_id, key_id)
        left = deadline - time.monotonic()
        if job.finished_at is not None or left <= 0.0:
            return job
        with suppress(TimeoutError):
            await asyncio.wait_for(ending.wait(), min(left, LOOK_SECONDS))


def _look(context: Context, job_id: str, key_id: str | None) -> Job:
    with context.database.read() as session:
        check_not_ended(session, key_id)
        job = jobs.get(session, job_id)
    if job.finished_at is not None:
        context.models.has_ended(context.database, job)
    return job
