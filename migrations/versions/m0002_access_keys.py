"""Access keys."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None

LOST_ON_THE_WAY_BACK = (("access keys", "SELECT count(*) FROM access_keys"),)


def upgrade() -> None:
    op.create_table(
        "access_keys",
        sa.Column("id", sa.String(12), nullable=False),
        sa.Column("name", sa.String(100), nullable=False),
        sa.Column("scope", sa.String(10), nullable=False),
        sa.Column("sha256", sa.String(64), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("revoked_at", sa.DateTime(timezone=True)),
        sa.CheckConstraint("scope IN ('read', 'upload', 'admin')", name=op.f("ck_access_keys_scope")),
        sa.PrimaryKeyConstraint("id", name="pk_access_keys"),
    )


def downgrade() -> None:
    op.drop_table("access_keys")
