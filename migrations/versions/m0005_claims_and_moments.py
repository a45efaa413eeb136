"""Runners that claim jobs, cancelled jobs, moments of each log's samples, and room for more samples in a model."""

import sqlalchemy as sa
from alembic import op
from alembic.operations import BatchOperations

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

FINISHED = "('failed', 'refused')"
CANCELLED_TOO = "('failed', 'refused', 'cancelled')"


def upgrade() -> None:
    op.create_table(
        "runners",
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("name", sa.String(300), nullable=False),
        sa.Column("beats", sa.BigInteger, nullable=False),
        sa.Column("started_at", sa.DateTime(timezone=True), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_runners"),
    )
    requeue_running()
    with op.batch_alter_table("jobs") as jobs:
        jobs.add_column(sa.Column("runner_id", sa.String(32)))
        jobs.create_foreign_key("fk_jobs_runner_id_runners", "runners", ["runner_id"], ["id"])
        jobs.create_index("ix_jobs_runner_id", ["runner_id"])
        jobs.drop_index("ix_jobs_status")
        jobs.create_index("ix_jobs_status_created_at_id", ["status", "created_at", "id"])
        replace_checks(jobs, "'queued', 'running', 'done', 'failed', 'refused', 'cancelled'", CANCELLED_TOO)
        jobs.create_check_constraint(op.f("ck_jobs_runner"), "(status = 'running') = (runner_id IS NOT NULL)")
    with op.batch_alter_table("sample_summaries") as samples:
        samples.add_column(sa.Column("moments", sa.LargeBinary))
    with op.batch_alter_table("friction_models") as models:
        models.alter_column("n", existing_type=sa.Integer, type_=sa.BigInteger, existing_nullable=False)


def downgrade() -> None:
    with op.batch_alter_table("friction_models") as models:
        models.alter_column("n", existing_type=sa.BigInteger, type_=sa.Integer, existing_nullable=False)
    with op.batch_alter_table("sample_summaries") as samples:
        samples.drop_column("moments")
    op.execute("UPDATE jobs SET status = 'failed' WHERE status = 'cancelled'")
    with op.batch_alter_table("jobs") as jobs:
        jobs.drop_constraint(op.f("ck_jobs_runner"), type_="check")
        replace_checks(jobs, "'queued', 'running', 'done', 'failed', 'refused'", FINISHED)
        jobs.drop_index("ix_jobs_status_created_at_id")
        jobs.create_index("ix_jobs_status", ["status"])
        jobs.drop_index("ix_jobs_runner_id")
        jobs.drop_constraint("fk_jobs_runner_id_runners", type_="foreignkey")
        jobs.drop_column("runner_id")
    op.drop_table("runners")


def requeue_running() -> None:
    """No runner of the older version is left to say that it is at them."""
    op.execute("UPDATE jobs SET status = 'queued' WHERE status = 'running'")


def replace_checks(jobs: BatchOperations, statuses: str, with_reason: str) -> None:
    jobs.drop_constraint(op.f("ck_jobs_status"), type_="check")
    jobs.create_check_constraint(op.f("ck_jobs_status"), f"status IN ({statuses})")
    jobs.drop_constraint(op.f("ck_jobs_reason"), type_="check")
    jobs.create_check_constraint(op.f("ck_jobs_reason"), f"status NOT IN {with_reason} OR reason IS NOT NULL")
