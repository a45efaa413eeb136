"""Materials, sensors, grasp logs, jobs, detections, sample summaries and friction models."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None

LOST_ON_THE_WAY_BACK = (
    ("materials", "SELECT count(*) FROM materials"),
    ("sensors", "SELECT count(*) FROM sensors"),
    ("grasp logs", "SELECT count(*) FROM grasp_logs"),
    ("friction models", "SELECT count(*) FROM friction_models"),
)

CURRENT_ONLY = {"sqlite_where": sa.text("current"), "postgresql_where": sa.text("current")}
NO_MATERIAL = {"sqlite_where": sa.text("material_id IS NULL"), "postgresql_where": sa.text("material_id IS NULL")}


def upgrade() -> None:
    create_materials()
    create_sensors()
    create_grasp_logs()
    create_jobs()
    create_detections()
    create_sample_summaries()
    create_friction_models()


def downgrade() -> None:
    for table in (
        "friction_models",
        "sample_summaries",
        "detections",
        "jobs",
        "grasp_logs",
        "sensors",
        "materials",
    ):
        op.drop_table(table)


def created_at() -> sa.Column[object]:
    return sa.Column("created_at", sa.DateTime(timezone=True), nullable=False)


def create_materials() -> None:
    op.create_table(
        "materials",
        sa.Column("id", sa.Integer, nullable=False),
        sa.Column("name", sa.String(100), nullable=False),
        sa.Column("description", sa.String, nullable=False),
        created_at(),
        sa.PrimaryKeyConstraint("id", name="pk_materials"),
        sa.UniqueConstraint("name", name="uq_materials_name"),
    )


def create_sensors() -> None:
    op.create_table(
        "sensors",
        sa.Column("id", sa.Integer, nullable=False),
        sa.Column("name", sa.String(200), nullable=False),
        created_at(),
        sa.PrimaryKeyConstraint("id", name="pk_sensors"),
        sa.UniqueConstraint("name", name="uq_sensors_name"),
    )


def create_grasp_logs() -> None:
    op.create_table(
        "grasp_logs",
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("sha256", sa.String(64), nullable=False),
        sa.Column("bytes", sa.BigInteger, nullable=False),
        sa.Column("format", sa.String(50), nullable=False),
        sa.Column("detector", sa.String(50), nullable=False),
        sa.Column("material_id", sa.Integer),
        sa.Column("sensor_id", sa.Integer, nullable=False),
        sa.Column("frames", sa.Integer, nullable=False),
        sa.Column("duration", sa.Double, nullable=False),
        sa.Column("grid_rows", sa.Integer, nullable=False),
        sa.Column("grid_columns", sa.Integer, nullable=False),
        created_at(),
        sa.CheckConstraint("bytes > 0", name=op.f("ck_grasp_logs_bytes")),
        sa.CheckConstraint("frames > 1", name=op.f("ck_grasp_logs_frames")),
        sa.CheckConstraint("duration > 0", name=op.f("ck_grasp_logs_duration")),
        sa.ForeignKeyConstraint(["material_id"], ["materials.id"], name="fk_grasp_logs_material_id_materials"),
        sa.ForeignKeyConstraint(["sensor_id"], ["sensors.id"], name="fk_grasp_logs_sensor_id_sensors"),
        sa.PrimaryKeyConstraint("id", name="pk_grasp_logs"),
        sa.UniqueConstraint("sha256", "material_id", "detector", name="uq_grasp_logs_sha256_material_id_detector"),
    )
    op.create_index("ix_grasp_logs_material_id", "grasp_logs", ["material_id"])
    op.create_index("ix_grasp_logs_sensor_id", "grasp_logs", ["sensor_id"])
    op.create_index("uq_grasp_logs_without_material", "grasp_logs", ["sha256", "detector"], unique=True, **NO_MATERIAL)


def create_jobs() -> None:
    op.create_table(
        "jobs",
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("kind", sa.String(10), nullable=False),
        sa.Column("status", sa.String(10), nullable=False),
        sa.Column("stage", sa.String(30)),
        sa.Column("reason", sa.String),
        sa.Column("seconds", sa.JSON, nullable=False),
        sa.Column("grasp_log_id", sa.String(32)),
        sa.Column("material_id", sa.Integer),
        sa.Column("method", sa.String(30), nullable=False),
        sa.Column("seed", sa.BigInteger, nullable=False),
        sa.Column("deaths", sa.Integer, nullable=False),
        sa.Column("model_version", sa.Integer),
        created_at(),
        sa.Column("finished_at", sa.DateTime(timezone=True)),
        sa.CheckConstraint("kind IN ('ingest', 'fit')", name=op.f("ck_jobs_kind")),
        sa.CheckConstraint("status IN ('queued', 'running', 'done', 'failed', 'refused')", name=op.f("ck_jobs_status")),
        sa.CheckConstraint("(kind = 'ingest') = (grasp_log_id IS NOT NULL)", name=op.f("ck_jobs_ingest_has_log")),
        sa.CheckConstraint("kind = 'ingest' OR material_id IS NOT NULL", name=op.f("ck_jobs_fit_has_material")),
        sa.CheckConstraint(
            "(status IN ('queued', 'running')) = (finished_at IS NULL)", name=op.f("ck_jobs_finished_at")
        ),
        sa.CheckConstraint("status NOT IN ('failed', 'refused') OR reason IS NOT NULL", name=op.f("ck_jobs_reason")),
        sa.ForeignKeyConstraint(["grasp_log_id"], ["grasp_logs.id"], name="fk_jobs_grasp_log_id_grasp_logs"),
        sa.ForeignKeyConstraint(["material_id"], ["materials.id"], name="fk_jobs_material_id_materials"),
        sa.PrimaryKeyConstraint("id", name="pk_jobs"),
        sa.UniqueConstraint("grasp_log_id", name="uq_jobs_grasp_log_id"),
    )
    op.create_index("ix_jobs_status", "jobs", ["status"])
    op.create_index("ix_jobs_material_id", "jobs", ["material_id"])


def create_detections() -> None:
    op.create_table(
        "detections",
        sa.Column("grasp_log_id", sa.String(32), nullable=False),
        sa.Column("method", sa.String(50), nullable=False),
        sa.Column("noise", sa.Double),
        sa.Column("stick_ratio_min", sa.Double),
        sa.Column("contact_frames", sa.Integer, nullable=False),
        sa.Column("macro_slip_frames", sa.Integer, nullable=False),
        sa.Column("onsets", sa.Integer, nullable=False),
        sa.Column("ends", sa.Integer, nullable=False),
        sa.Column("touches", sa.Integer, nullable=False),
        sa.Column("releases", sa.Integer, nullable=False),
        sa.Column("seconds", sa.Double, nullable=False),
        sa.Column("history_blob", sa.String(64), nullable=False),
        created_at(),
        sa.ForeignKeyConstraint(["grasp_log_id"], ["grasp_logs.id"], name="fk_detections_grasp_log_id_grasp_logs"),
        sa.PrimaryKeyConstraint("grasp_log_id", name="pk_detections"),
    )
    op.create_index("ix_detections_history_blob", "detections", ["history_blob"])


def create_sample_summaries() -> None:
    op.create_table(
        "sample_summaries",
        sa.Column("grasp_log_id", sa.String(32), nullable=False),
        sa.Column("count", sa.Integer, nullable=False),
        sa.Column("none_because", sa.String),
        sa.Column("element_area", sa.Double, nullable=False),
        sa.Column("friction_coefficient_mean", sa.Double),
        sa.Column("tangential_velocity_min", sa.Double),
        sa.Column("tangential_velocity_max", sa.Double),
        sa.Column("normal_force_min", sa.Double),
        sa.Column("normal_force_max", sa.Double),
        sa.Column("samples_blob", sa.String(64), nullable=False),
        created_at(),
        sa.CheckConstraint("count >= 0", name=op.f("ck_sample_summaries_count")),
        sa.CheckConstraint("(count = 0) = (none_because IS NOT NULL)", name=op.f("ck_sample_summaries_none_because")),
        sa.ForeignKeyConstraint(
            ["grasp_log_id"], ["grasp_logs.id"], name="fk_sample_summaries_grasp_log_id_grasp_logs"
        ),
        sa.PrimaryKeyConstraint("grasp_log_id", name="pk_sample_summaries"),
    )
    op.create_index("ix_sample_summaries_samples_blob", "sample_summaries", ["samples_blob"])


def create_friction_models() -> None:
    op.create_table(
        "friction_models",
        sa.Column("id", sa.Integer, nullable=False),
        sa.Column("material_id", sa.Integer, nullable=False),
        sa.Column("job_id", sa.String(32), nullable=False),
        sa.Column("method", sa.String(30), nullable=False),
        sa.Column("version", sa.Integer, nullable=False),
        sa.Column("current", sa.Boolean, nullable=False),
        sa.Column("coefficients", sa.JSON, nullable=False),
        sa.Column("covariance", sa.JSON, nullable=False),
        sa.Column("scale", sa.Double, nullable=False),
        sa.Column("n", sa.Integer, nullable=False),
        sa.Column("degrees_of_freedom", sa.Double),
        sa.Column("scatter_degrees_of_freedom", sa.Double),
        sa.Column("tangential_velocity_min", sa.Double, nullable=False),
        sa.Column("tangential_velocity_max", sa.Double, nullable=False),
        sa.Column("normal_force_min", sa.Double, nullable=False),
        sa.Column("normal_force_max", sa.Double, nullable=False),
        sa.Column("identifiable", sa.JSON, nullable=False),
        sa.Column("element_area", sa.Double, nullable=False),
        sa.Column("diagnostics", sa.JSON, nullable=False),
        sa.Column("cost_seconds", sa.Double, nullable=False),
        sa.Column("monte_carlo_error", sa.Double, nullable=False),
        created_at(),
        sa.CheckConstraint("version > 0", name=op.f("ck_friction_models_version")),
        sa.ForeignKeyConstraint(["material_id"], ["materials.id"], name="fk_friction_models_material_id_materials"),
        sa.ForeignKeyConstraint(["job_id"], ["jobs.id"], name="fk_friction_models_job_id_jobs"),
        sa.PrimaryKeyConstraint("id", name="pk_friction_models"),
        sa.UniqueConstraint("job_id", name="uq_friction_models_job_id"),
        sa.UniqueConstraint("material_id", "method", "version", name="uq_friction_models_material_id_method_version"),
    )
    op.create_index(
        "uq_friction_models_current", "friction_models", ["material_id", "method"], unique=True, **CURRENT_ONLY
    )
