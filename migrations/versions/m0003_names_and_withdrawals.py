"""Names of materials apart from the materials, merged materials, withdrawn logs and the models they leave outdated."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None

LOST_ON_THE_WAY_BACK = (
    ("withdrawals of grasp logs", "SELECT count(*) FROM grasp_logs WHERE withdrawn_at IS NOT NULL"),
    (
        "aliases of materials",
        "SELECT count(*) FROM material_names n JOIN materials m ON m.id = n.material_id WHERE n.name <> m.name",
    ),
)
STOPS_THE_WAY_BACK = (
    ("materials were merged into others", "SELECT count(*) FROM materials WHERE merged_into_id IS NOT NULL"),
)
"""An old version would know two of one name."""

NAME = sa.String(100).with_variant(sa.String(100, collation="C"), "postgresql")
WITHDRAWN = "(withdrawn_at IS NULL) = (withdrawn_because IS NULL)"


def upgrade() -> None:
    with op.batch_alter_table("materials") as materials:
        materials.drop_constraint("uq_materials_name", type_="unique")
        materials.alter_column("name", type_=NAME, existing_type=sa.String(100), existing_nullable=False)
        materials.add_column(sa.Column("merged_into_id", sa.Integer))
        materials.create_foreign_key("fk_materials_merged_into_id_materials", "materials", ["merged_into_id"], ["id"])
        materials.create_index("ix_materials_name", ["name"])
        materials.create_index("ix_materials_merged_into_id", ["merged_into_id"])
    op.create_table(
        "material_names",
        sa.Column("name", NAME, nullable=False),
        sa.Column("material_id", sa.Integer, nullable=False),
        sa.ForeignKeyConstraint(["material_id"], ["materials.id"], name="fk_material_names_material_id_materials"),
        sa.PrimaryKeyConstraint("name", name="pk_material_names"),
    )
    op.create_index("ix_material_names_material_id", "material_names", ["material_id"])
    op.execute("INSERT INTO material_names (name, material_id) SELECT name, id FROM materials")
    with op.batch_alter_table("grasp_logs") as logs:
        logs.add_column(sa.Column("withdrawn_at", sa.DateTime(timezone=True)))
        logs.add_column(sa.Column("withdrawn_because", sa.String))
        logs.create_check_constraint(op.f("ck_grasp_logs_withdrawn"), WITHDRAWN)
        logs.drop_index("ix_grasp_logs_material_id")
        logs.create_index("ix_grasp_logs_material_id_created_at_id", ["material_id", "created_at", "id"])
        logs.create_index("ix_grasp_logs_created_at_id", ["created_at", "id"])
    op.add_column("friction_models", sa.Column("outdated", sa.Boolean, nullable=False, server_default=sa.false()))


def downgrade() -> None:
    with op.batch_alter_table("friction_models") as models:
        models.drop_column("outdated")
    with op.batch_alter_table("grasp_logs") as logs:
        logs.drop_index("ix_grasp_logs_created_at_id")
        logs.drop_index("ix_grasp_logs_material_id_created_at_id")
        logs.create_index("ix_grasp_logs_material_id", ["material_id"])
        logs.drop_constraint(op.f("ck_grasp_logs_withdrawn"), type_="check")
        logs.drop_column("withdrawn_because")
        logs.drop_column("withdrawn_at")
    op.drop_table("material_names")
    with op.batch_alter_table("materials") as materials:
        materials.drop_index("ix_materials_merged_into_id")
        materials.drop_index("ix_materials_name")
        materials.drop_constraint("fk_materials_merged_into_id_materials", type_="foreignkey")
        materials.drop_column("merged_into_id")
        materials.alter_column("name", type_=sa.String(100), existing_type=NAME, existing_nullable=False)
        materials.create_unique_constraint("uq_materials_name", ["name"])
