"""Wait for a job, so that who wants its result need not ask again and again."""

import asyncio
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from db.records import Job
from db.repositories import jobs
from service.domain.access.keys import check_not_ended
from service.domain.access.principal import ANONYMOUS, Principal
from service.domain.resources.context import Context

MOST_SECONDS = 10.0
"""s that an answer may be kept back: a proxy lets a silent connection live longer, a stopping server waits for it."""

LOOK_SECONDS = 0.25
"""s between two looks at a job that may be done elsewhere, whose end nobody reports."""

LOOKERS, MOST_LOOK_SECONDS = 16, 2.0
"""Waits of one client that look so often; with more of them each looks more seldom, down to this."""


async def await_job(context: Context, job_id: str, seconds: float, principal: Principal = ANONYMOUS) -> Job:
    """The job once it has ended, or as it is after so many seconds.

    Raises ``NotFound``, and ``KeyEnded`` as soon as the key of who waits has ended.
    """
    deadline = time.monotonic() + seconds
    while True:
        ending = context.jobs.ending(job_id)  # before the look, so that no end falls between the two
        job = await context.threads.run(principal.share, _look, context, job_id, principal.key_id)
        left = deadline - time.monotonic()
        if job.finished_at is not None or left <= 0.0:
            return job
        with suppress(TimeoutError), _counted(context.waits, principal.share) as waits:
            pause = max(LOOK_SECONDS, min(LOOK_SECONDS * waits / LOOKERS, MOST_LOOK_SECONDS))
            await asyncio.wait_for(ending.wait(), min(left, pause))


@contextmanager
def _counted(waits: Counter[str], owner: str) -> Iterator[int]:
    """How many of the owner's waits there are with this one."""
    waits[owner] += 1
    try:
        yield waits[owner]
    finally:
        waits[owner] -= 1
        if not waits[owner]:
            del waits[owner]


def _look(context: Context, job_id: str, key_id: str | None) -> Job:
    with context.database.read() as session:
        check_not_ended(session, key_id)
        job = jobs.get(session, job_id)
    if job.finished_at is not None:
        context.models.has_ended(context.database, job)
    return job
