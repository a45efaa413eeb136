"""Commands on the jobs of a running service: list, cancel."""

from dataclasses import asdict
from typing import Annotated

import typer

from service.cli.connection import connected
from service.cli.options import DEFAULT_URL, Json, Key, Limit, Url
from service.cli.output import print_json, print_table, when

app = typer.Typer(help="Look at the jobs of a service, and cancel them.", no_args_is_help=True)
COLUMNS = ("id", "kind", "status", "stage", "material", "reason", "created_at")


@app.command("list")
def list_jobs(
    status: Annotated[
        str | None, typer.Option(help="Only queued, running, done, failed, refused or cancelled ones.")
    ] = None,
    limit: Limit = 20,
    url: Url = DEFAULT_URL,
    key: Key = None,
    json: Json = False,
) -> None:
    """List the newest jobs, with the reason of those that ended badly."""
    with connected(url, key) as client:
        found = [asdict(job) for job in client.jobs(status, limit)]
    if json:
        print_json({"jobs": found})
    else:
        for job in found:
            job["created_at"] = when(job["created_at"])
        print_table("Jobs", COLUMNS, [[job[name] for name in COLUMNS] for job in found])


@app.command()
def cancel(
    jobs: Annotated[list[str], typer.Argument(help="Ids of jobs that are queued or running.")],
    url: Url = DEFAULT_URL,
    key: Key = None,
) -> None:
    """Cancel jobs: they store nothing more."""
    with connected(url, key) as client:
        for job in jobs:
            typer.echo(f"{client.cancel(job).id} is cancelled")
