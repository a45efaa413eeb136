"""By which a grasp is known that was sent in several files; logs of before have none until they are looked at anew.

Models fitted to logs that were stored before findings were looked for say so, as later fits do.
"""

from collections import Counter

import sqlalchemy as sa
from alembic import op

revision = "0026"
down_revision = "0025"
branch_labels = None
depends_on = None

LOST_ON_THE_WAY_BACK = (("fingerprints of grasps", "SELECT count(*) FROM detections WHERE fingerprint IS NOT NULL"),)

MARK = "unchecked_logs"
LOGS = sa.table("grasp_logs", *(sa.column(name) for name in ("id", "material_id", "withdrawn_at")))
SAMPLES = sa.table("sample_summaries", *(sa.column(name) for name in ("grasp_log_id", "count")))
DETECTIONS = sa.table("detections", sa.column("grasp_log_id"), sa.column("findings", sa.JSON(none_as_null=True)))
MODELS = sa.table(
    "friction_models",
    *(sa.column(name) for name in ("id", "material_id", "current")),
    sa.column("diagnostics", sa.JSON),
)


def upgrade() -> None:
    op.add_column("detections", sa.Column("fingerprint", sa.String(64), nullable=True))
    _note_unchecked_logs(op.get_bind())


def downgrade() -> None:
    with op.batch_alter_table("detections") as table:  # an older version shows the note among a model's diagnostics
        table.drop_column("fingerprint")


def _note_unchecked_logs(connection: sa.Connection) -> None:
    logs = (
        sa.select(LOGS.c.material_id, DETECTIONS.c.findings.is_(None))
        .join_from(LOGS, SAMPLES, SAMPLES.c.grasp_log_id == LOGS.c.id)
        .join(DETECTIONS, DETECTIONS.c.grasp_log_id == LOGS.c.id)
        .where(LOGS.c.withdrawn_at.is_(None), SAMPLES.c["count"] > 0)
    )
    found = Counter((material, bool(unchecked)) for material, unchecked in connection.execute(logs))
    current = sa.select(MODELS.c.id, MODELS.c.material_id, MODELS.c.diagnostics).where(MODELS.c.current)
    for key, material, diagnostics in connection.execute(current).all():
        if unchecked := found[material, True]:
            told = _sentence(unchecked, unchecked + found[material, False])
            noted = sa.update(MODELS).where(MODELS.c.id == key).values(diagnostics={**diagnostics, MARK: told})
            connection.execute(noted)


def _sentence(unchecked: int, logs: int) -> str:
    were = "log was" if logs == 1 else "logs was" if unchecked == 1 else "logs were"
    return f"{unchecked} of {logs} {were} stored before logs were checked: what is sent again is looked at"
