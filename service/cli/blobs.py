"""Commands on the files that are stored: prune."""

from datetime import timedelta
from typing import Annotated

import typer

from service.cli.database import Url, opened, opened_blobs
from service.cli.durations import duration

app = typer.Typer(help="Look after the files that are stored.", no_args_is_help=True)


@app.command()
def prune(
    older_than: Annotated[
        str | None,
        typer.Option(help="Age such as 90d or 12h; by default that of STICTION_KEEP_UPLOADS_DAYS."),
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only say how many uploads would go.")] = False,
    database_url: Url = None,
) -> None:
    """Delete old uploads whose jobs have ended; what was found in them stays. The service may run meanwhile."""
    from db import migrate
    from db.repositories import uploads
    from db.tables import now
    from service.jobs.retention import prune as delete_old

    before = now() - _age(older_than)
    with opened(database_url) as database:
        migrate.check(database)
        with database.read() as session:
            count, size = uploads.count_old(session, before)
        if dry_run:
            typer.echo(f"{count} uploads ({size} bytes) would be deleted")
        else:
            typer.echo(f"deleted {delete_old(database, opened_blobs(), before)} uploads ({size} bytes)")


def _age(text: str | None) -> timedelta:
    from service.settings import Settings

    if text is None:
        days = Settings().keep_uploads_days
        if days is None:
            raise typer.BadParameter("older-than is missing, and STICTION_KEEP_UPLOADS_DAYS is not set; allowed: 90d")
        return timedelta(days=days)
    return duration("older-than", text)
