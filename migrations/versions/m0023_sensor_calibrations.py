"""Calibrations of sensors, which of them a log is corrected by, and what that changed."""

import sqlalchemy as sa
from alembic import op

revision = "0023"
down_revision = "0022"
branch_labels = None
depends_on = None

LOST_ON_THE_WAY_BACK = (("calibrations of sensors", "SELECT count(*) FROM sensor_calibrations"),)

TABLE = "sensor_calibrations"


def upgrade() -> None:
    op.create_table(
        TABLE,
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("sensor_id", sa.Integer(), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("created_by", sa.String(12), nullable=True),
        sa.Column("presses", sa.JSON(), nullable=False),
        sa.Column("model", sa.JSON(), nullable=False),
        sa.Column("offset", sa.LargeBinary(), nullable=True),
        sa.ForeignKeyConstraint(["sensor_id"], ["sensors.id"], name="fk_sensor_calibrations_sensor_id_sensors"),
        sa.ForeignKeyConstraint(
            ["created_by"], ["access_keys.id"], name="fk_sensor_calibrations_created_by_access_keys"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_sensor_calibrations"),
        sa.UniqueConstraint("sensor_id", "version", name="uq_sensor_calibrations_sensor_id_version"),
        sa.CheckConstraint("version > 0", name=op.f("ck_sensor_calibrations_version")),
    )
    op.add_column("grasp_logs", sa.Column("calibration", sa.Integer(), nullable=True))
    op.add_column("detections", sa.Column("calibration", sa.Integer(), nullable=True))
    op.add_column("detections", sa.Column("corrections", sa.JSON(none_as_null=True), nullable=True))


def downgrade() -> None:
    with op.batch_alter_table("detections") as table:
        table.drop_column("corrections")
        table.drop_column("calibration")
    with op.batch_alter_table("grasp_logs") as table:
        table.drop_column("calibration")
    op.drop_table(TABLE)
