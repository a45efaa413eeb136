"""Uploads that may go once they are old, the trace that a job belongs to, and jobs in the order of their coming."""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None

STOPS_THE_WAY_BACK = (("grasp logs have no file", "SELECT count(*) FROM grasp_logs WHERE file_state IS NOT NULL"),)
"""An old version would look for their files and fail."""


def upgrade() -> None:
    with op.batch_alter_table("grasp_logs") as logs:
        logs.add_column(sa.Column("file_state", sa.String(10)))
        logs.add_column(sa.Column("file_since", sa.DateTime(timezone=True)))
    op.execute("UPDATE grasp_logs SET file_since = created_at")
    with op.batch_alter_table("grasp_logs") as logs:
        logs.alter_column("file_since", existing_type=sa.DateTime(timezone=True), nullable=False)
        logs.create_check_constraint(op.f("ck_grasp_logs_file_state"), "file_state IN ('leaving', 'gone')")
        logs.create_index("ix_grasp_logs_file_state_file_since", ["file_state", "file_since"])
    with op.batch_alter_table("jobs") as jobs:
        jobs.add_column(sa.Column("trace", sa.String(55)))
        jobs.create_index("ix_jobs_created_at_id", ["created_at", "id"])


def downgrade() -> None:
    with op.batch_alter_table("jobs") as jobs:
        jobs.drop_index("ix_jobs_created_at_id")
        jobs.drop_column("trace")
    with op.batch_alter_table("grasp_logs") as logs:
        logs.drop_index("ix_grasp_logs_file_state_file_since")
        logs.drop_constraint(op.f("ck_grasp_logs_file_state"), type_="check")
        logs.drop_column("file_since")
        logs.drop_column("file_state")
