"""Remove files that killed processes left in the spool.

A server that starts alone in the folder clears it at once (``BlobStore.clear_spool``); beside others it never may, so
each looks for what is old and held by nobody.
"""

import logging
import time
from pathlib import Path

from db.blobs import BlobStore
from service.periodic_thread import PeriodicThread

logger = logging.getLogger(__name__)

LOOK_SECONDS = 60.0
"""Between two looks into the folder, s."""

FILE_SECONDS, FOLDER_SECONDS = 3600.0, 86400.0
"""Age, s, from which a file that no process holds, and a folder, are removed. Processes lock a file as they create it,
but no folder: that is a reader's, which has four hours at most.
"""


class SpoolSweep:
    """Looks once in ``LOOK_SECONDS``, in every process that works in the folder; ages are by the monotonic clock, since
    files' own times are by one that may be set.
    """

    def __init__(self, blobs: BlobStore) -> None:
        self._blobs = blobs
        self._seen: dict[Path, float] = {}
        self._thread = PeriodicThread("spool sweep", LOOK_SECONDS, self.look)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    async def stop(self) -> None:
        """End after the present look."""
        await self._thread.stop()

    def look(self) -> None:
        """Remove what was first seen long enough ago and is held by no process."""
        now = time.monotonic()
        self._seen = {path: self._seen.get(path, now) for path in self._blobs.under_way()}
        removed = sum(self._remove(path, now - seen) for path, seen in self._seen.items())
        if removed:
            logger.warning("removed %d files or folders that killed processes had left in the spool", removed)

    def _remove(self, path: Path, seconds: float) -> bool:
        least = FOLDER_SECONDS if path.is_dir() else FILE_SECONDS
        return seconds >= least and self._blobs.remove_unheld(path)
