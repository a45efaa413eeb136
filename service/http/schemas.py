"""What goes over the wire: the shapes of requests and answers, with examples."""

from datetime import datetime
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator
from pydantic.config import JsonDict

from db.records import AuditEntry, Job, JobKind, JobStatus, Material, StoredGraspLog, StoredModel, Withdrawal
from db.text import is_storable

NAME_PATTERN = r"^[A-Za-z0-9][A-Za-z0-9 ._-]{0,99}$"
ModelMethod = Literal["ols", "robust", "conjugate", "hierarchical", "bayes"]
FitMethod = Literal["ols", "robust", "conjugate", "hierarchical", "bayes", "auto"]

_MOMENT = "2026-11-21T08:41:00.123456Z"
_MODEL: JsonDict = {
    "material": "paper",
    "method": "ols",
    "version": 3,
    "current": True,
    "outdated": False,
    "coefficients": [0.41, -0.8, -0.35],
    "covariance": [[1.0e-5, 0.0, 0.0], [0.0, 1.0e-2, 0.0], [0.0, 0.0, 4.0e-3]],
    "scale": 0.021,
    "n": 5120,
    "degrees_of_freedom": 11.0,
    "scatter_degrees_of_freedom": 5117.0,
    "domain": {"tangential_velocity": [0.0, 0.004], "normal_force": [0.002, 0.11]},
    "identifiable": [True, True, False],
    "element_area": 1.0e-6,
    "diagnostics": {"r_squared": 0.31, "cluster_kind": "grasp"},
    "cost": {"seconds": 0.012, "monte_carlo_error": 0.0},
    "created_at": _MOMENT,
}
_MATERIAL: JsonDict = {
    "name": "paper",
    "aliases": ["80 g paper"],
    "description": "80 g/m²",
    "created_at": _MOMENT,
    "grasp_logs": 12,
    "withdrawn_grasp_logs": 0,
    "models": {"ols": _MODEL},
}
_JOB: JsonDict = {
    "id": "0f8fad5bd9cb469fa16570867728950e",
    "kind": "ingest",
    "status": "done",
    "stage": None,
    "reason": None,
    "seconds": {"frames": 0.01, "slip_state": 0.06, "samples": 0.01, "friction_model": 0.02, "material": 0.01},
    "grasp_log": "7c9e6679742540de944be07fc1f90ae7",
    "material": "paper",
    "deaths": 0,
    "model_version": 3,
    "requested_by": "3f9c2a7b51de",
    "created_at": _MOMENT,
    "finished_at": _MOMENT,
}
_DETECTION: JsonDict = {
    "method": "filter",
    "noise": 1.1e-6,
    "stick_ratio_min": 0.12,
    "contact_frames": 240,
    "macro_slip_frames": 0,
    "events": {"onset": 181, "end": 40, "touch": 203, "release": 0},
    "samples": 1932,
    "seconds": 0.06,
}
_SAMPLES: JsonDict = {
    "friction_coefficient": [0.41],
    "tangential_velocity": [0.0012],
    "normal_force": [0.05],
    "tangential_force": [0.0205],
    "time": [2.133],
    "element": [190],
    "weight": [0.97],
    "element_area": 1.0e-6,
}
_GRASP_LOG: JsonDict = {
    "id": "7c9e6679742540de944be07fc1f90ae7",
    "sha256": "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08",
    "bytes": 4806144,
    "format": "npz",
    "material": "paper",
    "sensor": "AD2-0065L",
    "frames": 250,
    "duration": 8.3,
    "grid": [20, 20],
    "created_at": _MOMENT,
    "has_file": True,
    "uploaded_by": "3f9c2a7b51de",
    "withdrawal": None,
    "job": _JOB,
    "detection": _DETECTION,
}


def _storable(text: str) -> str:
    if not is_storable(text):
        raise ValueError("text without NUL and lone surrogates")
    return text


Name = Annotated[str, Field(pattern=NAME_PATTERN, description="1 to 100 letters, digits, spaces and `._-`.")]
Text = Annotated[str, Field(max_length=10_000), AfterValidator(_storable)]
Reference = Annotated[str, AfterValidator(_storable)]
"""The name or id of what may be stored."""


class Body(BaseModel):
    """What a request may say: known fields only, and of their own types: neither ``true`` nor ``"1"`` is a number."""

    model_config = ConfigDict(extra="forbid", strict=True)


class NewMaterial(Body):
    """A material to be made known."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"name": "paper", "description": "80 g/m²"}]})

    name: Name
    description: Text = ""


class MaterialChange(Body):
    """What is to be different about a material; what is left out stays."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"name": "cardboard brown"}]})

    name: Annotated[Name | None, Field(description="Its new name; the old one becomes an alias")] = None
    description: Text | None = None


class NewMerge(Body):
    """A merge that is asked for."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"source": "papre"}]})

    source: Annotated[Reference, Field(max_length=100, description="The material whose logs and names move here")]


class NewWithdrawal(Body):
    """Why a log is to be withdrawn."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"reason": "the sensor was wet"}]})

    reason: Annotated[Text, Field(min_length=1)]


class NewFit(Body):
    """A fit that is asked for."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"method": "bayes", "seed": 0}]})

    method: Annotated[FitMethod, Field(description="`auto` takes the one that the data call for")] = "ols"
    seed: Annotated[int, Field(ge=0, lt=2**32, description="Of the sampler: the same seed gives the same fit.")] = 0


class DomainOut(BaseModel):
    """Range of the samples behind a model."""

    tangential_velocity: Annotated[tuple[float, float], Field(description="m/s")]
    normal_force: Annotated[tuple[float, float], Field(description="N on an element")]


class CostOut(BaseModel):
    """What a fit cost."""

    seconds: float
    monte_carlo_error: Annotated[float, Field(description="In posterior standard deviations; 0 for an exact method.")]


class FrictionModelOut(BaseModel):
    """One version of a material's model μ = β₀ + β₁ v + β₂ f_n + ε."""

    model_config = ConfigDict(json_schema_extra={"examples": [_MODEL]})

    material: str
    method: str
    version: int
    current: bool
    outdated: Annotated[bool, Field(description="The material's logs are others since, and it is not fitted to them")]
    coefficients: Annotated[list[float], Field(description="β₀ [-], β₁ [s/m], β₂ [1/N]")]
    covariance: Annotated[list[list[float]], Field(description="Of the coefficients, 3×3")]
    scale: Annotated[float, Field(description="σ, standard deviation of ε [-]")]
    n: Annotated[int, Field(description="Samples behind the model")]
    degrees_of_freedom: Annotated[float | None, Field(description="Of the coefficients' Student-t; null: normal")]
    scatter_degrees_of_freedom: Annotated[float | None, Field(description="Of the scatter's Student-t; null: normal")]
    domain: DomainOut
    identifiable: Annotated[list[bool], Field(description="Whether the data tell β₀, β₁, β₂")]
    element_area: Annotated[float, Field(description="m²")]
    diagnostics: dict[str, float | str | None]
    cost: CostOut
    created_at: datetime

    @classmethod
    def of(cls, stored: StoredModel) -> "FrictionModelOut":
        """The stored model as an answer."""
        model = stored.model
        return cls(
            material=stored.material,
            method=model.method,
            version=stored.version,
            current=stored.current,
            outdated=stored.outdated,
            coefficients=list(model.coefficients),
            covariance=[list(line) for line in model.covariance],
            scale=model.scale,
            n=model.n,
            degrees_of_freedom=model.degrees_of_freedom,
            scatter_degrees_of_freedom=model.scatter_degrees_of_freedom,
            domain=DomainOut(tangential_velocity=model.tangential_velocity, normal_force=model.normal_force),
            identifiable=list(model.identifiable),
            element_area=model.element_area,
            diagnostics=dict(model.diagnostics),
            cost=CostOut(seconds=model.cost_seconds, monte_carlo_error=model.monte_carlo_error),
            created_at=stored.created_at,
        )


Next = Annotated[str | None, Field(description="The `cursor` of what comes after these; null at the end")]


class FrictionModelsOut(BaseModel):
    """Versions of a material's models, newest first."""

    items: list[FrictionModelOut]
    next: Next


class MaterialOut(BaseModel):
    """A material with its current models."""

    model_config = ConfigDict(json_schema_extra={"examples": [_MATERIAL]})

    name: str
    aliases: Annotated[list[str], Field(description="Other names under which it is found")]
    description: str
    created_at: datetime
    grasp_logs: Annotated[int, Field(description="How many logs of it are stored")]
    withdrawn_grasp_logs: Annotated[int, Field(description="How many of them count in no fit")]
    models: Annotated[dict[str, FrictionModelOut], Field(description="The current model of each method")]

    @classmethod
    def of(cls, material: Material) -> "MaterialOut":
        """The stored material as an answer."""
        return cls(
            name=material.name,
            aliases=list(material.aliases),
            description=material.description,
            created_at=material.created_at,
            grasp_logs=material.grasp_logs,
            withdrawn_grasp_logs=material.withdrawn_grasp_logs,
            models={stored.model.method: FrictionModelOut.of(stored) for stored in material.models},
        )


class MaterialsOut(BaseModel):
    """Materials in the order that was asked for."""

    items: list[MaterialOut]
    next: Next


class FrictionOut(BaseModel):
    """Friction coefficient of a material at a tangential velocity and an element's normal force."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "material": "paper",
                    "method": "ols",
                    "version": 3,
                    "tangential_velocity": 0.0,
                    "normal_force": 0.05,
                    "quantile": 0.05,
                    "friction_coefficient": 0.36,
                    "mean": 0.39,
                    "within_domain": True,
                    "warning": None,
                }
            ]
        }
    )

    material: str
    method: str
    version: int
    tangential_velocity: Annotated[float, Field(description="m/s")]
    normal_force: Annotated[float, Field(description="N on an element")]
    quantile: float | None
    friction_coefficient: Annotated[float, Field(description="The quantile that was asked for; without one, the mean")]
    mean: float
    within_domain: Annotated[bool, Field(description="Whether the model's samples reach there")]
    warning: str | None


class EventCounts(BaseModel):
    """How many events of each kind a log has."""

    onset: int
    end: int
    touch: int
    release: int


class DetectionOut(BaseModel):
    """What the detector found in a log."""

    model_config = ConfigDict(json_schema_extra={"examples": [_DETECTION]})

    method: str
    noise: Annotated[float | None, Field(description="Estimated noise of a marker coordinate, m")]
    stick_ratio_min: Annotated[float | None, Field(description="Least stick area over contact area; null: no contact")]
    contact_frames: int
    macro_slip_frames: Annotated[int, Field(description="Frames in which no element in contact sticks")]
    events: EventCounts
    samples: Annotated[int, Field(description="Number of friction samples")]
    seconds: Annotated[float, Field(description="What the detection took")]


class JobOut(BaseModel):
    """A job; `refused`: the data do not allow it, `failed`: the service could not do it, `cancelled`: by request.

    `reason` says why.
    """

    model_config = ConfigDict(json_schema_extra={"examples": [_JOB]})

    id: str
    kind: JobKind
    status: JobStatus
    stage: Annotated[str | None, Field(description="The stage it is in, or in which it ended")]
    reason: str | None
    seconds: Annotated[dict[str, float], Field(description="Of each stage that is done")]
    grasp_log: str | None
    material: str | None
    deaths: Annotated[int, Field(description="Worker processes that died under it")]
    model_version: Annotated[int | None, Field(description="The version of the model that it stored")]
    requested_by: Annotated[str | None, Field(description="Id of the access key with which it was asked for")]
    created_at: datetime
    finished_at: datetime | None

    @classmethod
    def of(cls, job: Job) -> "JobOut":
        """The stored job as an answer."""
        return cls(
            id=job.id,
            kind=job.kind,
            status=job.status,
            stage=job.stage,
            reason=job.reason,
            seconds=dict(job.seconds),
            grasp_log=job.grasp_log_id,
            material=job.material,
            deaths=job.deaths,
            model_version=job.model_version,
            requested_by=job.requested_by,
            created_at=job.created_at,
            finished_at=job.finished_at,
        )


class WithdrawalOut(BaseModel):
    """That a log counts in no fit."""

    at: datetime
    reason: str
    by: Annotated[str | None, Field(description="Id of the access key with which it was withdrawn")]

    @classmethod
    def of(cls, withdrawal: Withdrawal) -> "WithdrawalOut":
        """The stored withdrawal as an answer."""
        return cls(at=withdrawal.at, reason=withdrawal.because, by=withdrawal.by)


class JobsOut(BaseModel):
    """Jobs in the order that was asked for."""

    items: list[JobOut]
    next: Next


class GraspLogOut(BaseModel):
    """A stored grasp log, its ingest job and, once there, what was found in it."""

    model_config = ConfigDict(json_schema_extra={"examples": [_GRASP_LOG]})

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
        seconds=found.seconds,
    )


class GraspLogsOut(BaseModel):
    """Grasp logs in the order that was asked for."""

    items: list[GraspLogOut]
    next: Next


class MergedOut(BaseModel):
    """A material after a merge, and the fits that follow from it."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"material": _MATERIAL, "jobs": [_JOB]}]})

    material: MaterialOut
    jobs: list[JobOut]


class WithdrawnOut(BaseModel):
    """A log after its withdrawal or its return, and the fits that follow from it."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"grasp_log": _GRASP_LOG, "jobs": [_JOB]}]})

    grasp_log: GraspLogOut
    jobs: list[JobOut]


class StickRatioOut(BaseModel):
    """Stick area over contact area, over time."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"time": [0.0, 0.033, 0.067], "stick_ratio": [None, 1.0, 0.93]}]}
    )

    time: Annotated[list[float], Field(description="s")]
    stick_ratio: Annotated[list[float | None], Field(description="null without contact")]


class EventsOfOneKind(BaseModel):
    """Events in order of time."""

    element: Annotated[list[int], Field(description="Row-major index on the lattice")]
    time: Annotated[list[float], Field(description="s")]


class EventsOut(BaseModel):
    """Slip onset and end, contact touch and release."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "onset": {"element": [189, 190], "time": [2.1, 2.133]},
                    "end": {"element": [], "time": []},
                    "touch": {"element": [189, 190], "time": [0.5, 0.5]},
                    "release": {"element": [], "time": []},
                }
            ]
        }
    )

    onset: EventsOfOneKind
    end: EventsOfOneKind
    touch: EventsOfOneKind
    release: EventsOfOneKind


class SamplesOut(BaseModel):
    """Friction samples of a log, one entry an element and frame."""

    model_config = ConfigDict(json_schema_extra={"examples": [_SAMPLES]})

    friction_coefficient: list[float]
    tangential_velocity: Annotated[list[float], Field(description="m/s")]
    normal_force: Annotated[list[float], Field(description="N on the element")]
    tangential_force: Annotated[list[float], Field(description="N on the element")]
    time: Annotated[list[float], Field(description="s")]
    element: Annotated[list[int], Field(description="Row-major index on the lattice")]
    weight: Annotated[list[float], Field(description="Probability that the element did slip")]
    element_area: Annotated[float, Field(description="m²")]


LARGEST_FORCE, LARGEST_VELOCITY = 1e4, 1e3
"""N on one element, as of an uploaded log, and m/s: beyond, a question is a mistake of units."""

SMALLEST_TAIL = 1e-12
"""As the planner's smallest slip probability; a Student-t quantile further out says nothing of friction."""


_Velocity = Annotated[float, Field(ge=0.0, le=LARGEST_VELOCITY, allow_inf_nan=False)]
_Force = Annotated[float, Field(ge=0.0, le=LARGEST_FORCE, allow_inf_nan=False)]
_Area = Annotated[float, Field(gt=1e-12, le=1.0, allow_inf_nan=False, description="m²")]


class LookUpQuery(BaseModel):
    """What a look-up asks: the parameters of its address."""

    fn: Annotated[_Force, Field(description="Normal force on an element, N", examples=[0.05])]
    v: Annotated[_Velocity, Field(description="Tangential velocity, m/s", examples=[0.0])] = 0.0
    quantile: Annotated[
        float | None,
        Field(
            ge=SMALLEST_TAIL,
            le=1.0 - SMALLEST_TAIL,
            description="Of a new observation of μ; the mean without",
            examples=[0.05],
        ),
    ] = None
    method: Annotated[ModelMethod, Field(description="Whose current model answers")] = "ols"


class NewGraspForce(Body):
    """A grasp that must hold."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"material": "paper", "tangential_load": 1.5, "contact_area": 6.0e-5}]},
    )

    material: Reference
    method: Annotated[ModelMethod, Field(description="Whose current model answers")] = "ols"
    tangential_load: Annotated[float, Field(ge=0.0, le=1e6, description="Of all fingers together, N")]
    torque: Annotated[float, Field(ge=0.0, le=1e6, description="Of all fingers together, N·m")] = 0.0
    contact_area: Annotated[float, Field(ge=1e-12, le=1.0, description="Of one finger, m²")]
    round_at: Annotated[
        float | None,
        Field(ge=1e-9, le=1e6, description="Of a round fingertip: normal force, N, under which it has that area"),
    ] = None
    fingers: Annotated[int, Field(ge=1, le=100, description="Equal contacts that share load and torque")] = 1
    object_radius: Annotated[
        float | None,
        Field(ge=1e-6, le=1e3, description="m; where the torque is about the axis of a round object, such as a lid"),
    ] = None
    safety_factor: Annotated[float, Field(ge=1.0, le=100.0, description="Multiplies load and torque")] = 1.0
    slip_probability: Annotated[float, Field(ge=1e-12, le=0.5, description="The largest that is accepted")] = 1e-3
    tangential_velocity: Annotated[_Velocity, Field(description="m/s")] = 0.0
    normal_force_limit: Annotated[
        float | None, Field(gt=0.0, le=1e6, description="The most that object and gripper bear, N")
    ] = None


class GraspForceOut(BaseModel):
    """The normal force that holds, N."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "material": "paper",
                    "method": "ols",
                    "version": 3,
                    "normal_force": 4.9,
                    "feasible_interval": [4.9, 31.2],
                    "margin": 26.3,
                    "largest_load": 3.8,
                    "element_force": 0.081,
                    "friction_coefficient": 0.306,
                    "slip_probability": 0.001,
                    "within_domain": True,
                    "warning": None,
                }
            ]
        }
    )

    material: str
    method: str
    version: int
    normal_force: Annotated[float, Field(description="The smallest that holds, N")]
    feasible_interval: Annotated[
        list[float | None], Field(min_length=2, max_length=2, description="N; second null: no upper bound")
    ]
    margin: Annotated[float | None, Field(description="By how much the gripper may press too hard, N; null: any")]
    largest_load: Annotated[float | None, Field(description="The most that any force holds, N; null: any")]
    element_force: Annotated[float, Field(description="Normal force of one element then, N")]
    friction_coefficient: Annotated[float, Field(description="The cautious quantile there")]
    slip_probability: float
    within_domain: bool
    warning: str | None


class SamplesIn(Body):
    """Friction samples of one grasp, as `GET /v1/grasp-logs/{id}/samples` gives them."""

    model_config = ConfigDict(json_schema_extra={"examples": [_SAMPLES]})

    friction_coefficient: list[Annotated[float, Field(ge=0.0, le=1e3, allow_inf_nan=False)]]
    tangential_velocity: list[_Velocity]
    normal_force: list[_Force]
    tangential_force: list[_Force]
    time: list[Annotated[float, Field(ge=-1e9, le=1e9, allow_inf_nan=False)]]
    element: list[Annotated[int, Field(ge=0, lt=2**31)]]
    weight: list[Annotated[float, Field(ge=0.0, le=1.0, allow_inf_nan=False)]]
    element_area: _Area

    @model_validator(mode="after")
    def _alike(self) -> Self:
        lengths = {name: len(value) for name, value in self if isinstance(value, list)}
        if len(set(lengths.values())) > 1:
            raise ValueError(f"lists of one length, not {lengths}")
        return self


class NewRecognition(Body):
    """A grasp whose material is to be told: of a stored log, or of samples that are sent."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"grasp_log": "7c9e6679742540de944be07fc1f90ae7"}, {"samples": _SAMPLES}]},
    )

    grasp_log: Annotated[Reference | None, Field(max_length=32)] = None
    samples: SamplesIn | None = None
    materials: Annotated[
        list[Annotated[Reference, Field(max_length=100)]] | None,
        Field(min_length=1, max_length=100, description="Which it may be; without, all that have a model"),
    ] = None
    method: Annotated[ModelMethod, Field(description="Whose current models are compared")] = "ols"
    unknown: Annotated[float, Field(ge=0.0, lt=1.0, description="Probability beforehand that it is none of them")] = (
        0.05
    )

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        if (self.grasp_log is None) == (self.samples is None):
            raise ValueError("either grasp_log or samples")
        return self


class CandidateOut(BaseModel):
    """A material that it may be."""

    material: str
    version: Annotated[int, Field(description="Of the model that was compared")]
    probability: float


class RecognitionOut(BaseModel):
    """How probable each material is, the likeliest first."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "method": "ols",
                    "candidates": [{"material": "paper", "version": 3, "probability": 0.97}],
                    "unknown": 0.03,
                }
            ]
        }
    )

    method: str
    candidates: list[CandidateOut]
    unknown: Annotated[float, Field(description="Probability that it is none of them")]


class OwnersOut(BaseModel):
    """Whose a material is."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"owners": ["key:3f9c2a7b51de", "group:lab 1"]}]})

    owners: Annotated[list[str], Field(description="`key:ID` or `group:NAME`; none: the scope alone decides")]


class AuditEntryOut(BaseModel):
    """Who changed what, when, and from where."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "id": 812,
                    "at": _MOMENT,
                    "actor": "key:3f9c2a7b51de",
                    "address": "10.0.0.9",
                    "request_id": "3f1c9a0e6d2b4a5c8e7f0a1b2c3d4e5f",
                    "action": "grasp_log.withdrawn",
                    "subject": "7c9e6679742540de944be07fc1f90ae7",
                    "details": {"reason": "the sensor was wet"},
                }
            ]
        }
    )

    id: int
    at: datetime
    actor: Annotated[str, Field(description="`key:ID`, `anybody` without a key, `command:USER` or `service`")]
    address: Annotated[str | None, Field(description="Network address of the caller")]
    request_id: str | None
    action: Annotated[str, Field(description="docs/api.md has them all; more may be added")]
    subject: Annotated[str, Field(description="Name of a material, or id of a log, a job or a key")]
    details: dict[str, Any]

    @classmethod
    def of(cls, entry: AuditEntry) -> "AuditEntryOut":
        """The stored entry as an answer."""
        return cls(
            id=entry.id,
            at=entry.at,
            actor=entry.actor.name,
            address=entry.actor.address,
            request_id=entry.actor.request_id,
            action=entry.action,
            subject=entry.subject,
            details=dict(entry.details),
        )


class AuditOut(BaseModel):
    """Entries of the audit trail, newest first."""

    items: list[AuditEntryOut]
    next: Next


class HealthOut(BaseModel):
    """The process lives; its stores may be in trouble, which a restart does not always mend."""

    status: Literal["ok", "degraded"] = "ok"
    trouble: str | None = Field(default=None, description="What is wrong with database or files, since seconds ago")


class ReadyOut(BaseModel):
    """The service can take work."""

    status: Literal["ready"] = "ready"
    database: Literal["ok"] = "ok"
    blobs: Literal["ok"] = "ok"


class WrongValue(BaseModel):
    """One of several things that were wrong."""

    name: str
    value: str | None
    allowed: str | None


class ProblemOut(BaseModel):
    """Problem details, RFC 9457."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "type": "/problems/invalid-request",
                    "title": "A value in the request is not allowed",
                    "status": 422,
                    "detail": "quantile is 1.5; allowed: less than 1",
                    "instance": "/v1/materials/paper/friction",
                    "request_id": "3f1c9a0e6d2b4a5c8e7f0a1b2c3d4e5f",
                    "name": "quantile",
                    "value": "1.5",
                    "allowed": "less than 1",
                }
            ]
        }
    )

    type: Annotated[str, Field(description="Stable; docs/problems.md has them all")]
    title: str
    status: int
    detail: str
    instance: str
    request_id: Annotated[str | None, Field(description="As in the header `X-Request-ID` and in the server's log")] = (
        None
    )
    name: Annotated[str | None, Field(description="What was wrong")] = None
    value: str | None = None
    allowed: str | None = None
    errors: list[WrongValue] | None = None
    largest_load: Annotated[float | None, Field(description="Where no force holds: the most that is held, N")] = None
    normal_force: Annotated[float | None, Field(description="Where no force holds: that which holds it, N")] = None
