"""What the migrations do to an empty database, which the tests make by the hundred: worked out once, then repeated."""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from typing import Any

from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from sqlalchemy import Connection, event

OWN = "current_schema()::regnamespace"
SCHEMA = {
    "sqlite": "SELECT sql FROM sqlite_master WHERE sql IS NOT NULL ORDER BY rowid",
    "postgresql": f"""
        SELECT concat_ws(' ', relname, attname, format_type(atttypid, atttypmod), attnotnull, attidentity, attgenerated)
        FROM pg_attribute JOIN pg_class ON pg_class.oid = attrelid
        WHERE relnamespace = {OWN} AND relkind IN ('r', 'p') AND attnum > 0 AND NOT attisdropped
        UNION ALL SELECT indexdef FROM pg_indexes WHERE schemaname = current_schema()
        UNION ALL SELECT concat_ws(' ', conrelid::regclass, conname, pg_get_constraintdef(oid))
        FROM pg_constraint WHERE connamespace = {OWN}
        UNION ALL SELECT concat_ws(' ', relname, objsubid, description)
        FROM pg_description JOIN pg_class ON pg_class.oid = objoid WHERE relnamespace = {OWN}
        ORDER BY 1""",
}
"""Queries for all that Alembic compares of a database: of an empty one they find nothing."""

LEFT_OUT = ("PRAGMA", "SELECT pg_catalog", "SELECT alembic_version", "SELECT sql", "BEGIN")
"""How statements begin that change nothing and take no lock, and the one that begins a transaction."""

Statements = list[tuple[str, Any]]


class Remembered:
    """Stands in for two functions of Alembic, each of which is asked where nothing is remembered."""

    def __init__(self) -> None:
        self.real_upgrade, self.real_compare = command.upgrade, compare_metadata
        self._statements: dict[str, Statements] = {}
        self._differences: dict[tuple[str, ...], Any] = {}

    def upgrade(self, config: Config, revision: str) -> None:
        """Bring a database up; an empty one by the statements that the first empty one of its kind was given."""
        connection: Connection = config.attributes["connection"]
        kind = connection.dialect.name
        if revision != "head" or _schema(connection):
            self.real_upgrade(config, revision)
        elif kind not in self._statements:
            with _noted(connection) as statements:
                self.real_upgrade(config, revision)
            self._statements[kind] = statements
        else:
            with connection.begin(), closing(connection.connection.cursor()) as cursor:
                for statement, parameters in self._statements[kind]:
                    cursor.execute(statement, parameters)

    def compare(self, context: MigrationContext, metadata: Any) -> Any:
        """How a schema differs from the code's tables, worked out once for each schema."""
        connection = context.connection
        assert connection is not None
        schema = _schema(connection)
        if schema not in self._differences:
            self._differences[schema] = self.real_compare(context, metadata)
        return self._differences[schema]


@contextmanager
def _noted(connection: Connection) -> Iterator[Statements]:
    """What is said to the database meanwhile."""
    said: Statements = []

    def note(_connection: Any, _cursor: Any, statement: str, parameters: Any, *_: Any) -> None:
        if not statement.startswith(LEFT_OUT):
            said.append((statement, parameters))

    event.listen(connection, "before_cursor_execute", note)
    yield said
    event.remove(connection, "before_cursor_execute", note)


def _schema(connection: Connection) -> tuple[str, ...]:
    """What there is, asked below SQLAlchemy, which would begin a transaction."""
    with closing(connection.connection.cursor()) as cursor:
        cursor.execute(SCHEMA[connection.dialect.name])
        return tuple(row[0] for row in cursor.fetchall())
