"""The turns of queued jobs: between access keys, and between the materials and sizes of one key's jobs."""

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None

INDEXES = (
    ["status", "turn"],
    ["status", "requested_by", "turn"],
    ["status", "requested_by", "turn_within_key"],
    ["status", "requested_by", "material_id", "is_long", "turn_within_key"],
)


def upgrade() -> None:
    with op.batch_alter_table("jobs") as jobs:
        jobs.add_column(sa.Column("is_long", sa.Boolean, nullable=False, server_default=sa.false()))
        jobs.add_column(sa.Column("turn", sa.BigInteger, nullable=False, server_default="0"))
        jobs.add_column(sa.Column("turn_within_key", sa.BigInteger, nullable=False, server_default="0"))
        for columns in INDEXES:
            jobs.create_index(f"ix_jobs_{'_'.join(columns)}", columns)


def downgrade() -> None:
    with op.batch_alter_table("jobs") as jobs:
        for columns in INDEXES:
            jobs.drop_index(f"ix_jobs_{'_'.join(columns)}")
        for column in ("turn_within_key", "turn", "is_long"):
            jobs.drop_column(column)
