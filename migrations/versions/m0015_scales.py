"""The scales of a friction model's scatter; models stored before have them where their diagnostics tell them."""

from collections.abc import Mapping
from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0015"
down_revision = "0014"
branch_labels = None
depends_on = None

NAMES = ("between_grasps", "between_places", "within")


def upgrade() -> None:
    op.add_column("friction_models", sa.Column("scales", sa.JSON(none_as_null=True)))
    models = sa.table(
        "friction_models", *(sa.column(name, sa.JSON) for name in ("diagnostics", "scales")), sa.column("id")
    )
    connection = op.get_bind()
    for key, diagnostics in connection.execute(sa.select(models.c.id, models.c.diagnostics)).all():
        if all(f"scale_{name}" in diagnostics for name in NAMES):
            told = {name: _scale(diagnostics, f"scale_{name}") for name in NAMES}
            connection.execute(sa.update(models).where(models.c.id == key).values(scales=told))


def downgrade() -> None:
    with op.batch_alter_table("friction_models") as models:
        models.drop_column("scales")


def _scale(diagnostics: Mapping[str, Any], name: str) -> dict[str, Any]:
    return {"value": diagnostics[name], "degrees_of_freedom": diagnostics[f"{name}_degrees_of_freedom"]}
