"""The service's own database and blob store, as commands open them, and who runs a command."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from db.blobs import BlobStore
    from db.database import Database
    from db.records import Actor

Url = Annotated[
    str | None, typer.Option("--database-url", help="SQLAlchemy URL; by default the one that the service uses.")
]


def opened_blobs() -> "BlobStore":
    """The service's own blob store."""
    from db.blobs import open_blobs
    from service.processes import data_folder
    from service.settings import Settings

    settings = Settings()
    data_folder.prepare(settings.data_folder)
    return open_blobs(settings.data_folder, settings.blob_url, settings.blob_cache_bytes)


def command_actor() -> "Actor":
    """Whoever runs this command, as the audit trail names it."""
    import getpass

    from db.records import Actor

    try:
        user = getpass.getuser()
    except (KeyError, OSError):  # a container's user without a name
        user = str(os.getuid())
    return Actor(f"command:{user[:100]}")


@contextmanager
def opened(url: str | None, *, may_be_new: bool = False) -> Iterator["Database"]:
    """The database at this URL, or the service's own; raises ``NotFound`` for a file that isn't there.

    SQLite would make one: in a folder that was named wrongly, a command should not leave a database behind. Raises
    ``UnusableFolder`` where no folder can have that name.
    """
    from db.database import Database
    from db.errors import NotFound
    from service.processes import data_folder, private_files
    from service.settings import Settings

    private_files.withhold()
    if url is None:
        settings = Settings()
        if may_be_new:
            data_folder.prepare(settings.data_folder)
        elif settings.database_url is None:
            data_folder.require_possible(settings.data_folder)
        url = settings.resolved_database_url
    database = Database(url)
    if database.is_missing and not may_be_new:
        missing = NotFound("database", str(database.engine.url.database))
        missing.add_note(
            "`stiction serve` makes one; STICTION_DATA_FOLDER or STICTION_DATABASE_URL names another (docs/settings.md)"
        )
        raise missing
    try:
        yield database
    finally:
        database.close()
