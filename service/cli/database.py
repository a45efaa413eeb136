"""Commands on the database's schema: upgrade, downgrade, current, check."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from db.database import Database

app = typer.Typer(help="Create, upgrade and check the database's schema.", no_args_is_help=True)
Url = Annotated[
    str | None, typer.Option("--database-url", help="SQLAlchemy URL; by default the one that the service uses.")
]


@app.command()
def upgrade(database_url: Url = None) -> None:
    """Bring the database to this version's schema; a new one gets all its tables."""
    from db import migrate

    with opened(database_url) as database:
        migrate.upgrade(database)
        typer.echo(f"at revision {migrate.current(database)}")


@app.command()
def downgrade(
    revision: Annotated[str, typer.Argument(help="Revision to go back to; `base` removes every table and its data.")],
    database_url: Url = None,
) -> None:
    """Bring the database back to an older schema."""
    from db import migrate

    with opened(database_url) as database:
        migrate.downgrade(database, revision)
        typer.echo(f"at revision {migrate.current(database)}")


@app.command()
def current(database_url: Url = None) -> None:
    """Print the database's revision."""
    from db import migrate

    with opened(database_url) as database:
        typer.echo(migrate.current(database) or "empty")


@app.command()
def check(database_url: Url = None) -> None:
    """Make sure that the database's schema is this version's; exit code 3 and the difference if not."""
    from db import migrate

    with opened(database_url) as database:
        migrate.check(database)
        typer.echo("the schema is this version's")


@contextmanager
def opened(url: str | None) -> Iterator["Database"]:
    """The database at this URL, or the service's own."""
    from db.database import Database
    from service.settings import Settings

    if url is None:
        settings = Settings()
        settings.data_folder.mkdir(parents=True, exist_ok=True)
        url = settings.resolved_database_url
    database = Database(url)
    try:
        yield database
    finally:
        database.close()
