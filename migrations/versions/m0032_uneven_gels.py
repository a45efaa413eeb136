"""Thickness at each marker of gels that are not alike thick everywhere."""

import sqlalchemy as sa
from alembic import op

revision = "0032"
down_revision = "0031"
branch_labels = None
depends_on = None

LOST_ON_THE_WAY_BACK = (
    ("maps of gels' thickness", "SELECT count(*) FROM sensors WHERE relative_thickness IS NOT NULL"),
)


def upgrade() -> None:
    op.add_column("sensors", sa.Column("relative_thickness", sa.JSON(none_as_null=True), nullable=True))


def downgrade() -> None:
    with op.batch_alter_table("sensors") as table:
        table.drop_column("relative_thickness")
