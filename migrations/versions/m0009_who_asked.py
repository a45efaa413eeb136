"""The access keys with which logs were sent and jobs asked for."""

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None

COLUMNS = {"grasp_logs": "uploaded_by", "jobs": "requested_by"}


def upgrade() -> None:
    for table, column in COLUMNS.items():
        with op.batch_alter_table(table) as changed:
            changed.add_column(sa.Column(column, sa.String(12)))
            changed.create_foreign_key(f"fk_{table}_{column}_access_keys", "access_keys", [column], ["id"])
    op.create_index("ix_grasp_logs_uploaded_by_created_at", "grasp_logs", ["uploaded_by", "created_at"])


def downgrade() -> None:
    op.drop_index("ix_grasp_logs_uploaded_by_created_at", "grasp_logs")
    for table, column in COLUMNS.items():
        with op.batch_alter_table(table) as changed:
            changed.drop_constraint(f"fk_{table}_{column}_access_keys", type_="foreignkey")
            changed.drop_column(column)
