"""What the service answers, as small frozen records."""

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields
from typing import Any

from stiction_client import json_values
from stiction_client.errors import JobCancelled, JobFailed, JobRefused
from stiction_client.model import FrictionModel

ENDED = frozenset({"done", "failed", "refused", "cancelled"})


@dataclass(frozen=True, slots=True)
class Material:
    """A material and its current models, one a method; ``recommended``: which of them answers who names no method, and
    ``because`` why, in a sentence.

    ``withdrawn_grasp_logs``: how many of its ``grasp_logs`` count in no fit.
    """

    name: str
    description: str
    created_at: str
    grasp_logs: int
    models: Mapping[str, FrictionModel] = field(default_factory=dict)
    recommended: str | None = None
    withdrawn_grasp_logs: int = 0
    because: str | None = None

    @classmethod
    def from_json(cls, record: Mapping[str, Any]) -> "Material":
        """The material in the service's answer."""
        models = {method: FrictionModel.from_json(model) for method, model in record["models"].items()}
        best = record.get("recommended", {"method": "ols"})  # an older service recommends none
        return cls(
            name=json_values.text("name", record["name"]),
            description=record["description"],
            created_at=record["created_at"],
            grasp_logs=int(record["grasp_logs"]),
            models=models,
            recommended=None if best is None else str(best["method"]),
            withdrawn_grasp_logs=int(record.get("withdrawn_grasp_logs", 0)),
            because=None if best is None else best.get("because"),
        )


@dataclass(frozen=True, slots=True)
class Job:
    """Work that the service does after it has answered.

    ``status``: queued, running, done, refused (the data do not allow it; ``reason`` says why), failed (the service's
    own fault) or cancelled (by request); ``seconds`` of each stage; ``grasp_log``, ``material`` and ``model_version``
    it is about.
    """

    id: str
    kind: str
    status: str
    stage: str | None
    reason: str | None
    seconds: dict[str, float]
    grasp_log: str | None
    material: str | None
    model_version: int | None
    created_at: str
    finished_at: str | None

    @classmethod
    def from_json(cls, record: Mapping[str, Any]) -> "Job":
        """The job in the service's answer."""
        return cls(**_values(cls, record) | {"status": json_values.text("status", record["status"])})

    @property
    def ended(self) -> bool:
        """Whether the service has stopped working on it, with whatever result."""
        return self.status in ENDED

    def raise_for_status(self) -> "Job":
        """Return the job; raises ``JobRefused``, ``JobFailed`` or ``JobCancelled`` where it ended so."""
        if self.status == "refused":
            raise JobRefused(self.id, self.reason or "refused")
        if self.status == "failed":
            raise JobFailed(self.id, self.reason or "failed")
        if self.status == "cancelled":
            raise JobCancelled(self.id, self.reason or "cancelled")
        return self


@dataclass(frozen=True, slots=True)
class Finding:
    """Something to know about a log before its friction is used: its name, what was seen, and what to do about it.

    ``severity``: "warning" where it makes friction doubtful, else "note"; None from an older service.
    """

    name: str
    evidence: str
    remedy: str
    severity: str | None = None

    @classmethod
    def from_json(cls, record: Mapping[str, Any]) -> "Finding":
        """The finding in the service's answer."""
        return cls(**_values(cls, record))


@dataclass(frozen=True, slots=True)
class ContactFriction:
    """Friction of a contact as a whole, with its 95 % interval; where it ``is_bound`` friction is at least
    ``low``, and ``high`` is None.
    """

    coefficient: float
    low: float
    high: float | None
    is_bound: bool
    reason: str


@dataclass(frozen=True, slots=True)
class Detection:
    """What was seen in a grasp log: events of each kind, friction samples, frames, smallest stick ratio, and findings
    against it (None where the service did not look for any), and what the contact as a whole says of friction.
    ``velocity_is_relative``: whether the samples' velocities are relative to what seems to stick, for the log has no
    motion of the object (None where nobody noted it). ``calibration``: the version of its sensor's by which the log was
    corrected, and in ``corrections`` what that changed (None without).
    """

    method: str
    noise: float | None
    stick_ratio_min: float | None
    contact_frames: int
    macro_slip_frames: int
    events: dict[str, int]
    samples: int
    seconds: float
    findings: tuple[Finding, ...] | None = None
    contact_friction: ContactFriction | None = None
    velocity_is_relative: bool | None = None
    calibration: int | None = None
    corrections: tuple[str, ...] | None = None

    @classmethod
    def from_json(cls, record: Mapping[str, Any]) -> "Detection":
        """The detection in the service's answer."""
        values = _values(cls, record)
        if values.get("corrections") is not None:
            values["corrections"] = tuple(values["corrections"])
        if values.get("findings") is not None:
            values["findings"] = tuple(Finding.from_json(each) for each in values["findings"])
        if values.get("contact_friction") is not None:
            values["contact_friction"] = ContactFriction(**_values(ContactFriction, values["contact_friction"]))
        return cls(**values)


@dataclass(frozen=True, slots=True)
class Withdrawal:
    """That a log counts in no fit any more: when (ISO 8601), why, and the id of the key with which it was withdrawn."""

    at: str
    reason: str
    by: str | None


@dataclass(frozen=True, slots=True)
class GraspLogReceipt:
    """A grasp log as the service keeps it, with the job that works on it and, once there, the detection; where it was
    withdrawn, how. ``counts_instead``: in the answer to its withdrawal, the id of the log that still counts in its
    place, where a merge of materials had left this one behind.
    """

    id: str
    sha256: str
    bytes: int
    format: str
    material: str | None
    sensor: str
    frames: int
    duration: float
    grid: tuple[int, int]
    created_at: str
    job: Job
    detection: Detection | None
    withdrawal: Withdrawal | None = None
    counts_instead: str | None = None

    @classmethod
    def from_json(cls, record: Mapping[str, Any]) -> "GraspLogReceipt":
        """The grasp log in the service's answer."""
        values = _values(cls, record)
        rows, columns = values["grid"]
        detection, withdrawal = values["detection"], values.get("withdrawal")
        return cls(
            **values
            | {
                "grid": (rows, columns),
                "job": Job.from_json(values["job"]),
                "detection": None if detection is None else Detection.from_json(detection),
                "withdrawal": None if withdrawal is None else Withdrawal(**_values(Withdrawal, withdrawal)),
            }
        )


@dataclass(frozen=True, slots=True)
class FrictionAnswer:
    """Friction of a material at one velocity (m/s) and normal force (N) of an element of ``element_area`` m².

    ``friction_coefficient`` is the mean, or the quantile asked for ``of`` one "element", or of the mean over the
    ``elements`` of a "contact", and at least 0; ``mean`` that of the linear law, which may fall below 0 far outside of
    the data; ``warning`` says what was extrapolated; ``chosen_because``, why this model answers,
    where no method was named; ``support`` and ``advice``, what the answer rests on and what to do about it (None where
    an older service answers); ``notes``, what else is to be known of the model.
    """

    material: str
    method: str
    version: int
    tangential_velocity: float
    normal_force: float
    quantile: float | None
    friction_coefficient: float
    mean: float
    within_domain: bool
    warning: str | None
    of: str = "element"
    elements: int = 1
    chosen_because: str | None = None
    support: str | None = None
    advice: str | None = None
    notes: tuple[str, ...] = ()
    element_area: float | None = None

    @classmethod
    def from_json(cls, record: Mapping[str, Any]) -> "FrictionAnswer":
        """The lookup in the service's answer; raises ``ValueError`` for numbers that no friction has."""
        values = _values(cls, record) | {"notes": tuple(record.get("notes", ()))}
        for name in ("friction_coefficient", "tangential_velocity", "normal_force"):
            values[name] = json_values.number(name, values[name], least=0.0)
        values["mean"] = json_values.number("mean", values["mean"])
        values["within_domain"] = json_values.truth("within_domain", values["within_domain"])
        return cls(**values)


@dataclass(frozen=True, slots=True)
class NextGrasp:
    """The grasp of a material to record next: mean ``normal_force`` of an element N, ``slip_length`` m, ``speed`` m/s
    and ``direction`` rad of the slip; ``seconds`` that it takes.

    ``uncertainty``: half-width of the 95 % interval of the friction expected at the working point, and as it is
    expected ``after``; ``conservative_friction``, ``support`` and ``advice`` of what is known there now; ``beyond``: a
    sentence where it presses harder than any grasp so far; ``notes``: what else is to be known of the model.
    """

    material: str
    method: str
    version: int
    normal_force: float
    slip_length: float
    speed: float
    direction: float
    seconds: float
    uncertainty: float
    after: float
    conservative_friction: float
    support: str
    advice: str
    beyond: str | None = None
    notes: tuple[str, ...] = ()

    @classmethod
    def from_json(cls, record: Mapping[str, Any]) -> "NextGrasp":
        """The grasp in the service's answer; raises ``ValueError`` for numbers that no grasp has."""
        values = _values(cls, record) | {"notes": tuple(record.get("notes", ()))}
        values["normal_force"] = json_values.number("normal_force", values["normal_force"], above=0.0)
        for name in ("slip_length", "speed", "seconds", "uncertainty", "after"):
            values[name] = json_values.number(name, values[name], least=0.0)
        for name in ("direction", "conservative_friction"):
            values[name] = json_values.number(name, values[name])
        return cls(**values)


@dataclass(frozen=True, slots=True)
class Recognition:
    """How probable it is that a grasp was of each material, the likeliest first; ``unknown``: of none of them.

    ``advice``: what to do about each material's model, where that is not supported by its data; ``methods``: whose
    model of each material was compared.
    """

    method: str
    probability: dict[str, float]
    unknown: float
    advice: dict[str, str] = field(default_factory=dict)
    methods: dict[str, str] = field(default_factory=dict)

    @classmethod
    def from_json(cls, record: Mapping[str, Any]) -> "Recognition":
        """The recognition in the service's answer; raises ``ValueError`` for what is no probability."""
        probability = {entry["material"]: _probability(entry["probability"]) for entry in record["candidates"]}
        doubtful = (entry for entry in record["candidates"] if entry.get("support", "supported") != "supported")
        advice = {entry["material"]: f"{entry['support']}: {entry['advice']}" for entry in doubtful}
        methods = {entry["material"]: entry.get("method", record["method"]) for entry in record["candidates"]}
        return cls(record["method"], probability, _probability(record["unknown"]), advice, methods)


@dataclass(frozen=True, slots=True)
class AuditEntry:
    """That ``actor`` (``key:ID``, ``anybody``, ``command:USER`` or ``service``) did ``action`` to ``subject``.

    ``address`` and ``request_id`` say from where, ``details`` what else there is to say.
    """

    id: int
    at: str
    actor: str
    address: str | None
    request_id: str | None
    action: str
    subject: str
    details: dict[str, Any]

    @classmethod
    def from_json(cls, record: Mapping[str, Any]) -> "AuditEntry":
        """The entry in the service's answer."""
        return cls(**_values(cls, record))


def _probability(value: object) -> float:
    found = json_values.number("probability", value, least=0.0)
    if found > 1.0 + json_values.ROUNDING:
        raise ValueError(f"probability, which is {found:g}")
    return found


def _values(kind: type[Any], record: Mapping[str, Any]) -> dict[str, Any]:
    """Its fields; what a newer service adds is passed over, what an older one leaves out has its default."""
    known = (entry.name for entry in fields(kind) if entry.default is MISSING or entry.name in record)
    return {name: record[name] for name in known}
