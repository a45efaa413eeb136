"""Whether the velocities of a log's samples are relative to what seems to stick; of older samples nobody knows."""

import sqlalchemy as sa
from alembic import op

revision = "0021"
down_revision = "0020"
branch_labels = None
depends_on = None

UNKNOWN_TO_OLDER = b"SMo3"
"""With what moments of such samples begin."""


def upgrade() -> None:
    op.add_column("sample_summaries", sa.Column("velocity_is_relative", sa.Boolean(), nullable=True))


def downgrade() -> None:
    """Moments that the older version cannot read go; it makes its own from the samples."""
    samples = sa.table("sample_summaries", sa.column("moments", sa.LargeBinary))
    begins = sa.func.substr(samples.c.moments, 1, len(UNKNOWN_TO_OLDER), type_=sa.LargeBinary)
    op.execute(sa.update(samples).where(begins == UNKNOWN_TO_OLDER).values(moments=None))
    with op.batch_alter_table("sample_summaries") as table:
        table.drop_column("velocity_is_relative")
