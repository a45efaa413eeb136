"""How far the audit trail has been sent to the webhook."""

import sqlalchemy as sa
from alembic import op

revision = "0022"
down_revision = "0021"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("store", sa.Column("webhook_entry_id", sa.Integer(), nullable=True))


def downgrade() -> None:
    with op.batch_alter_table("store") as table:
        table.drop_column("webhook_entry_id")
