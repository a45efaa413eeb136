"""Indexes for lists: a sensor's logs by time, and how many logs of a material are withdrawn."""

import sqlalchemy as sa
from alembic import op

revision = "0024"
down_revision = "0023"
branch_labels = None
depends_on = None

OF_SENSOR, OF_SENSOR_BY_TIME = "ix_grasp_logs_sensor_id", "ix_grasp_logs_sensor_id_created_at_id"
WITHDRAWN = sa.text("withdrawn_at IS NOT NULL")


def upgrade() -> None:
    op.create_index(OF_SENSOR_BY_TIME, "grasp_logs", ["sensor_id", "created_at", "id"])
    op.drop_index(OF_SENSOR, "grasp_logs")
    op.create_index(
        "ix_grasp_logs_withdrawn", "grasp_logs", ["material_id"], sqlite_where=WITHDRAWN, postgresql_where=WITHDRAWN
    )


def downgrade() -> None:
    op.drop_index("ix_grasp_logs_withdrawn", "grasp_logs")
    op.create_index(OF_SENSOR, "grasp_logs", ["sensor_id"])
    op.drop_index(OF_SENSOR_BY_TIME, "grasp_logs")
