"""Read the stored files again and again, at a set pace, so that a flipped bit is found while there is a backup."""

import logging
import random
from collections.abc import Callable, Iterator

from db.blobs import BlobStore
from db.database import Database
from db.errors import BlobDamaged, DatabaseError, NotFound
from service.domain.logs.damage import record_damage
from service.periodic_thread import PeriodicThread

logger = logging.getLogger(__name__)

REST_SECONDS = 60.0
"""s between two passes, and between two looks whether it is this process that is to scrub."""

PREFIXES = 256
"""Folders that blobs are in, by the first byte of their hash."""


class Scrub:
    """Reads ``bytes_per_second`` in whichever process ``leads`` the others; 0: none.

    Only files in a folder: an object store does so itself. A pass begins anywhere, so that processes which end before
    they are through have read everything after some time.
    """

    def __init__(
        self, database: Database, blobs: BlobStore, bytes_per_second: float, leads: Callable[[], bool]
    ) -> None:
        self._database, self._blobs, self._pace, self._leads = database, blobs, bytes_per_second, leads
        self.bytes = self.passes = 0
        self._thread = PeriodicThread("scrub", REST_SECONDS, self._look)

    def start(self) -> None:
        """Begin, where there is something to read."""
        if self._pace > 0.0 and not self._blobs.is_remote:
            self._thread.start()

    async def stop(self) -> None:
        """End after the file that is being read."""
        await self._thread.stop()

    def read_all(self) -> None:
        """One pass over all files, at the set pace; ends early once it is told to stop."""
        for sha256 in self._hashes():
            size = self._read(sha256)
            self.bytes += size
            if self._thread.sleep(size / self._pace):
                return
        self.passes += 1

    def _look(self) -> None:
        if not self._leads():
            return
        try:
            self.read_all()
        except DatabaseError as error:
            logger.warning("files are not read through: %s", error)
        except Exception:
            logger.exception("files are not read through")

    def _hashes(self) -> Iterator[str]:
        first = random.randrange(PREFIXES)
        for number in range(PREFIXES):
            yield from self._blobs.hashes_under(f"{(first + number) % PREFIXES:02x}")

    def _read(self, sha256: str) -> int:
        """The file's size in bytes."""
        try:
            return self._blobs.path(sha256).stat().st_size
        except (NotFound, FileNotFoundError):  # old, and deleted meanwhile
            return 0
        except BlobDamaged as error:
            record_damage(self._database, error, "scrub")
            return self._blobs.locate(sha256).stat().st_size
