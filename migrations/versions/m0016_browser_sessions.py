"""Sessions of browsers, each of an access key."""

import sqlalchemy as sa
from alembic import op

revision = "0016"
down_revision = "0015"
branch_labels = None
depends_on = None

TABLE = "browser_sessions"


def upgrade() -> None:
    op.create_table(
        TABLE,
        sa.Column("sha256", sa.String(64), nullable=False),
        sa.Column("key_id", sa.String(12), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("expires_at", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(["key_id"], ["access_keys.id"], name="fk_browser_sessions_key_id_access_keys"),
        sa.PrimaryKeyConstraint("sha256", name="pk_browser_sessions"),
    )
    for column in ("key_id", "expires_at"):
        op.create_index(f"ix_browser_sessions_{column}", TABLE, [column])


def downgrade() -> None:
    op.drop_table(TABLE)
