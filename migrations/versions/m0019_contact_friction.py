"""What a contact as a whole tells of its friction."""

import sqlalchemy as sa
from alembic import op

revision = "0019"
down_revision = "0018"
branch_labels = None
depends_on = None

LOST_ON_THE_WAY_BACK = (
    ("bounds of friction by whole contacts", "SELECT count(*) FROM detections WHERE contact_friction IS NOT NULL"),
)


def upgrade() -> None:
    op.add_column("detections", sa.Column("contact_friction", sa.JSON(none_as_null=True), nullable=True))


def downgrade() -> None:
    with op.batch_alter_table("detections") as table:
        table.drop_column("contact_friction")
