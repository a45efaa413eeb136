"""Commands on the files that are stored: prune."""

from datetime import timedelta
from typing import TYPE_CHECKING, Annotated, Any

import typer

from db.defaults import QUARANTINE_AGE
from service.cli.durations import duration, in_words
from service.cli.options import Json
from service.cli.output import print_json
from service.cli.stores import Url, command_actor, opened, opened_blobs

if TYPE_CHECKING:
    from db.blobs import BlobStore
    from db.database import Database

app = typer.Typer(help="Look after the files that are stored.", no_args_is_help=True)


@app.command()
def prune(
    older_than: Annotated[
        str | None,
        typer.Option(help="Age of uploads such as 90d or 12h; by default that of STICTION_KEEP_UPLOADS_DAYS, if set."),
    ] = None,
    grace: Annotated[
        str | None,
        typer.Option(help="How long unreferenced files are in quarantine; by default 7d, or the setting's days."),
    ] = None,
    delete: Annotated[bool, typer.Option("--delete", help="Delete what is otherwise only listed.")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only say what would go, also with an age.")] = False,
    trust_clock: Annotated[
        bool, typer.Option("--trust-clock", help="Delete by a clock that nothing stored vouches for.")
    ] = False,
    database_url: Url = None,
    json: Json = False,
) -> None:
    """Say what may be deleted, and with --delete do so: old uploads, and files to which nothing refers.

    Uploads go once they are older than an age, if their jobs have ended; what was found in them stays. Unreferenced
    files are set aside first. The service may run meanwhile. --older-than without --delete is about old uploads only,
    and without --dry-run deletes them, as it always did. Nothing is deleted by a clock that may be wrong.
    """
    from db import identity, migrate
    from service.jobs.steady_clock import doubt
    from service.settings import Settings

    if delete and dry_run:
        raise typer.BadParameter("delete and dry-run are both set; allowed: one of them")
    age = _age("older-than", older_than, Settings().keep_uploads_days)
    chosen = _age("grace", grace, Settings().keep_unreferenced_days)
    waiting = QUARANTINE_AGE if chosen is None else chosen
    uploads_only = older_than is not None and not delete
    deletes = delete or (uploads_only and not dry_run)
    done: dict[str, Any] = {"deleted": deletes}
    with opened(database_url) as database:
        migrate.check(database)
        blobs = opened_blobs()
        identity.verify(database, blobs)
        with database.read() as session:
            doubtful = doubt(session) if deletes and not trust_clock else None
        if doubtful is not None:
            raise typer.BadParameter(f"the clock says {doubtful}; allowed: --trust-clock, where it is right")
        if age is not None:
            done["uploads"] = _prune_uploads(database, blobs, age, delete=deletes)
            if not json:
                _tell_uploads(done["uploads"], deleted=deletes)
        if not uploads_only:
            done["unreferenced"] = _prune_unreferenced(database, blobs, waiting, delete=deletes)
            if not json:
                _tell_unreferenced(done["unreferenced"], deleted=deletes, waiting=in_words(waiting))
    if json:
        print_json(done)


def _tell_uploads(found: dict[str, int], *, deleted: bool) -> None:
    what = f"{found['files']} uploads ({found['bytes']} bytes)"
    typer.echo(f"deleted {what}" if deleted else f"{what} would be deleted")


def _tell_unreferenced(found: dict[str, int], *, deleted: bool, waiting: str) -> None:
    if deleted:
        typer.echo(f"deleted {found['files']} unreferenced files")
        typer.echo(f"set {found['set_aside']} unreferenced files aside")
    else:
        typer.echo(f"{found['files']} unreferenced files would be deleted, which are in quarantine for {waiting}")
        typer.echo(f"{found['set_aside']} unreferenced files would be set aside")


def _prune_uploads(database: "Database", blobs: "BlobStore", age: timedelta, *, delete: bool) -> dict[str, int]:
    """Of old uploads, how many files and bytes are deleted, or would be."""
    from db.repositories import uploads
    from db.tables import now
    from service.jobs.retention import prune as delete_old

    before = now() - age
    with database.read() as session:
        count, size = uploads.count_old(session, before)
    if delete:
        count = delete_old(database, blobs, before, actor=command_actor())
    return {"files": count, "bytes": size}


def _prune_unreferenced(database: "Database", blobs: "BlobStore", grace: timedelta, *, delete: bool) -> dict[str, int]:
    """How many files that nothing refers to are deleted and set aside, or would be."""
    from service.jobs import garbage

    if delete:
        deleted = garbage.delete_set_aside(database, blobs, grace, command_actor())
        return {"files": deleted, "set_aside": garbage.set_aside(database, blobs)}
    old, new = garbage.find_deletable(database, blobs, grace), garbage.find_unreferenced(database, blobs)
    return {"files": sum(1 for _ in old), "set_aside": sum(1 for _ in new)}


def _age(name: str, text: str | None, days: float | None) -> timedelta | None:
    """What an option says, or else a setting."""
    if text is None:
        return None if days is None else timedelta(days=days)
    return duration(name, text)
