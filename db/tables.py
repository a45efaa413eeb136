"""The tables, and the rules that the database itself keeps."""

from datetime import UTC, datetime
from typing import Any, ClassVar, get_args

from sqlalchemy import (
    JSON,
    BigInteger,
    CheckConstraint,
    DateTime,
    Dialect,
    ForeignKey,
    Index,
    LargeBinary,
    MetaData,
    String,
    TypeDecorator,
    UniqueConstraint,
    text,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

from db.records import JobKind, JobStatus, Scope

CONSTRAINT_NAMES = {
    "ix": "ix_%(table_name)s_%(column_0_N_name)s",
    "uq": "uq_%(table_name)s_%(column_0_N_name)s",
    "ck": "ck_%(table_name)s_%(constraint_name)s",
    "fk": "fk_%(table_name)s_%(column_0_name)s_%(referred_table_name)s",
    "pk": "pk_%(table_name)s",
}


NAME = String(100).with_variant(String(100, collation="C"), "postgresql")
"""A name of a material, in the same order on every server, whatever its language."""


class UtcDateTime(TypeDecorator[datetime]):
    """A moment in UTC; SQLite keeps no zone, so it is put back on reading."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:  # noqa: ARG002
        """Refuse a moment without zone, since nobody could know which one it is."""
        if value is not None and value.tzinfo is None:
            raise ValueError(f"datetime is {value} without time zone; allowed: one with a zone")
        return None if value is None else value.astimezone(UTC)

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:  # noqa: ARG002
        """Give the moment back with its zone."""
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


def now() -> datetime:
    """The present moment, in UTC."""
    return datetime.now(UTC)


def _one_of(column: str, values: tuple[str, ...]) -> CheckConstraint:
    listed = ", ".join(f"'{value}'" for value in values)
    return CheckConstraint(f"{column} IN ({listed})", name=column)


class Base(DeclarativeBase):
    """Root of the tables; no relationships, so that every query stands where it is made."""

    metadata = MetaData(naming_convention=CONSTRAINT_NAMES)
    type_annotation_map: ClassVar[dict[Any, Any]] = {
        datetime: UtcDateTime(),
        dict[str, Any]: JSON(),
        list[Any]: JSON(),
    }


class MaterialRow(Base):
    """A material whose friction is identified; one that was merged into another keeps the models it had."""

    __tablename__ = "materials"

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(NAME, index=True)
    description: Mapped[str]
    created_at: Mapped[datetime] = mapped_column(default=now)
    merged_into_id: Mapped[int | None] = mapped_column(ForeignKey("materials.id"), index=True)


class MaterialNameRow(Base):
    """A name under which a material is found, its own or an alias: no two materials share one."""

    __tablename__ = "material_names"

    name: Mapped[str] = mapped_column(NAME, primary_key=True)
    material_id: Mapped[int] = mapped_column(ForeignKey("materials.id"), index=True)


class MaterialOwnerRow(Base):
    """A key (``key:ID``) or a group of keys (``group:NAME``) that a material belongs to; without any, anybody's."""

    __tablename__ = "material_owners"

    material_id: Mapped[int] = mapped_column(ForeignKey("materials.id"), primary_key=True)
    owner: Mapped[str] = mapped_column(String(110), primary_key=True)


class SensorRow(Base):
    """A tactile sensor that logs come from, with the mechanics of its gel where they are known.

    ``young_modulus`` Pa; ``thickness`` m down to a rigid base, NULL without one; ``marker_depth`` m;
    ``relative_thickness`` at each marker over ``thickness``, NULL where it is alike everywhere; ``described_by`` is
    NULL where that was an admin, or nobody by a key.
    """

    __tablename__ = "sensors"

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(String(200), unique=True)
    created_at: Mapped[datetime] = mapped_column(default=now)
    young_modulus: Mapped[float | None]
    poisson_ratio: Mapped[float | None]
    thickness: Mapped[float | None]
    marker_depth: Mapped[float | None]
    relative_thickness: Mapped[list[list[float]] | None] = mapped_column(JSON(none_as_null=True))
    described_by: Mapped[str | None] = mapped_column(ForeignKey("access_keys.id"))


class SensorCalibrationRow(Base):
    """One version of what is known of a sensor's faults; the newest corrects the logs that come in from then on.

    ``presses``: logs that it was made from, with the force where it was known; ``model``: the sensor model as
    ``slipcore`` gives it, without the zero of each element, which is ``offset``: float64 N, row by row.
    """

    __tablename__ = "sensor_calibrations"
    __table_args__ = (UniqueConstraint("sensor_id", "version"), CheckConstraint("version > 0", name="version"))

    id: Mapped[int] = mapped_column(primary_key=True)
    sensor_id: Mapped[int] = mapped_column(ForeignKey("sensors.id"))
    version: Mapped[int]
    created_at: Mapped[datetime] = mapped_column(default=now)
    created_by: Mapped[str | None] = mapped_column(ForeignKey("access_keys.id"))
    presses: Mapped[list[Any]]
    model: Mapped[dict[str, Any]]
    offset: Mapped[bytes | None] = mapped_column(LargeBinary)


class GraspLogRow(Base):
    """A grasp log; its bytes are the blob of hash ``sha256``. The same content, material and detector is one log.

    ``number``: counts up in the order in which logs come in, which no clock moves.
    ``calibration``: the version of its sensor's that was the newest when it was sent, and corrects it.
    ``file_state`` is NULL while the blob is there, since ``file_since``; ``uploaded_by`` is NULL where no key was sent.
    """

    __tablename__ = "grasp_logs"
    __table_args__ = (
        UniqueConstraint("sha256", "material_id", "detector"),
        # NULLs are distinct to a unique constraint, so logs without material need their own rule
        Index(
            "uq_grasp_logs_without_material",
            "sha256",
            "detector",
            unique=True,
            sqlite_where=text("material_id IS NULL"),
            postgresql_where=text("material_id IS NULL"),
        ),
        CheckConstraint("bytes > 0", name="bytes"),
        CheckConstraint("frames > 1", name="frames"),
        CheckConstraint("duration > 0", name="duration"),
        CheckConstraint("(withdrawn_at IS NULL) = (withdrawn_because IS NULL)", name="withdrawn"),
        Index(None, "created_at", "id"),
        Index(None, "material_id", "created_at", "id"),
        Index(None, "sensor_id", "created_at", "id"),
        Index(None, "number"),
        Index(None, "material_id", "number", "id"),
        # counted for each material in a list, without a look at its other logs
        Index(
            "ix_grasp_logs_withdrawn",
            "material_id",
            sqlite_where=text("withdrawn_at IS NOT NULL"),
            postgresql_where=text("withdrawn_at IS NOT NULL"),
        ),
        Index(None, "uploaded_by", "created_at"),  # how much a key has sent lately
        _one_of("file_state", ("leaving", "gone")),
        Index(None, "file_state", "file_since"),  # what has been there for longest, and what is to be deleted
    )

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    number: Mapped[int] = mapped_column(server_default="0")
    sha256: Mapped[str] = mapped_column(String(64))
    bytes: Mapped[int] = mapped_column(BigInteger)
    format: Mapped[str] = mapped_column(String(50))
    detector: Mapped[str] = mapped_column(String(50))
    material_id: Mapped[int | None] = mapped_column(ForeignKey("materials.id"))
    sensor_id: Mapped[int] = mapped_column(ForeignKey("sensors.id"))
    frames: Mapped[int]
    duration: Mapped[float]
    grid_rows: Mapped[int]
    grid_columns: Mapped[int]
    created_at: Mapped[datetime] = mapped_column(default=now)
    withdrawn_at: Mapped[datetime | None]
    withdrawn_because: Mapped[str | None]
    file_state: Mapped[str | None] = mapped_column(String(10))
    file_since: Mapped[datetime] = mapped_column(default=now)
    uploaded_by: Mapped[str | None] = mapped_column(ForeignKey("access_keys.id"))
    withdrawn_by: Mapped[str | None] = mapped_column(ForeignKey("access_keys.id"))
    calibration: Mapped[int | None]


class RunnerRow(Base):
    """A process that has jobs done. It is dead once its beats stand still, and its row then goes."""

    __tablename__ = "runners"

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    name: Mapped[str] = mapped_column(String(300))
    beats: Mapped[int] = mapped_column(BigInteger, default=0)
    started_at: Mapped[datetime] = mapped_column(default=now)


class JobRow(Base):
    """A durable job. A grasp log has exactly one, its ingest. A running one is claimed by its runner.

    ``requested_by`` is the access key with which it was asked for, NULL without one. The turns order the queue
    (``repositories.turns``).
    """

    __tablename__ = "jobs"
    __table_args__ = (
        _one_of("kind", get_args(JobKind)),
        _one_of("status", get_args(JobStatus)),
        CheckConstraint("(kind = 'ingest') = (grasp_log_id IS NOT NULL)", name="ingest_has_log"),
        CheckConstraint("kind = 'ingest' OR material_id IS NOT NULL", name="fit_has_material"),
        CheckConstraint("(status IN ('queued', 'running')) = (finished_at IS NULL)", name="finished_at"),
        CheckConstraint("(status = 'running') = (runner_id IS NOT NULL)", name="runner"),
        CheckConstraint("status NOT IN ('failed', 'refused', 'cancelled') OR reason IS NOT NULL", name="reason"),
        Index(None, "status", "created_at", "id"),  # the next one is found without a look at the others
        Index(None, "status", "turn"),
        Index(None, "status", "is_long", "turn"),  # a short one, among however many long ones
        Index(None, "status", "requested_by", "turn"),
        Index(None, "status", "requested_by", "turn_within_key"),
        Index(None, "status", "requested_by", "material_id", "is_long", "turn_within_key"),
        Index(None, "finished_at"),  # and so is what ended since a monitor last asked
        Index(None, "created_at", "id"),
    )

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    kind: Mapped[str] = mapped_column(String(10))
    status: Mapped[str] = mapped_column(String(10))
    runner_id: Mapped[str | None] = mapped_column(ForeignKey("runners.id"), index=True)
    stage: Mapped[str | None] = mapped_column(String(30))
    reason: Mapped[str | None]
    seconds: Mapped[dict[str, Any]]
    grasp_log_id: Mapped[str | None] = mapped_column(ForeignKey("grasp_logs.id"), unique=True)
    material_id: Mapped[int | None] = mapped_column(ForeignKey("materials.id"), index=True)
    method: Mapped[str] = mapped_column(String(30))
    seed: Mapped[int] = mapped_column(BigInteger)
    deaths: Mapped[int] = mapped_column(default=0)
    model_version: Mapped[int | None]
    trace: Mapped[str | None] = mapped_column(String(55))
    requested_by: Mapped[str | None] = mapped_column(ForeignKey("access_keys.id"))
    is_long: Mapped[bool] = mapped_column(default=False)
    turn: Mapped[int] = mapped_column(BigInteger, default=0)
    turn_within_key: Mapped[int] = mapped_column(BigInteger, default=0)
    created_at: Mapped[datetime] = mapped_column(default=now)
    finished_at: Mapped[datetime | None]


class DetectionRow(Base):
    """What the detector said of a log."""

    __tablename__ = "detections"

    grasp_log_id: Mapped[str] = mapped_column(ForeignKey("grasp_logs.id"), primary_key=True)
    method: Mapped[str] = mapped_column(String(50))
    noise: Mapped[float | None]
    stick_ratio_min: Mapped[float | None]
    contact_frames: Mapped[int]
    macro_slip_frames: Mapped[int]
    onsets: Mapped[int]
    ends: Mapped[int]
    touches: Mapped[int]
    releases: Mapped[int]
    seconds: Mapped[float]
    history_blob: Mapped[str] = mapped_column(String(64), index=True)
    findings: Mapped[list[Any] | None] = mapped_column(JSON(none_as_null=True))
    contact_friction: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    calibration: Mapped[int | None]
    corrections: Mapped[list[Any] | None] = mapped_column(JSON(none_as_null=True))
    gel: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    fingerprint: Mapped[str | None] = mapped_column(String(64))
    alike: Mapped[list[Any] | None] = mapped_column(JSON(none_as_null=True), deferred=True)
    signature: Mapped[bytes | None] = mapped_column(LargeBinary, deferred=True)
    created_at: Mapped[datetime] = mapped_column(default=now)


class SampleSummaryRow(Base):
    """The friction samples of a log, in numbers, with the hash of the blob that holds them."""

    __tablename__ = "sample_summaries"
    __table_args__ = (
        CheckConstraint("count >= 0", name="count"),
        CheckConstraint("(count = 0) = (none_because IS NOT NULL)", name="none_because"),
    )

    grasp_log_id: Mapped[str] = mapped_column(ForeignKey("grasp_logs.id"), primary_key=True)
    count: Mapped[int]
    none_because: Mapped[str | None]
    element_area: Mapped[float]
    friction_coefficient_mean: Mapped[float | None]
    tangential_velocity_min: Mapped[float | None]
    tangential_velocity_max: Mapped[float | None]
    normal_force_min: Mapped[float | None]
    normal_force_max: Mapped[float | None]
    samples_blob: Mapped[str] = mapped_column(String(64), index=True)
    moments: Mapped[bytes | None] = mapped_column(LargeBinary)
    velocity_is_relative: Mapped[bool | None]
    created_at: Mapped[datetime] = mapped_column(default=now)


class FrictionModelRow(Base):
    """One version of a material's friction model; at most one a material and method is current.

    A job stores one a method. It is ``outdated`` once the material's logs are others than those that it was fitted to.
    """

    __tablename__ = "friction_models"
    __table_args__ = (
        UniqueConstraint("material_id", "method", "version"),
        UniqueConstraint("job_id", "method"),
        Index(
            "uq_friction_models_current",
            "material_id",
            "method",
            unique=True,
            sqlite_where=text("current"),
            postgresql_where=text("current"),
        ),
        CheckConstraint("version > 0", name="version"),
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    material_id: Mapped[int] = mapped_column(ForeignKey("materials.id"))
    job_id: Mapped[str] = mapped_column(ForeignKey("jobs.id"))
    method: Mapped[str] = mapped_column(String(30))
    version: Mapped[int]
    current: Mapped[bool]
    outdated: Mapped[bool] = mapped_column(default=False)
    coefficients: Mapped[list[Any]]
    covariance: Mapped[list[Any]]
    scale: Mapped[float]
    n: Mapped[int] = mapped_column(BigInteger)
    degrees_of_freedom: Mapped[float | None]
    scatter_degrees_of_freedom: Mapped[float | None]
    scales: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    tangential_velocity_min: Mapped[float]
    tangential_velocity_max: Mapped[float]
    normal_force_min: Mapped[float]
    normal_force_max: Mapped[float]
    identifiable: Mapped[list[Any]]
    element_area: Mapped[float]
    diagnostics: Mapped[dict[str, Any]]
    cost_seconds: Mapped[float]
    monte_carlo_error: Mapped[float]
    created_at: Mapped[datetime] = mapped_column(default=now)


class AccessKeyRow(Base):
    """An access key; of its secret only the digest is kept. Keys of one ``group`` may own materials together."""

    __tablename__ = "access_keys"
    __table_args__ = (_one_of("scope", get_args(Scope)),)

    id: Mapped[str] = mapped_column(String(12), primary_key=True)
    name: Mapped[str] = mapped_column(String(100))
    scope: Mapped[str] = mapped_column(String(10))
    sha256: Mapped[str] = mapped_column(String(64))
    created_at: Mapped[datetime] = mapped_column(default=now)
    revoked_at: Mapped[datetime | None]
    expires_at: Mapped[datetime | None]
    group: Mapped[str | None] = mapped_column(String(100))


class BrowserSessionRow(Base):
    """A browser that somebody has logged in with an access key; of its token only the digest is kept."""

    __tablename__ = "browser_sessions"

    sha256: Mapped[str] = mapped_column(String(64), primary_key=True)
    key_id: Mapped[str] = mapped_column(ForeignKey("access_keys.id"), index=True)
    created_at: Mapped[datetime] = mapped_column(default=now)
    expires_at: Mapped[datetime] = mapped_column(index=True)


class IdempotencyKeyRow(Base):
    """A key under which somebody (an access key's id, or nobody's) asked for something, and what was answered."""

    __tablename__ = "idempotency_keys"

    owner: Mapped[str] = mapped_column(String(12), primary_key=True)
    key: Mapped[str] = mapped_column(String(200), primary_key=True)
    fingerprint: Mapped[str] = mapped_column(String(64))
    answer: Mapped[dict[str, Any]]
    created_at: Mapped[datetime] = mapped_column(default=now, index=True)


class AuditEntryRow(Base):
    """Who changed what, when, and from where; triggers of the database refuse changes and early deletions."""

    __tablename__ = "audit_entries"
    __table_args__ = (
        Index(None, "at"),
        Index(None, "actor", "id"),
        Index(None, "subject", "id"),
        Index(None, "action", "id"),
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    at: Mapped[datetime] = mapped_column(default=now)
    actor: Mapped[str] = mapped_column(String(120))
    address: Mapped[str | None] = mapped_column(String(100))
    request_id: Mapped[str | None] = mapped_column(String(128))
    action: Mapped[str] = mapped_column(String(50))
    subject: Mapped[str] = mapped_column(String(200))
    details: Mapped[dict[str, Any]]


class StoreRow(Base):
    """The id that the database shares with the blob store of its files (``db.identity``): one row, or none yet.

    ``webhook_entry_id``: the newest entry of the audit trail that the webhook has had or is never to have.
    ``clock_seen_at``: when a server last looked at the clock, by which uploads grow old; ``clock_steady_seconds`` for
    which it has been steady while one looked.
    """

    __tablename__ = "store"
    __table_args__ = (CheckConstraint("number = 1", name="number"),)

    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, default=1)
    id: Mapped[str] = mapped_column(String(32))
    created_at: Mapped[datetime] = mapped_column(default=now)
    webhook_entry_id: Mapped[int | None]
    clock_seen_at: Mapped[datetime | None]
    clock_steady_seconds: Mapped[float | None]
