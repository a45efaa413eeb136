"""How much one access key may have: jobs queued, logs a day, bytes of uploads. Without a key nothing is limited.

An upload is checked twice: before its body is received, and in the transaction that stores it, for others of the same
key may have been stored meanwhile. Fits that the service itself queues, after an upload or a curation, are counted but
never refused: without them a material would keep a model that its logs contradict.
"""

from datetime import timedelta

from sqlalchemy.orm import Session

from db.repositories import access_keys, usage
from db.tables import now
from service.http.problems import QUOTA_EXCEEDED, STORAGE_QUOTA_EXCEEDED, Problem
from service.settings import Settings

DAY = timedelta(days=1)
JOBS_RETRY_SECONDS, LOGS_RETRY_SECONDS = 10, 3600


def lock(session: Session, settings: Settings, key_id: str | None) -> None:
    """Let what is counted stay true to the end of this transaction, in which something is stored for the key."""
    quotas = (settings.key_queued_jobs, settings.key_logs_a_day, settings.key_stored_bytes)
    if key_id is not None and any(most is not None for most in quotas):
        access_keys.lock(session, key_id)


def check_upload(session: Session, settings: Settings, key_id: str | None) -> None:
    """Raises ``Problem`` where a key has all that it may have, and so may send no more logs."""
    if key_id is None:
        return
    check_job(session, settings, key_id)
    if (most := settings.key_logs_a_day) is not None and usage.logs_since(session, key_id, now() - DAY) >= most:
        raise _exceeded("logs of the last 24 hours", most, "STICTION_KEY_LOGS_A_DAY", LOGS_RETRY_SECONDS)
    if (most := settings.key_stored_bytes) is not None and (there := usage.stored_bytes(session, key_id)) >= most:
        allowed = f"less than {most} (STICTION_KEY_STORED_BYTES), before another log"
        raise Problem.wrong_value(STORAGE_QUOTA_EXCEEDED, "bytes stored by this key", there, allowed)


def check_job(session: Session, settings: Settings, key_id: str | None) -> None:
    """Raises ``Problem`` where as many jobs of a key wait as may."""
    most = settings.key_queued_jobs
    if key_id is not None and most is not None and usage.queued_jobs(session, key_id) >= most:
        raise _exceeded("queued jobs", most, "STICTION_KEY_QUEUED_JOBS", JOBS_RETRY_SECONDS)


def _exceeded(what: str, most: int, setting: str, seconds: int) -> Problem:
    detail = f"{what} of this key are {most}; allowed: {most} ({setting})"
    return Problem(QUOTA_EXCEEDED, detail, headers={"Retry-After": str(seconds)})
