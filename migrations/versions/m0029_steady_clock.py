"""How long the clock has been steady by which uploads grow old, over restarts."""

import sqlalchemy as sa
from alembic import op

revision = "0029"
down_revision = "0028"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("store", sa.Column("clock_seen_at", sa.DateTime(timezone=True), nullable=True))
    op.add_column("store", sa.Column("clock_steady_seconds", sa.Double(), nullable=True))


def downgrade() -> None:
    with op.batch_alter_table("store") as table:
        for name in ("clock_steady_seconds", "clock_seen_at"):
            table.drop_column(name)
