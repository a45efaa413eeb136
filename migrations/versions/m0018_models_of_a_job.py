"""A job may store models by several methods; an older version has one job a model."""

import uuid

import sqlalchemy as sa
from alembic import op

revision = "0018"
down_revision = "0017"
branch_labels = None
depends_on = None

BEFORE, AFTER = "uq_friction_models_job_id", "uq_friction_models_job_id_method"


def upgrade() -> None:
    with op.batch_alter_table("friction_models") as models:
        models.drop_constraint(BEFORE, type_="unique")
        models.create_unique_constraint(AFTER, ["job_id", "method"])


def downgrade() -> None:
    _give_each_model_a_job()
    with op.batch_alter_table("friction_models") as models:
        models.drop_constraint(AFTER, type_="unique")
        models.create_unique_constraint(BEFORE, ["job_id"])


def _give_each_model_a_job() -> None:
    """Of the models of one job all but the first get a fit that is done, otherwise like it."""
    connection = op.get_bind()
    metadata = sa.MetaData()
    jobs, models = (sa.Table(name, metadata, autoload_with=connection) for name in ("jobs", "friction_models"))
    first = sa.select(sa.func.min(models.c.id)).group_by(models.c.job_id)
    chosen = (models.c.id, models.c.material_id, models.c.method, models.c.version)
    others = sa.select(jobs, *(column.label(f"stored_{column.name}") for column in chosen)).join_from(
        jobs, models, models.c.job_id == jobs.c.id
    )
    for row in connection.execute(others.where(models.c.id.not_in(first))).mappings().all():
        kept = {column.name: row[column.name] for column in jobs.c}
        own = {"id": uuid.uuid4().hex, "kind": "fit", "grasp_log_id": None, "model_version": row["stored_version"]}
        own |= {"material_id": row["stored_material_id"], "method": row["stored_method"]}
        connection.execute(sa.insert(jobs).values(**kept | own))
        connection.execute(sa.update(models).where(models.c.id == row["stored_id"]).values(job_id=own["id"]))
