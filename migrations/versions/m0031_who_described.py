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


BY_THE_AUDIT_TRAIL = """
UPDATE sensors SET described_by = (
    SELECT access_keys.id FROM audit_entries JOIN access_keys ON audit_entries.actor = 'key:' || access_keys.id
    WHERE access_keys.scope <> 'admin' AND audit_entries.id = (
        SELECT max(newest.id) FROM audit_entries AS newest
        WHERE newest.action = 'sensor.described' AND newest.subject = sensors.name
    )
) WHERE young_modulus IS NOT NULL
"""
"""Who described a sensor last, before that was noted."""


def upgrade() -> None:
    with op.batch_alter_table("sensors") as table:
        table.add_column(sa.Column("described_by", sa.String(12), nullable=True))
        table.create_foreign_key("fk_sensors_described_by_access_keys", "access_keys", ["described_by"], ["id"])
    op.execute(BY_THE_AUDIT_TRAIL)


def downgrade() -> None:
    with op.batch_alter_table("sensors") as table:
        table.drop_constraint("fk_sensors_described_by_access_keys", type_="foreignkey")
        table.drop_column("described_by")
