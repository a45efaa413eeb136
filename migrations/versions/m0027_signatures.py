"""By which a grasp is known again that was cut or rounded; logs of before have none until they are looked at anew."""

import sqlalchemy as sa
from alembic import op

revision = "0027"
down_revision = "0026"
branch_labels = None
depends_on = None

LOST_ON_THE_WAY_BACK = (("signatures of grasps", "SELECT count(*) FROM detections WHERE signature IS NOT NULL"),)


def upgrade() -> None:
    op.add_column("detections", sa.Column("signature", sa.LargeBinary(), nullable=True))


def downgrade() -> None:
    with op.batch_alter_table("detections") as table:
        table.drop_column("signature")
