"""The mechanics of sensors' gels, from which forces are reconstructed."""

import sqlalchemy as sa
from alembic import op

revision = "0020"
down_revision = "0019"
branch_labels = None
depends_on = None

LOST_ON_THE_WAY_BACK = (
    ("descriptions of sensors' gels", "SELECT count(*) FROM sensors WHERE young_modulus IS NOT NULL"),
)

COLUMNS = ("young_modulus", "poisson_ratio", "thickness", "marker_depth")


def upgrade() -> None:
    for name in COLUMNS:
        op.add_column("sensors", sa.Column(name, sa.Double(), nullable=True))


def downgrade() -> None:
    with op.batch_alter_table("sensors") as table:
        for name in COLUMNS:
            table.drop_column(name)
