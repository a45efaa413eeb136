"""An executor: where one job at a time is done, and how that may end."""

from typing import Protocol

from db.records import Claim

RETRY_SECONDS = 1.0
"""s between two tries to start a worker that does not start."""


class WorkerDied(Exception):
    """The worker process ended under its job."""


class LimitReached(WorkerDied):
    """The worker process was ended, for its job took more than it may; the message says what."""


def reason_of(error: Exception) -> str:
    """What the record of a job that failed says of the error: its first line, as others may hold an SQL statement."""
    return f"{type(error).__name__}: {error}".splitlines()[0]


class JobExecutor(Protocol):
    """One job at a time.

    ``missing``: what it waits for before it can do jobs, where that is not just a process's start.
    """

    missing: str | None

    async def start(self) -> None:
        """Make sure that there is a worker and that it is warm."""

    async def run(self, claim: Claim) -> None:
        """Do one job; raises ``WorkerDied``, ``LimitReached`` and ``StorageUnavailable``."""

    def kill(self) -> None:
        """End the worker at once, whatever it does."""

    async def close(self) -> None:
        """Let the worker go once it has nothing to do."""
