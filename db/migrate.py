"""Migrations of the database: upgrade, downgrade, current, check. Needs no file but the installed packages."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from alembic.script.revision import RevisionError
from alembic.util import CommandError
from sqlalchemy import Connection, inspect, text
from sqlalchemy.orm import Session

import migrations
from db.database import Database, sqlite_errors_named
from db.errors import SchemaMismatch
from db.tables import Base


def upgrade(database: Database, revision: str = "head") -> None:
    """Bring the database up to ``revision``; a new one gets all its tables.

    Raises ``SchemaMismatch`` for a newer one, and for an SQLite file of another program.
    """
    _refuse_others(database)
    with _migrating(database) as config:
        command.upgrade(config, revision)


def downgrade(database: Database, revision: str, *, lose: bool = False) -> None:
    """Bring the database down to ``revision``; ``base`` removes every table with its data.

    Raises as ``upgrade``, and for rows that the older schema has no place for: for some always, for the others unless
    they are to be lost (``lose``).
    """
    _refuse_others(database)
    with _migrating(database) as config:
        _refuse_losses(config.attributes["connection"], revision, lose=lose)
        command.downgrade(config, revision)


def current(database: Database) -> str | None:
    """The database's revision; None for an empty one."""
    with database.connect() as connection:
        return MigrationContext.configure(connection).get_current_revision()


@cache
def head() -> str | None:
    """The newest revision that this version of the code knows."""
    return _scripts().get_current_head()


def require_head(session: Session) -> None:
    """Make sure, inside a transaction, that the schema is still this version's; raises ``SchemaMismatch``."""
    found = session.scalar(text("SELECT version_num FROM alembic_version"))
    if found != head():
        _refuse_newer(found)
        raise SchemaMismatch(_difference(found))


def check(database: Database) -> None:
    """Make sure that the database is at the newest revision and its tables are those of the code.

    Raises ``SchemaMismatch`` that says what differs.
    """
    found = current(database)
    _refuse_newer(found)
    if found != head():
        raise SchemaMismatch(_difference(found))
    with database.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        differences = compare_metadata(context, Base.metadata)
    if differences:
        raise SchemaMismatch("tables differ from the code's: " + "; ".join(map(str, differences)))


def _refuse_losses(connection: Connection, revision: str, *, lose: bool) -> None:
    """By what each migration on the way back says of itself."""
    found = MigrationContext.configure(connection).get_current_revision()
    undone = [each.module for each in _scripts().iterate_revisions(found, revision, select_for_downgrade=True)]
    stops, losses = (
        [loss for module in undone for loss in _counted(connection, getattr(module, name, ()))]
        for name in ("STOPS_THE_WAY_BACK", "LOST_ON_THE_WAY_BACK")
    )
    connection.rollback()  # the migrations begin a transaction of their own
    if stops:
        what = f"{', '.join(stops)}, for which the older schema has no word"
        raise SchemaMismatch(f"migration refused: {what}; allowed: none of these")
    if losses and not lose:
        what = f"{', '.join(losses)} would be lost"
        raise SchemaMismatch(f"migration refused: {what}; allowed: none, or --lose, best after `stiction db backup`")


def _counted(connection: Connection, queries: Iterable[tuple[str, str]]) -> Iterator[str]:
    for what, query in queries:
        if count := connection.execute(text(query)).scalar():
            yield f"{count} {what}"


def _difference(found: str | None) -> str:
    return f"database revision is {found}; allowed: {head()} (run `stiction db upgrade`)"


def _refuse_newer(found: str | None) -> None:
    """A revision that is not known here is one of a newer version: to work on its tables could do harm."""
    if found is not None and found not in {script.revision for script in _scripts().walk_revisions()}:
        raise SchemaMismatch(
            f"database revision is {found}; allowed: at most {head()}, the newest that this version of the code knows "
            "(run a newer version)"
        )


def _refuse_others(database: Database) -> None:
    _refuse_newer(current(database))
    if database.is_sqlite:  # in PostgreSQL several programs may share one database
        _refuse_foreign(database)


def _refuse_foreign(database: Database) -> None:
    with database.connect() as connection:  # one view: another server may be making our tables
        revision = MigrationContext.configure(connection).get_current_revision()
        schema = inspect(connection)
        tables = sorted({*schema.get_table_names(), *schema.get_view_names()} - {"alembic_version"})
    if tables and (revision is None or not Base.metadata.tables.keys() & {*tables}):
        found = f"tables of another program, such as {tables[0]}"
        raise SchemaMismatch(f"{database} has {found}; allowed: a file of its own")


@cache
def _scripts() -> ScriptDirectory:
    """The migrations of this version of the code, each of which is a file to load."""
    return ScriptDirectory.from_config(_config())


def _config() -> Config:
    config = Config()
    folder = Path(migrations.__file__).parent
    config.set_main_option("script_location", str(folder).replace("%", "%%"))  # % interpolates in this format
    config.set_main_option("path_separator", "os")
    return config


@contextmanager
def _migrating(database: Database) -> Iterator[Config]:
    config = _config()
    with database.connect(to_write=True) as connection, _foreign_keys_off(database, connection):
        config.attributes["connection"] = connection
        try:
            yield config
        except (CommandError, RevisionError) as error:
            known = ", ".join(script.revision for script in _scripts().walk_revisions())
            raise SchemaMismatch(f"migration refused: {error}; allowed: head, base, {known}") from error


@contextmanager
def _foreign_keys_off(database: Database, connection: Connection) -> Iterator[None]:
    """Let SQLite alter a table by copy and drop, which with foreign keys on would delete the rows that refer to it."""
    if not database.is_sqlite:
        yield
        return
    sqlite = connection.connection.cursor()  # below SQLAlchemy: inside a transaction this pragma does nothing
    sqlite.execute("PRAGMA foreign_keys = OFF")
    try:
        yield
        with sqlite_errors_named():
            broken = sqlite.execute("PRAGMA foreign_key_check").fetchall()
        if broken:
            raise SchemaMismatch(f"foreign keys are broken in {sorted({str(row[0]) for row in broken})}")
    finally:
        sqlite.execute("PRAGMA foreign_keys = ON")
        sqlite.close()
