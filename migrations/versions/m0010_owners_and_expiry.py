"""Access keys that expire and belong to groups, owners of materials, and who withdrew a log."""

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None

LOST_ON_THE_WAY_BACK = (
    ("owners of materials", "SELECT count(*) FROM material_owners"),
    ("access keys in groups", 'SELECT count(*) FROM access_keys WHERE "group" IS NOT NULL'),
)
STOPS_THE_WAY_BACK = (
    ("access keys expire", "SELECT count(*) FROM access_keys WHERE expires_at IS NOT NULL AND revoked_at IS NULL"),
)
"""An older version would take them for ones that are valid for ever."""


def upgrade() -> None:
    op.add_column("access_keys", sa.Column("expires_at", sa.DateTime(timezone=True)))
    op.add_column("access_keys", sa.Column("group", sa.String(100)))
    with op.batch_alter_table("grasp_logs") as logs:
        logs.add_column(sa.Column("withdrawn_by", sa.String(12)))
        logs.create_foreign_key("fk_grasp_logs_withdrawn_by_access_keys", "access_keys", ["withdrawn_by"], ["id"])
    op.create_table(
        "material_owners",
        sa.Column("material_id", sa.Integer, nullable=False),
        sa.Column("owner", sa.String(110), nullable=False),
        sa.PrimaryKeyConstraint("material_id", "owner", name="pk_material_owners"),
        sa.ForeignKeyConstraint(["material_id"], ["materials.id"], name="fk_material_owners_material_id_materials"),
    )


def downgrade() -> None:
    op.drop_table("material_owners")
    with op.batch_alter_table("grasp_logs") as logs:
        logs.drop_constraint("fk_grasp_logs_withdrawn_by_access_keys", type_="foreignkey")
        logs.drop_column("withdrawn_by")
    with op.batch_alter_table("access_keys") as keys:
        keys.drop_column("group")
        keys.drop_column("expires_at")
