"""What the repositories hand out and take in: plain frozen records, independent of any session."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, Literal, NamedTuple

JobKind = Literal["ingest", "fit"]
JobStatus = Literal["queued", "running", "done", "failed", "refused", "cancelled"]
Scope = Literal["read", "upload", "admin"]
AuditAction = Literal[
    "material.created",
    "material.changed",
    "material.merged",
    "material.surface_changed",
    "material.epoch_begun",
    "alias.added",
    "alias.removed",
    "owner.added",
    "owner.removed",
    "sensor.described",
    "sensor.calibrated",
    "grasp_log.uploaded",
    "grasp_log.sensor_changed",
    "grasp_log.withdrawn",
    "grasp_log.restored",
    "grasp_log.file_deleted",
    "fit.requested",
    "job.cancelled",
    "key.created",
    "key.revoked",
    "audit.deleted",
    "blob.damaged",
    "quarantine.deleted",
    "store.adopted",
    "store.taken_over",
]
"""What is recorded of changes: the kind of thing, and what was done to it."""


@dataclass(frozen=True, slots=True)
class JobOrigin:
    """Where a job comes from: the place in a ``trace`` at which it was asked for (W3C traceparent), and the id of the
    access key with which it was ``requested_by``; None where there is none.
    """

    trace: str | None = None
    requested_by: str | None = None


@dataclass(frozen=True, slots=True)
class Scale:
    """A standard deviation, and the degrees of freedom of the Student-t that it scales, None where infinite."""

    value: float
    degrees_of_freedom: float | None


@dataclass(frozen=True, slots=True)
class Scales:
    """How friction scatters: between grasps, as a part of friction itself; between places and within, as friction.

    ``between_sensors``: where grasps are of several, how much these differ and what each shows, as
    ``stiction_client.SensorScale.to_json`` has it.
    """

    between_grasps: Scale
    between_places: Scale
    within: Scale
    between_sensors: Mapping[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class NewModel:
    """A fitted friction model about to be stored; coefficients β₀ [-], β₁ [s/m], β₂ [1/N], ranges in m/s and N.

    ``degrees_of_freedom`` of the coefficients and ``scatter_degrees_of_freedom`` of ε are None where infinite;
    ``scales`` is None where the method does not separate them, or the model was stored before they were kept.
    """

    method: str
    coefficients: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...]
    scale: float
    n: int
    degrees_of_freedom: float | None
    scatter_degrees_of_freedom: float | None
    tangential_velocity: tuple[float, float]
    normal_force: tuple[float, float]
    identifiable: tuple[bool, ...]
    element_area: float
    diagnostics: Mapping[str, float | str | None]
    cost_seconds: float
    monte_carlo_error: float
    scales: Scales | None = None


@dataclass(frozen=True, slots=True)
class StoredModel:
    """One version of a material's friction model; ``outdated`` where the material's logs are others since."""

    id: int
    material: str
    version: int
    current: bool
    outdated: bool
    created_at: datetime
    model: NewModel


@dataclass(frozen=True, slots=True)
class Material:
    """A material with its other names, the number of its logs, of those withdrawn, and a current model a method."""

    id: int
    name: str
    description: str
    created_at: datetime
    aliases: tuple[str, ...]
    grasp_logs: int
    withdrawn_grasp_logs: int
    models: tuple[StoredModel, ...]


@dataclass(frozen=True, slots=True)
class Job:
    """A durable job: an ``ingest`` of a grasp log or a ``fit`` of a material.

    ``deaths`` counts the worker processes that died under it; ``seconds`` is the time of each stage that is done;
    ``requested_by`` is the id of the access key with which it was asked for, None without one.
    """

    id: str
    kind: JobKind
    status: JobStatus
    stage: str | None
    reason: str | None
    seconds: Mapping[str, float]
    grasp_log_id: str | None
    material: str | None
    method: str
    seed: int
    deaths: int
    model_version: int | None
    trace: str | None
    requested_by: str | None
    created_at: datetime
    finished_at: datetime | None


@dataclass(frozen=True, slots=True)
class Claim:
    """A runner's right to do a job. It ends when the job does, is cancelled, or is taken from a runner that is dead."""

    job_id: str
    runner_id: str
    is_long: bool = False


@dataclass(frozen=True, slots=True)
class Runner:
    """A process that has jobs done: its ``beats`` only grow, for as long as it lives."""

    id: str
    name: str
    beats: int
    started_at: datetime


@dataclass(frozen=True, slots=True)
class Gel:
    """The mechanics of a sensor's gel, from which forces follow where it measures none.

    ``young_modulus`` Pa; ``thickness`` m from its surface to a rigid base, None where it is thick against any contact;
    ``marker_depth`` m of the markers below the surface; ``relative_thickness``: of a gel that is not alike thick
    everywhere, at each marker, row by row, over ``thickness``.
    """

    young_modulus: float
    poisson_ratio: float
    thickness: float | None
    marker_depth: float
    relative_thickness: Sequence[Sequence[float]] | None = None

    def __post_init__(self) -> None:
        if self.relative_thickness is not None:  # of JSON, which knows no tuples, and alike if its numbers are
            rows = tuple(tuple(map(float, row)) for row in self.relative_thickness)
            object.__setattr__(self, "relative_thickness", rows)


@dataclass(frozen=True, slots=True)
class Sensor:
    """A sensor that logs come from; ``gel`` is None where it was not described, ``calibration`` the newest version.

    ``described_by``: id of the key that described it, None where that was an admin's or no key was asked for.
    """

    id: int
    name: str
    gel: Gel | None
    calibration: int | None = None
    described_by: str | None = None


@dataclass(frozen=True, slots=True)
class CalibrationPress:
    """A log that a sensor was calibrated by; ``known_force`` N, with which the body pressed, None where unknown."""

    grasp_log: str
    known_force: float | None


@dataclass(frozen=True, slots=True)
class NewCalibration:
    """What was found of a sensor's faults: the sensor ``model`` as its package gives it, without the zero of each
    element, and that ``offset``, float64 N row by row, None where it is unknown.

    ``created_by``: the access key with which it was asked for, None without one.
    """

    presses: tuple[CalibrationPress, ...]
    model: Mapping[str, Any]
    offset: bytes | None
    created_by: str | None


@dataclass(frozen=True, slots=True)
class Calibration:
    """A version of a sensor's calibration."""

    id: int
    version: int
    created_at: datetime
    new: NewCalibration


@dataclass(frozen=True, slots=True)
class Finding:
    """Something that makes the friction found in a log doubtful: its name, what was seen, and what to do about it."""

    name: str
    evidence: str
    remedy: str


@dataclass(frozen=True, slots=True)
class ContactFriction:
    """Friction of a contact as a whole, with its 95 % interval, and what it was found from.

    Where it ``is_bound``, friction is at least ``low``, and ``high`` is None.
    """

    coefficient: float
    low: float
    high: float | None
    is_bound: bool
    reason: str


@dataclass(frozen=True, slots=True)
class Detection:
    """What a detector said of a log, in numbers; the histories are in the blob of hash ``history_blob``.

    ``noise`` m; ``seconds`` that the detection took; ``onsets`` … ``releases`` count events; ``findings`` against the
    log, None where an older version did not look for any; ``contact_friction``: None where nothing is known of it.
    ``calibration``: the version of its sensor's by which the log was corrected, and in ``corrections`` how; None where
    there was none. ``gel``: the mechanics of its sensor's gel as they were described then; None also where an older
    version did not note them. ``fingerprint``: the same in all logs of the same measurements, None where an older
    version did not take it.
    """

    method: str
    noise: float | None
    stick_ratio_min: float | None
    contact_frames: int
    macro_slip_frames: int
    onsets: int
    ends: int
    touches: int
    releases: int
    seconds: float
    history_blob: str
    findings: tuple[Finding, ...] | None = None
    contact_friction: ContactFriction | None = None
    calibration: int | None = None
    corrections: tuple[str, ...] | None = None
    gel: Gel | None = None
    fingerprint: str | None = None


class SeenClock(NamedTuple):
    """When a server last looked at the clock, ``at``, and for how many seconds it has been ``steady`` while one did."""

    at: datetime
    steady: float


class Signature(NamedTuple):
    """By which the grasp of a log is known again, and which log it is, by its id or fingerprint."""

    log: str
    content: bytes


@dataclass(frozen=True, slots=True)
class SampleSummary:
    """The friction samples of one log, in numbers; the samples are in the blob of hash ``samples_blob``.

    ``none_because`` says why there are none, where there are none; ``moments`` are their sufficient statistics as the
    estimators wrote them, None where there are no samples, and in a list of logs. ``velocity_is_relative``: whether the
    velocities are only relative to what seems to stick; None where there are none, or an older version did not note it.
    """

    count: int
    none_because: str | None
    element_area: float
    friction_coefficient_mean: float | None
    tangential_velocity: tuple[float, float] | None
    normal_force: tuple[float, float] | None
    samples_blob: str
    moments: bytes | None = None
    velocity_is_relative: bool | None = None


@dataclass(frozen=True, slots=True)
class SamplesOfLog:
    """Where the samples of one log are: in the blob of hash ``samples_blob``, and their ``moments`` where known.

    ``findings``: names of what was found against the log; ``sensor``: its name; ``copies``: ids of other logs of the
    same grasp, which do not count; ``is_checked``: whether findings and copies were looked for, as older versions did
    not.
    """

    grasp_log_id: str
    samples_blob: str
    moments: bytes | None
    findings: tuple[str, ...] = ()
    sensor: str = ""
    copies: tuple[str, ...] = ()
    is_checked: bool = True


@dataclass(frozen=True, slots=True)
class SampledLog:
    """The samples of one log, when it was sent, and the rows and columns of its sensor."""

    samples: SamplesOfLog
    created_at: datetime
    grid: tuple[int, int]


@dataclass(frozen=True, slots=True)
class NewGraspLog:
    """A grasp log about to be stored: its content's ``sha256`` and size, and what the reader found in it.

    ``uploaded_by`` is the id of the access key with which it was sent, None without one.
    """

    sha256: str
    bytes: int
    format: str
    detector: str
    material_id: int | None
    sensor: str
    frames: int
    duration: float
    grid: tuple[int, int]
    uploaded_by: str | None = None


@dataclass(frozen=True, slots=True)
class LogFilter:
    """Which logs are wanted; None: whatever they have there."""

    material_id: int | None = None
    sensor: str | None = None
    status: JobStatus | None = None
    withdrawn: bool | None = None


@dataclass(frozen=True, slots=True)
class Withdrawal:
    """That a log was taken out of the fits, when, why, and with which access key, None without one."""

    at: datetime
    because: str
    by: str | None = None


@dataclass(frozen=True, slots=True)
class StoredGraspLog:
    """A grasp log with its ingest job and, once there, what detection and sampling found.

    ``has_file``: whether its bytes are still there; ``uploaded_by``: the access key with which it was first sent;
    ``calibration``: the version of its sensor's that corrects it.
    """

    id: str
    sha256: str
    bytes: int
    format: str
    detector: str
    material: str | None
    sensor: str
    frames: int
    duration: float
    grid: tuple[int, int]
    created_at: datetime
    has_file: bool
    uploaded_by: str | None
    withdrawal: Withdrawal | None
    job: Job
    detection: Detection | None
    samples: SampleSummary | None
    calibration: int | None = None


@dataclass(frozen=True, slots=True)
class AccessKey:
    """An access key as it is known: its public ``id``, what it may do, and the SHA-256 of its secret.

    ``expires_at`` is None for one that does not expire; ``group`` is shared with other keys, or None.
    """

    id: str
    name: str
    scope: Scope
    sha256: str = field(repr=False)
    created_at: datetime
    revoked_at: datetime | None
    expires_at: datetime | None = None
    group: str | None = None


@dataclass(frozen=True, slots=True)
class Actor:
    """Who makes a change: ``key:ID``, ``anybody`` where no key is asked for, ``command:USER`` or ``service``.

    ``address`` is the network address, ``request_id`` the request's, where there is one.
    """

    name: str
    address: str | None = None
    request_id: str | None = None


@dataclass(frozen=True, slots=True)
class AuditEntry:
    """That ``actor`` did ``action`` to ``subject``: a name of a material, or the id of a log, a job or a key."""

    id: int
    at: datetime
    actor: Actor
    action: AuditAction
    subject: str
    details: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class AuditFilter:
    """Which entries are wanted; None: whatever they have there."""

    actor: str | None = None
    action: str | None = None
    subject: str | None = None
