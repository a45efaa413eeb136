"""How much one access key may have: jobs queued, logs and changes a day, bytes of uploads. Without a key nothing is
limited.

An upload is checked twice: before its file is kept, and in the transaction that stores it, for others of the same key
may have been stored meanwhile. What is stored already takes nothing of a quota, and that is known by the content only:
the body is received first. Fits that the service itself queues, after an upload or a curation, are counted but
never refused: without them a material would keep a model that its logs contradict.
"""

from datetime import timedelta

from sqlalchemy.orm import Session

from db.records import AuditAction, NewGraspLog
from db.repositories import access_keys, grasp_logs, usage
from db.tables import now
from service.domain.errors import QuotaExceeded, StorageQuotaExceeded
from service.settings import Settings

DAY = timedelta(days=1)
CHANGES: tuple[AuditAction, ...] = (
    "material.created",
    "material.changed",
    "alias.added",
    "owner.added",
    "sensor.described",
    "grasp_log.sensor_changed",
    "grasp_log.withdrawn",
    "grasp_log.restored",
    "fit.requested",
)
"""Those of which a key could otherwise store any number. What takes a name or a log away is never refused: the first
withdrawal of a log counts, and another reason for it, or its being taken back, may be refused.
"""

JOBS_RETRY_SECONDS, LOGS_RETRY_SECONDS = 10, 3600


def lock(session: Session, settings: Settings, key_id: str | None) -> None:
    """Let what is counted stay true to the end of this transaction, in which something is stored for the key."""
    if key_id is not None and _any_is_set(settings):
        access_keys.lock(session, key_id)


def check_log(session: Session, settings: Settings, key_id: str | None, log: NewGraspLog) -> None:
    """Raises as ``check_upload`` where a key may send no more logs and this one is not stored yet."""
    if key_id is None or not _any_is_set(settings):
        return
    if not grasp_logs.is_stored(session, log.sha256, log.material_id, log.detector):
        check_upload(session, settings, key_id)


def check_upload(session: Session, settings: Settings, key_id: str | None) -> None:
    """Raises ``QuotaExceeded`` or ``StorageQuotaExceeded`` where a key may send no more logs."""
    if key_id is None:
        return
    check_job(session, settings, key_id)
    if (most := settings.key_logs_a_day) is not None and usage.logs_since(session, key_id, now() - DAY) >= most:
        raise _exceeded("logs of the last 24 hours", most, "STICTION_KEY_LOGS_A_DAY", LOGS_RETRY_SECONDS)
    if (most := settings.key_stored_bytes) is not None and (there := usage.stored_bytes(session, key_id)) >= most:
        allowed = f"less than {most} (STICTION_KEY_STORED_BYTES), before another log"
        raise StorageQuotaExceeded("bytes stored by this key", there, allowed)


def check_job(session: Session, settings: Settings, key_id: str | None) -> None:
    """Raises ``QuotaExceeded`` where as many jobs of a key wait as may."""
    most = settings.key_queued_jobs
    if key_id is not None and most is not None and usage.queued_jobs(session, key_id) >= most:
        raise _exceeded("queued jobs", most, "STICTION_KEY_QUEUED_JOBS", JOBS_RETRY_SECONDS)


def check_change(session: Session, settings: Settings, key_id: str | None) -> None:
    """Raises ``QuotaExceeded`` where a key may make no more changes; call it before what is changed is locked."""
    most = settings.key_changes_a_day
    if key_id is None or most is None:
        return
    lock(session, settings, key_id)
    if usage.changes_since(session, key_id, CHANGES, now() - DAY) >= most:
        what = "changes of materials, sensors and stored logs, and fits, in the last 24 hours"
        raise _exceeded(what, most, "STICTION_KEY_CHANGES_A_DAY", LOGS_RETRY_SECONDS)


def _any_is_set(settings: Settings) -> bool:
    quotas = ("key_queued_jobs", "key_logs_a_day", "key_stored_bytes", "key_changes_a_day")
    return any(getattr(settings, quota) is not None for quota in quotas)


def _exceeded(what: str, most: int, setting: str, seconds: int) -> QuotaExceeded:
    return QuotaExceeded(f"{what} of this key are {most}; allowed: {most} ({setting})", seconds)
