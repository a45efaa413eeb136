"""Of which other logs a log has the frames, which until now had all the same fingerprint for good."""

import sqlalchemy as sa
from alembic import op

revision = "0030"
down_revision = "0029"
branch_labels = None
depends_on = None

LOST_ON_THE_WAY_BACK = (
    ("logs that share frames with others", "SELECT count(*) FROM detections WHERE alike IS NOT NULL"),
)


def upgrade() -> None:
    op.add_column("detections", sa.Column("alike", sa.JSON(), nullable=True))
    # 0029 had this column at first, which nothing reads: databases that were upgraded by then have it still
    if "clock_log_number" in {column["name"] for column in sa.inspect(op.get_bind()).get_columns("store")}:
        with op.batch_alter_table("store") as table:
            table.drop_column("clock_log_number")


def downgrade() -> None:
    # without a signature they are looked at again once they are sent again: they would count beside the others for good
    op.execute("UPDATE detections SET signature = NULL WHERE alike IS NOT NULL")
    with op.batch_alter_table("detections") as table:
        table.drop_column("alike")
