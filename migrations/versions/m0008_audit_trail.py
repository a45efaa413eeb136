"""The audit trail, whose entries the database itself neither changes nor deletes before they are 30 days old."""

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None

LOST_ON_THE_WAY_BACK = (("entries of the audit trail", "SELECT count(*) FROM audit_entries"),)

SQLITE = (
    "CREATE TRIGGER audit_entries_stay_as_they_are BEFORE UPDATE ON audit_entries "
    "BEGIN SELECT RAISE(ABORT, 'audit entries are never changed'); END",
    "CREATE TRIGGER audit_entries_stay BEFORE DELETE ON audit_entries "
    "WHEN OLD.at > strftime('%Y-%m-%d %H:%M:%f', 'now', '-30 days') "
    "BEGIN SELECT RAISE(ABORT, 'audit entries younger than 30 days are never deleted'); END",
)
POSTGRESQL = (
    "CREATE FUNCTION refuse_change_of_audit() RETURNS trigger LANGUAGE plpgsql AS "
    "$$ BEGIN RAISE EXCEPTION 'audit entries are never changed, nor deleted before they are 30 days old'; END $$",
    "CREATE TRIGGER audit_entries_stay_as_they_are BEFORE UPDATE ON audit_entries "
    "FOR EACH ROW EXECUTE FUNCTION refuse_change_of_audit()",
    "CREATE TRIGGER audit_entries_stay BEFORE DELETE ON audit_entries "
    "FOR EACH ROW WHEN (OLD.at > now() - interval '30 days') EXECUTE FUNCTION refuse_change_of_audit()",
    "CREATE TRIGGER audit_entries_are_not_emptied BEFORE TRUNCATE ON audit_entries "
    "EXECUTE FUNCTION refuse_change_of_audit()",
)


def upgrade() -> None:
    op.create_table(
        "audit_entries",
        sa.Column("id", sa.Integer, nullable=False),
        sa.Column("at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("actor", sa.String(120), nullable=False),
        sa.Column("address", sa.String(100)),
        sa.Column("request_id", sa.String(128)),
        sa.Column("action", sa.String(50), nullable=False),
        sa.Column("subject", sa.String(200), nullable=False),
        sa.Column("details", sa.JSON, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_audit_entries"),
    )
    for columns in (["at"], ["actor", "id"], ["subject", "id"]):
        op.create_index(f"ix_audit_entries_{'_'.join(columns)}", "audit_entries", columns)
    for statement in POSTGRESQL if _is_postgresql() else SQLITE:
        op.execute(statement)


def downgrade() -> None:
    op.drop_table("audit_entries")
    if _is_postgresql():
        op.execute("DROP FUNCTION refuse_change_of_audit()")


def _is_postgresql() -> bool:
    return op.get_bind().dialect.name == "postgresql"
