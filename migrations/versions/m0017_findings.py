"""What is found against a log."""

import sqlalchemy as sa
from alembic import op

revision = "0017"
down_revision = "0016"
branch_labels = None
depends_on = None

LOST_ON_THE_WAY_BACK = (
    ("logs with findings", "SELECT count(*) FROM detections WHERE CAST(findings AS VARCHAR) <> '[]'"),
)


def upgrade() -> None:
    op.add_column("detections", sa.Column("findings", sa.JSON(none_as_null=True), nullable=True))


def downgrade() -> None:
    with op.batch_alter_table("detections") as table:
        table.drop_column("findings")
