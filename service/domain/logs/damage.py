"""What is reported of a stored file whose bytes are not those of before."""

import logging
from datetime import timedelta

from db.database import Database
from db.errors import BlobDamaged, StorageUnavailable
from db.repositories import audit
from db.tables import now

logger = logging.getLogger(__name__)

TOLD_AGAIN_AFTER = timedelta(days=1)
"""Between two entries on one file: whoever asks for it again and again does not fill the audit trail."""


def record_damage(database: Database, error: BlobDamaged, found_by: str) -> None:
    """Log it, and add it to the audit trail; ``found_by`` is the request, the job or the check that read the file."""
    logger.error("%s (found by %s)", error, found_by)
    try:
        with database.write() as session:
            if not audit.is_recorded(session, "blob.damaged", error.sha256, now() - TOLD_AGAIN_AFTER):
                details = {"found": error.found, "by": found_by}
                audit.add(session, audit.SERVICE, "blob.damaged", error.sha256, details)
    except StorageUnavailable as unavailable:
        logger.error("the damage of blob %s is not in the audit trail: %s", error.sha256, unavailable)
