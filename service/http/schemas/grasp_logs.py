"""Grasp logs, what was found in them, and their withdrawal."""

from dataclasses import asdict
from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field
from pydantic.config import JsonDict

from db.records import Detection, Finding, JobStatus, StoredGraspLog, Withdrawal
from service.formats.tracked_markers import FRAME_RATE, SCALE
from service.http.schemas.common import MOMENT_EXAMPLE, USUAL, Body, CursorText, Limit, Next, Reason
from service.http.schemas.jobs import JOB_EXAMPLE, JobOut
from slipcore.defaults import METHOD_NAMES
from slipcore.finding import Severity, severity_of

FINDING_EXAMPLE: JsonDict = {
    "name": "no rest",
    "severity": "note",
    "evidence": "68 elements touch in the first frame",
    "remedy": "begin the recording before the touch: what was before is not known",
}
CONTACT_FRICTION_EXAMPLE: JsonDict = {
    "coefficient": 0.61,
    "low": 0.57,
    "high": 0.65,
    "is_bound": False,
    "reason": "the load grew no more in 58 frames of pivoting",
}
DETECTION_EXAMPLE: JsonDict = {
    "method": "filter",
    "noise": 1.1e-6,
    "stick_ratio_min": 0.12,
    "contact_frames": 240,
    "macro_slip_frames": 0,
    "events": {"onset": 181, "end": 40, "touch": 203, "release": 0},
    "samples": 1932,
    "velocity_is_relative": False,
    "seconds": 0.06,
    "findings": [FINDING_EXAMPLE],
    "contact_friction": CONTACT_FRICTION_EXAMPLE,
    "calibration": 1,
    "corrections": ["crosstalk of 0.08, 0 of the normal force taken off"],
}
GRASP_LOG_EXAMPLE: JsonDict = {
    "id": "7c9e6679742540de944be07fc1f90ae7",
    "sha256": "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08",
    "bytes": 4806144,
    "format": "npz",
    "material": "paper",
    "sensor": "AD2-0065L",
    "frames": 250,
    "duration": 8.3,
    "grid": [20, 20],
    "created_at": MOMENT_EXAMPLE,
    "has_file": True,
    "uploaded_by": "3f9c2a7b51de",
    "withdrawal": None,
    "job": JOB_EXAMPLE,
    "detection": DETECTION_EXAMPLE,
}


class NewWithdrawal(Body):
    """Why a log is to be withdrawn."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"reason": "the sensor was wet"}]})

    reason: Reason


class WithdrawalOut(BaseModel):
    """That a log counts in no fit."""

    at: datetime
    reason: str
    by: Annotated[str | None, Field(description="Id of the access key with which it was withdrawn")]

    @classmethod
    def of(cls, withdrawal: Withdrawal) -> "WithdrawalOut":
        """The stored withdrawal as an answer."""
        return cls(at=withdrawal.at, reason=withdrawal.because, by=withdrawal.by)


class EventCounts(BaseModel):
    """How many events of each kind a log has."""

    onset: int
    end: int
    touch: int
    release: int


class FindingOut(BaseModel):
    """Something to know about a log before its friction is used."""

    model_config = ConfigDict(json_schema_extra={"examples": [FINDING_EXAMPLE]})

    name: Annotated[str, Field(description="As in docs/checks.md")]
    severity: Annotated[Severity, Field(description="`warning`: makes friction doubtful; `note`: does not")]
    evidence: Annotated[str, Field(description="What was seen")]
    remedy: Annotated[str, Field(description="What to do about it")]


class ContactFrictionOut(BaseModel):
    """Friction of the contact as a whole, whatever its elements show."""

    model_config = ConfigDict(json_schema_extra={"examples": [CONTACT_FRICTION_EXAMPLE]})

    coefficient: Annotated[float, Field(description="Least friction that bears the load; the friction unless a bound")]
    low: Annotated[float, Field(description="Of its 95 % interval")]
    high: Annotated[float | None, Field(description="Of its 95 % interval; null for a bound")]
    is_bound: Annotated[bool, Field(description="Whether no slip of the whole contact was seen: it is `low` or more")]
    reason: Annotated[str, Field(description="What it was found from, or why there is no more than a bound")]


class DetectionOut(BaseModel):
    """What the detector found in a log."""

    model_config = ConfigDict(json_schema_extra={"examples": [DETECTION_EXAMPLE]})

    method: str
    noise: Annotated[float | None, Field(description="Estimated noise of a marker coordinate, m")]
    stick_ratio_min: Annotated[float | None, Field(description="Least stick area over contact area; null: no contact")]
    contact_frames: int
    macro_slip_frames: Annotated[int, Field(description="Frames in which the whole contact slips")]
    events: EventCounts
    samples: Annotated[int, Field(description="Number of friction samples")]
    velocity_is_relative: Annotated[
        bool | None,
        Field(
            description="Whether the samples' velocities are relative to what seems to stick, for want of the object's "
            "motion: they say nothing of β₁; null without samples, or from an older version"
        ),
    ]
    seconds: Annotated[float, Field(description="What the detection took")]
    findings: Annotated[
        list[FindingOut] | None, Field(description="Against the log; null where an older version did not look for any")
    ]
    contact_friction: Annotated[
        ContactFrictionOut | None, Field(description="Of the whole contact; null without forces or contact")
    ]
    calibration: Annotated[
        int | None, Field(description="Version of the sensor's calibration by which the log was corrected; null: none")
    ]
    corrections: Annotated[list[str] | None, Field(description="What that changed; null without a calibration")]


class GraspLogOut(BaseModel):
    """A stored grasp log, its ingest job and, once there, what was found in it."""

    model_config = ConfigDict(json_schema_extra={"examples": [GRASP_LOG_EXAMPLE]})

    id: str
    sha256: Annotated[str, Field(description="Of what is stored: the uploaded bytes, or the container made of them")]
    bytes: int
    format: str
    material: str | None
    sensor: str
    frames: int
    duration: Annotated[float, Field(description="s")]
    grid: Annotated[tuple[int, int], Field(description="Markers along the two axes")]
    created_at: datetime
    has_file: Annotated[bool, Field(description="Whether the upload can still be downloaded")]
    uploaded_by: Annotated[str | None, Field(description="Id of the access key with which it was first sent")]
    withdrawal: WithdrawalOut | None
    job: JobOut
    detection: DetectionOut | None

    @classmethod
    def of(cls, log: StoredGraspLog) -> "GraspLogOut":
        """The stored log as an answer."""
        return cls(
            id=log.id,
            sha256=log.sha256,
            bytes=log.bytes,
            format=log.format,
            material=log.material,
            sensor=log.sensor,
            frames=log.frames,
            duration=log.duration,
            grid=log.grid,
            created_at=log.created_at,
            has_file=log.has_file,
            uploaded_by=log.uploaded_by,
            withdrawal=WithdrawalOut.of(log.withdrawal) if log.withdrawal else None,
            job=JobOut.of(log.job),
            detection=_detection_out(log),
        )


def _finding_out(found: Finding) -> FindingOut:
    return FindingOut(**asdict(found), severity=severity_of(found.name))


def _contact_friction_out(found: Detection) -> ContactFrictionOut | None:
    return None if found.contact_friction is None else ContactFrictionOut(**asdict(found.contact_friction))


def _detection_out(log: StoredGraspLog) -> DetectionOut | None:
    found = log.detection
    if found is None or log.samples is None:
        return None
    return DetectionOut(
        method=found.method,
        noise=found.noise,
        stick_ratio_min=found.stick_ratio_min,
        contact_frames=found.contact_frames,
        macro_slip_frames=found.macro_slip_frames,
        events=EventCounts(onset=found.onsets, end=found.ends, touch=found.touches, release=found.releases),
        samples=log.samples.count,
        velocity_is_relative=log.samples.velocity_is_relative,
        seconds=found.seconds,
        findings=None if found.findings is None else [_finding_out(each) for each in found.findings],
        contact_friction=_contact_friction_out(found),
        calibration=found.calibration,
        corrections=None if found.corrections is None else list(found.corrections),
    )


class GraspLogsOut(BaseModel):
    """Grasp logs in the order that was asked for."""

    items: list[GraspLogOut]
    next: Next


class WithdrawnOut(BaseModel):
    """A log after its withdrawal or its return, and the fits that follow from it."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{"grasp_log": GRASP_LOG_EXAMPLE, "jobs": [JOB_EXAMPLE], "counts_instead": None}]
        }
    )

    grasp_log: GraspLogOut
    jobs: list[JobOut]
    counts_instead: Annotated[
        str | None,
        Field(
            description="Where a merge left this log behind, which counts in no fit either way: the id of the log of "
            "the same content that counts; null of any other log"
        ),
    ]


class UploadQuery(BaseModel):
    """What is said of an upload beside its body: the parameters of its address."""

    material: Annotated[
        str | None, Field(description="What was held; without it slip is only detected", examples=["paper"])
    ] = None
    sensor: Annotated[str | None, Field(description="In place of the sensor that the log names")] = None
    detector: Annotated[
        str | None,
        Field(
            description="Method of detection; without it the one that suits the log",
            json_schema_extra={"enum": list(METHOD_NAMES)},
        ),
    ] = None
    scale: Annotated[float | None, Field(description="Of tracked markers: m per pixel", ge=SCALE[0], le=SCALE[1])] = (
        None
    )
    frame_rate: Annotated[
        float | None,
        Field(description="Of tracked markers whose file counts frames: 1/s", ge=FRAME_RATE[0], le=FRAME_RATE[1]),
    ] = None
    mapping: Annotated[
        str | None,
        Field(
            description="Of formats with topics, fields or columns: which of them is what, as JSON (docs/formats.md)",
            examples=['{"topic": "/tactile", "displacement": {"field": "markers", "unit": "mm"}, "grid": [20, 20]}'],
        ),
    ] = None
    rest: Annotated[
        str | None,
        Field(max_length=60, description="Frame in which nothing touches: first, least contact, or its number"),
    ] = None


class GraspLogsQuery(BaseModel):
    """Which grasp logs are listed, and how: the parameters of the list's address."""

    material: Annotated[str | None, Field(description="Only those of this material")] = None
    sensor: Annotated[str | None, Field(max_length=200, description="Only those of this sensor")] = None
    status: Annotated[JobStatus | None, Field(description="Only those whose job is so")] = None
    withdrawn: Annotated[bool | None, Field(description="Only those that are withdrawn, or are not")] = None
    sort: Annotated[Literal["created_at", "-created_at"], Field(description="By what; `-` for the last ones first")] = (
        "-created_at"
    )
    limit: Limit = USUAL
    cursor: CursorText = None
