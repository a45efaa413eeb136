"""By which a grasp is known that was sent in several files; logs of before have none until they are looked at anew."""

import sqlalchemy as sa
from alembic import op

revision = "0026"
down_revision = "0025"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("detections", sa.Column("fingerprint", sa.String(64), nullable=True))


def downgrade() -> None:
    with op.batch_alter_table("detections") as table:
        table.drop_column("fingerprint")
