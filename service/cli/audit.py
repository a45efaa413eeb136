"""The command on the audit trail of a running service."""

from dataclasses import asdict
from json import dumps
from typing import Annotated, Any

import typer

from service.cli.connection import connected
from service.cli.options import DEFAULT_URL, Json, Key, Limit, Url
from service.cli.output import print_json, print_table, when

COLUMNS = ("at", "actor", "address", "action", "subject", "details")


def audit(
    actor: Annotated[str | None, typer.Option(help="Only what it did, such as key:3f9c2a7b51de.")] = None,
    action: Annotated[str | None, typer.Option(help="Only this, such as grasp_log.withdrawn.")] = None,
    subject: Annotated[str | None, typer.Option(help="Only what was done to this material, log, job or key.")] = None,
    limit: Limit = 20,
    url: Url = DEFAULT_URL,
    key: Key = None,
    json: Json = False,
) -> None:
    """Show who changed what in a service, when, and from where: the newest first."""
    with connected(url, key) as client:
        found = [asdict(entry) for entry in client.audit(actor, action, subject, limit)]
    if json:
        print_json({"entries": found})
    else:
        for entry in found:
            entry |= {"at": when(entry["at"]), "details": _details(entry["details"])}
        print_table("Audit trail", COLUMNS, [[entry[name] for name in COLUMNS] for entry in found])


def _details(details: dict[str, Any]) -> str:
    """What an entry says beside its names: without what is empty, and a hash by its beginning."""
    filled = {name: value for name, value in details.items() if value not in (None, "", [])}
    shown = {name: value[:12] if name == "sha256" else value for name, value in filled.items()}
    return ", ".join(f"{name}: {value if isinstance(value, str) else dumps(value)}" for name, value in shown.items())
