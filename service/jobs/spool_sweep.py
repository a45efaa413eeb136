"""Remove what killed processes left under way; a start that is alone does so, too, but there may be none for long."""

import logging
import time
from pathlib import Path

from db.blobs import BlobStore
from service.periodic_thread import PeriodicThread

logger = logging.getLogger(__name__)

LOOK_SECONDS = 60.0
"""s between two looks into the folder."""

FILE_SECONDS, FOLDER_SECONDS = 3600.0, 86400.0
"""s for which a file that nobody holds, and a folder, has to have been there: a file is held within a moment of its
beginning, and a folder is some reader's, which has four hours at most.
"""


class SpoolSweep:
    """Looks now and then, in every process that works in the folder; by the clock that nobody sets."""

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
        """Remove what has been there for long enough and is nobody's."""
        now = time.monotonic()
        self._seen = {path: self._seen.get(path, now) for path in self._blobs.under_way()}
        removed = sum(self._remove(path, now - seen) for path, seen in self._seen.items())
        if removed:
            logger.warning("removed %d files or folders that killed processes had left under way", removed)

    def _remove(self, path: Path, seconds: float) -> bool:
        least = FOLDER_SECONDS if path.is_dir() else FILE_SECONDS
        return seconds >= least and self._blobs.remove_unheld(path)
