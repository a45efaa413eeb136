"""In which order logs came in: those of before are numbered by the clock, which is all that is known of them."""

import sqlalchemy as sa
from alembic import op

revision = "0028"
down_revision = "0027"
branch_labels = None
depends_on = None

LOGS = sa.table("grasp_logs", *(sa.column(name) for name in ("id", "created_at", "number")))
ALL, OF_MATERIAL = "ix_grasp_logs_number", "ix_grasp_logs_material_id_number_id"


def upgrade() -> None:
    op.add_column("grasp_logs", sa.Column("number", sa.Integer(), nullable=False, server_default="0"))
    place = sa.func.row_number().over(order_by=(LOGS.c.created_at, LOGS.c.id))
    ordered = sa.select(LOGS.c.id, place.label("place")).subquery()
    op.execute(sa.update(LOGS).values(number=ordered.c.place).where(LOGS.c.id == ordered.c.id))
    op.create_index(ALL, "grasp_logs", ["number"])
    op.create_index(OF_MATERIAL, "grasp_logs", ["material_id", "number", "id"])


def downgrade() -> None:
    op.drop_index(OF_MATERIAL, "grasp_logs")
    op.drop_index(ALL, "grasp_logs")
    op.drop_column("grasp_logs", "number")
