"""The id that the database shares with the files that it refers to. No row: the first start after this makes one."""

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "store",
        sa.Column("number", sa.Integer, nullable=False),
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.PrimaryKeyConstraint("number", name="pk_store"),
        sa.CheckConstraint("number = 1", name=op.f("ck_store_number")),
    )


def downgrade() -> None:
    op.drop_table("store")
