"""Audit entries are not replaced, which on SQLite passes by the trigger on deletion, and are found by action."""

from alembic import op

revision = "0013"
down_revision = "0012"
branch_labels = None
depends_on = None

NOT_REPLACED = (
    "CREATE TRIGGER audit_entries_are_not_replaced BEFORE INSERT ON audit_entries "
    "WHEN NEW.id > 0 AND EXISTS (SELECT 1 FROM audit_entries WHERE id = NEW.id) "
    "BEGIN SELECT RAISE(ABORT, 'audit entries are never changed'); END"
)
"""Where no id is given, SQLite shows a trigger -1 before it has chosen one."""


def upgrade() -> None:
    op.create_index("ix_audit_entries_action_id", "audit_entries", ["action", "id"])
    if _is_sqlite():
        op.execute(NOT_REPLACED)


def downgrade() -> None:
    if _is_sqlite():
        op.execute("DROP TRIGGER audit_entries_are_not_replaced")
    op.drop_index("ix_audit_entries_action_id", "audit_entries")


def _is_sqlite() -> bool:
    return op.get_bind().dialect.name == "sqlite"
