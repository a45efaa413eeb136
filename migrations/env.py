"""Runs migrations on the connection that its caller hands over, all of them in one transaction."""

from alembic import context
from sqlalchemy import text

connection = context.config.attributes["connection"]
context.configure(
    connection=connection,
    render_as_batch=True,  # SQLite alters a table by copying it
    compare_type=True,
    transactional_ddl=True,  # also on SQLite, where it holds as long as BEGIN is not left to the driver
)
with context.begin_transaction():
    if connection.dialect.name == "postgresql":  # several servers may start at once: the others wait, then find it done
        connection.execute(text("SET LOCAL lock_timeout = 0"))
        connection.execute(text("SELECT pg_advisory_xact_lock(hashtext('stiction migrations'))"))
        connection.execute(text("SET LOCAL lock_timeout TO DEFAULT"))
    context.run_migrations()
