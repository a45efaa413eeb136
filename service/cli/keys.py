"""Commands on access keys: create, list, revoke. They work on the database, with or without a running service."""

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from service.cli.database import Url, opened
from service.cli.output import print_json, print_table

if TYPE_CHECKING:
    from db.database import Database
    from db.records import AccessKey

app = typer.Typer(help="Make, list and revoke access keys.", no_args_is_help=True)
Json = Annotated[bool, typer.Option("--json", help="Print JSON for a program to read.")]


@app.command()
def create(
    name: Annotated[str, typer.Argument(help="What the key is for, such as the robot that gets it.")],
    scope: Annotated[
        Literal["read", "upload", "admin"],
        typer.Option(help="What it may do; each implies those before."),
    ] = "read",
    database_url: Url = None,
    json: Json = False,
) -> None:
    """Make a key and print it: this once, for only its digest is stored."""
    from db.repositories import access_keys
    from service.http.access import digest, new_key

    if not 0 < len(name) <= 100 or not name.isprintable():
        raise typer.BadParameter(f"name is {name!r}; allowed: 1 to 100 printable characters")
    key_id, text = new_key()
    with opened(database_url, may_be_new=True) as database:
        _prepare(database)
        with database.write() as session:
            stored = access_keys.add(session, key_id, name, scope, digest(text))
    if json:
        print_json(_shown(stored) | {"key": text})
    else:
        typer.echo(text)


@app.command("list")
def list_keys(database_url: Url = None, json: Json = False) -> None:
    """List all keys, the revoked ones too; the keys themselves are not to be had again."""
    from db.repositories import access_keys

    with opened(database_url) as database:
        _prepare(database)
        with database.read() as session:
            shown = [_shown(key) for key in access_keys.list_all(session)]
    if json:
        print_json({"keys": shown})
    else:
        columns = ("id", "name", "scope", "created_at", "revoked_at")
        print_table("Access keys", columns, [[key[column] or "" for column in columns] for key in shown])


@app.command()
def revoke(
    key_id: Annotated[str, typer.Argument(metavar="ID", help="The key's id, as `list` shows it.")],
    database_url: Url = None,
) -> None:
    """Make a key invalid; a running service notices within two seconds."""
    from db.repositories import access_keys

    with opened(database_url) as database:
        _prepare(database)
        with database.write() as session:
            stored = access_keys.revoke(session, key_id)
    typer.echo(f"key {stored.id} ({stored.name}) is revoked")


def _prepare(database: "Database") -> None:
    from db import migrate
    from service.settings import Settings

    if Settings().migrate_at_start:
        migrate.upgrade(database)
    else:
        migrate.check(database)


def _shown(key: "AccessKey") -> dict[str, str | None]:
    return {
        "id": key.id,
        "name": key.name,
        "scope": key.scope,
        "created_at": key.created_at.isoformat(timespec="seconds"),
        "revoked_at": key.revoked_at.isoformat(timespec="seconds") if key.revoked_at else None,
    }
