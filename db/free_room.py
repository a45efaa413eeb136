"""Room on the disks of database and files, looked at before a write finds that there is none."""

import shutil

from db.blobs import BlobStore, disk_errors_named
from db.database import Database
from db.errors import StorageUnavailable


def require(database: Database, blobs: BlobStore, least_bytes: int) -> None:
    """Make sure that so many bytes are free where each of them writes; raises ``StorageUnavailable``.

    What another machine keeps, a server's database or an object store, is not looked at, nor is a file system that says
    nothing of its size, as some of user space do.
    """
    for store, folder in ((blobs, blobs.disk), (database, database.disk)):
        if folder is None:
            continue
        with disk_errors_named():
            total, _, free = shutil.disk_usage(folder)
        if total and free < least_bytes:
            raise StorageUnavailable(f"{store}: its disk is nearly full, {free} bytes are free; allowed: {least_bytes}")
