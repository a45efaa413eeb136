"""Commands on access keys: create, list, revoke. They work on the database, with or without a running service."""

import re
from datetime import datetime
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from service.cli.durations import moment_to_come
from service.cli.options import Json
from service.cli.output import print_json, print_table
from service.cli.stores import Url, command_actor, opened, opened_blobs

if TYPE_CHECKING:
    from db.database import Database
    from db.records import AccessKey

app = typer.Typer(help="Make, list and revoke access keys.", no_args_is_help=True)
GROUP = re.compile(r"[A-Za-z0-9]([A-Za-z0-9 ._-]{0,98}[A-Za-z0-9._-])?")


@app.command()
def create(
    name: Annotated[str, typer.Argument(help="What the key is for, such as the robot that gets it.")],
    scope: Annotated[
        Literal["read", "upload", "admin"],
        typer.Option(help="What it may do; each implies those before."),
    ] = "read",
    expires: Annotated[
        str | None, typer.Option(help="When it ends: in 90d or 12h, or on 2027-01-31. Without: never.")
    ] = None,
    group: Annotated[
        str | None, typer.Option(help="Group of keys that it belongs to: they may own materials together.")
    ] = None,
    database_url: Url = None,
    json: Json = False,
) -> None:
    """Make a key and print it: this once, for only its digest is stored."""
    from db.repositories import access_keys, audit
    from db.tables import now
    from service.domain.access.keys import digest, new_key

    if not 0 < len(name) <= 100 or not name.isprintable() or name != name.strip():
        raise typer.BadParameter(f"name is {name!r}; allowed: 1 to 100 printable characters, no space at the ends")
    if group is not None and not GROUP.fullmatch(group):
        allowed = "1 to 100 letters, digits, spaces and `._-`, no space at the ends"
        raise typer.BadParameter(f"group is {group!r}; allowed: {allowed}")
    ends = None if expires is None else moment_to_come("expires", expires, now())
    key_id, text = new_key()
    with opened(database_url, may_be_new=True) as database:
        _prepare(database)
        with database.write() as session:
            stored = access_keys.add(session, key_id, name, scope, digest(text), expires_at=ends, group=group)
            audit.add(session, command_actor(), "key.created", key_id, _audit_details(stored))
    if json:
        print_json(_shown(stored) | {"key": text})
    else:
        typer.echo(text)


@app.command("list")
def list_keys(database_url: Url = None, json: Json = False) -> None:
    """List all keys, the revoked and expired ones too; the keys themselves cannot be shown again."""
    from db.repositories import access_keys

    with opened(database_url) as database:
        _prepare(database)
        with database.read() as session:
            shown = [_shown(key) for key in access_keys.list_all(session)]
    if json:
        print_json({"keys": shown})
    else:
        columns = ("id", "name", "scope", "group", "created_at", "expires_at", "revoked_at")
        print_table("Access keys", columns, [[key[column] for column in columns] for key in shown])


@app.command()
def revoke(
    key_id: Annotated[str, typer.Argument(metavar="ID", help="The key's id, as `list` shows it.")],
    database_url: Url = None,
) -> None:
    """Make a key invalid; a running service notices within two seconds."""
    from db.repositories import access_keys, audit

    with opened(database_url) as database:
        _prepare(database)
        with database.write() as session:
            stored = access_keys.revoke(session, key_id)
            audit.add(session, command_actor(), "key.revoked", key_id, _audit_details(stored))
    typer.echo(f"key {stored.id} ({stored.name}) is revoked")


def _prepare(database: "Database") -> None:
    """Let the database be of this version; raises ``StoreMismatch`` where this machine's files are another one's.

    A restored copy has the same keys: one that is revoked there only would still be good where it counts. A machine
    without files makes keys for any database.
    """
    from db import identity, migrate
    from service.settings import Settings

    settings = Settings()
    if settings.blob_url is not None or settings.data_folder.exists():
        blobs = opened_blobs()
        if blobs.read_store_id() is not None:
            identity.verify_before_upgrade(database, blobs)
    if settings.migrate_at_start:
        migrate.upgrade(database)
    else:
        migrate.check(database)


def _audit_details(key: "AccessKey") -> dict[str, str | None]:
    """What the audit trail says of a key."""
    return {"name": key.name, "scope": key.scope, "group": key.group, "expires_at": _iso(key.expires_at)}


def _shown(key: "AccessKey") -> dict[str, str | None]:
    return {
        "id": key.id,
        "name": key.name,
        "scope": key.scope,
        "group": key.group,
        "created_at": _iso(key.created_at),
        "expires_at": _iso(key.expires_at),
        "revoked_at": _iso(key.revoked_at),
    }


def _iso(moment: datetime | None) -> str | None:
    return None if moment is None else moment.isoformat(timespec="seconds")
