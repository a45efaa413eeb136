"""Which key described a sensor's gel, where that was no admin's: forces of others' logs follow from it."""

import sqlalchemy as sa
from alembic import op

revision = "0031"
down_revision = "0030"
branch_labels = None
depends_on = None

LOST_ON_THE_WAY_BACK = (
    ("keys by which gels are described", "SELECT count(*) FROM sensors WHERE described_by IS NOT NULL"),
)


def upgrade() -> None:
    with op.batch_alter_table("sensors") as table:
        table.add_column(sa.Column("described_by", sa.String(12), nullable=True))
        table.create_foreign_key("fk_sensors_described_by_access_keys", "access_keys", ["described_by"], ["id"])


def downgrade() -> None:
    with op.batch_alter_table("sensors") as table:
        table.drop_constraint("fk_sensors_described_by_access_keys", type_="foreignkey")
        table.drop_column("described_by")
