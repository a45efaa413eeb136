"""Looks now and then whether database and files are well, so that a monitor that asks often costs nothing."""

import time

from db import free_room
from db.blobs import BlobStore
from db.database import Database
from db.errors import DatabaseError
from db.repositories import stores
from service.periodic_thread import PeriodicThread

LOOK_SECONDS = 10.0
"""s between two looks."""

SHARE_OF_TIME = 0.01
"""Of its time that the process may spend on reading the pages of an SQLite file."""


class StoreWatch:
    """``trouble`` says what was wrong with the stores when they were last looked at; None: nothing."""

    def __init__(self, database: Database, blobs: BlobStore, least_free_bytes: int) -> None:
        self._database, self._blobs, self._least_free_bytes = database, blobs, least_free_bytes
        self.trouble: str | None = None
        self._damage: str | None = None  # of the pages, which are read more seldom
        self._next_pages = 0.0
        self._thread = PeriodicThread("store watch", LOOK_SECONDS, self.look)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    async def stop(self) -> None:
        """End after the present look."""
        await self._thread.stop()

    def look(self) -> None:
        """Ask, write and read; whatever goes wrong there is trouble, also what nobody thought of."""
        try:
            self._database.ping()
            self._blobs.ping()
            with self._database.write(durable=False) as session:
                stores.require(session, self._database.store_id)
                stores.touch(session)
            self._database.checkpoint()
            self._look_at_pages()
            free_room.require(self._database, self._blobs, self._least_free_bytes)
        except (DatabaseError, OSError) as error:
            self.trouble = str(error)
        except Exception as error:
            self.trouble = f"unexpected {type(error).__name__}; the server's log has it whole"
            raise
        else:
            self.trouble = self._damage

    def _look_at_pages(self) -> None:
        begin = time.monotonic()
        if begin < self._next_pages:
            return
        try:
            self._database.check_pages()
        except DatabaseError as error:
            self._damage = str(error)
        else:
            self._damage = None
        end = time.monotonic()
        self._next_pages = end + (end - begin) / SHARE_OF_TIME
