"""Commands on the database: its schema (upgrade, downgrade, current, check), and copies of all that is stored."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.exit_codes import INPUT_REFUSED
from service.cli.options import Json
from service.cli.output import print_json
from service.cli.stores import Url, command_actor, opened, opened_blobs

if TYPE_CHECKING:
    from db.database import Database

app = typer.Typer(help="Create, upgrade, check, back up and restore what is stored.", no_args_is_help=True)

REFERS_TO_NONE = (
    "the database refers to no file: the service starts without any log, and the {} files there belong to none. They "
    "are kept as long as that is so. If their database is lost, fill a new, empty one from a backup by "
    "`stiction db restore --take-over BACKUP`; if you named a wrong database, name theirs and adopt them with that"
)


def _named(folder: str) -> Path:
    """A folder by its name: an empty one, as of a variable that is not set, would be the one where one is."""
    if not folder:
        raise typer.BadParameter("the name of the folder is empty; allowed: the name of a folder")
    return Path(folder)


def _tell_keys(database: "Database") -> None:
    """That keys of a backup are good again that were revoked since, which nobody would look for."""
    from db.repositories import access_keys
    from service.domain.access.keys import is_valid

    with database.read() as session:
        valid = sum(is_valid(key) for key in access_keys.list_all(session))
    if valid:
        remark = "valid as in the backup: revoke those that were revoked since (`stiction keys list`)"
        typer.echo(f"{valid} access key(s) are {remark}", err=True)


def _tell_without(left_out: list[str]) -> str:
    """Name the files that a copy lacks, and say how many they are."""
    for line in left_out:
        typer.echo(line, err=True)
    return f", without {len(left_out)} file(s) that are missing or damaged" if left_out else ""


@app.command()
def upgrade(database_url: Url = None) -> None:
    """Bring the database to this version's schema; a new one gets all its tables."""
    from db import migrate

    with opened(database_url, may_be_new=True) as database:
        migrate.upgrade(database)
        typer.echo(f"at revision {migrate.current(database)}")


@app.command()
def downgrade(
    revision: Annotated[str, typer.Argument(help="Revision to go back to; `base` removes every table and its data.")],
    database_url: Url = None,
    lose: Annotated[
        bool, typer.Option("--lose", help="Also where that loses what is stored: it is named, with how much, without.")
    ] = False,
) -> None:
    """Bring the database back to an older schema; what that would lose is named, and refused with exit code 3."""
    from db import migrate

    with opened(database_url) as database:
        migrate.downgrade(database, revision, lose=lose)
        typer.echo(f"at revision {migrate.current(database)}")


@app.command()
def current(database_url: Url = None, json: Json = False) -> None:
    """Print the database's revision."""
    from db import migrate

    with opened(database_url) as database:
        found = migrate.current(database)
    if json:
        print_json({"revision": found, "newest": migrate.head()})
    else:
        typer.echo(found or "empty")


@app.command()
def check(
    database_url: Url = None,
    deep: Annotated[
        bool, typer.Option("--deep", help="Read every file, too: its bytes must be those of before.")
    ] = False,
    json: Json = False,
) -> None:
    """Make sure that the schema is this version's, that an SQLite file is whole, and that every file that rows refer to
    is there; exit code 3 if not.
    """
    from db import identity, migrate
    from db.backup import damaged

    with opened(database_url) as database:
        migrate.check(database)
        database.check_pages()  # of a file that was opened: another is nobody's yet
        if not json:
            typer.echo("the schema is this version's")
        blobs = opened_blobs()
        identity.verify(database, blobs)
        found = list(map(_named_on_stderr, damaged(database, blobs, deep=deep)))
    if json:
        print_json({"revision": migrate.head(), "deep": deep, "damaged": found})
    if found:
        raise typer.Exit(INPUT_REFUSED)
    if not json:
        typer.echo("every file is there" + (", and as it was" if deep else ""))


def _named_on_stderr(line: str) -> str:
    """Say on standard error what is damaged, as soon as it is found: to read all files takes long."""
    typer.echo(line, err=True)
    return line


@app.command()
def backup(
    folder: Annotated[
        Path,
        typer.Argument(parser=_named, help="Where to; blobs of an earlier backup that are in it are not copied."),
    ],
    database_url: Url = None,
) -> None:
    """Copy everything, rows and blobs, into a folder, as of one moment; the service may run meanwhile.

    Blobs that are missing or damaged are left out and named, with exit code 3.
    """
    from db import identity, migrate
    from db.backup import backup as copy_out

    with opened(database_url) as database:
        migrate.check(database)
        blobs = opened_blobs()
        identity.verify(database, blobs)
        left_out = copy_out(database, blobs, folder, _tell)
    typer.echo(f"backed up to {folder}{_tell_without(left_out)}")
    if left_out:
        raise typer.Exit(INPUT_REFUSED)


@app.command()
def restore(
    folder: Annotated[Path, typer.Argument(parser=_named, help="A folder that `stiction db backup` made.")],
    database_url: Url = None,
    take_over: Annotated[
        bool, typer.Option("--take-over", help="Into files of another database, which is refused there from then on.")
    ] = False,
) -> None:
    """Fill an empty database, SQLite or PostgreSQL, and its blob store from a backup."""
    from db.backup import restore as copy_in
    from db.blobs import FOLDERS
    from service.processes.data_folder import removed_unless_filled
    from service.settings import Settings

    parts = removed_unless_filled(Settings().data_folder, FOLDERS)
    with parts, opened(database_url, may_be_new=True) as database:
        taken_over_by = command_actor() if take_over else None
        left_out = copy_in(folder, database, opened_blobs(), _tell, taken_over_by=taken_over_by)
        _tell_keys(database)
    typer.echo(f"restored from {folder}{_tell_without(left_out)}")


@app.command()
def adopt(database_url: Url = None) -> None:
    """Join the database and its files by hand where a start refuses them; nothing else works with either after that."""
    from db import identity, migrate

    with opened(database_url) as database:
        migrate.check(database)
        adopted = identity.adopt(database, opened_blobs(), command_actor())
    found = f"{adopted.referenced - adopted.missing} of {adopted.referenced} files that rows refer to are there"
    typer.echo(f"joined as store {adopted.store_id}: {found}")
    if adopted.present and not adopted.referenced:
        typer.echo(REFERS_TO_NONE.format(adopted.present), err=True)


def _tell(what: str, count: int) -> None:
    """Say on standard error what was copied, blobs once in a while."""
    if what != "blobs" or count % 100 == 0:
        typer.echo(f"{what}: {count}", err=True)
