"""An index by which the next short job is found among long ones."""

from alembic import op

revision = "0014"
down_revision = "0013"
branch_labels = None
depends_on = None

INDEX = "ix_jobs_status_is_long_turn"


def upgrade() -> None:
    op.create_index(INDEX, "jobs", ["status", "is_long", "turn"])


def downgrade() -> None:
    op.drop_index(INDEX, "jobs")
