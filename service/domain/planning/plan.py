"""Answer a planner's other questions: which material this is, and how hard to grip."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import estimators
import stiction_client
from db.records import StoredModel
from db.repositories import friction_models, grasp_logs, materials
from estimators.errors import EstimatorError
from service.domain.errors import InvalidSamples, InvalidValue, NoFeasibleForce, NoModel, ResultsNotReady
from service.domain.models.model_cache import KnownModel
from service.domain.models.recommended import AUTO, PREFERENCE
from service.domain.models.stored_results import decode_samples, finite_or_none, to_client_model, to_friction_model
from service.domain.planning.look_up import Averaged
from service.domain.resources.context import Context
from service.domain.sensors.names import grasping
from slipcore import FrictionSamples
from slipcore.frames import UNNAMED
from stiction_client.support import Kind

if TYPE_CHECKING:
    from estimators import Moments

MOST_CANDIDATES = 100
"""Materials compared in one answer, which keeps one thread of the server busy for up to a millisecond each."""


@dataclass(frozen=True, slots=True)
class GraspTask:
    """A grasp that must hold ``tangential_load`` N and ``torque`` N·m of all fingers together; lengths in m.

    ``contact_area`` m² of one finger; ``round_at``: normal force N under which a round fingertip has that area;
    ``object_radius``: of a round object about whose axis the torque is; ``normal_force_limit`` N: what it may bear.
    ``of`` and ``elements``: whose scatter of friction counts, as ``required_normal_force`` takes them; ``sensor``: the
    name of that which grasps, as in ``FrictionQuery``.
    """

    material: str
    method: str
    tangential_load: float
    torque: float
    contact_area: float
    round_at: float | None
    fingers: int
    object_radius: float | None
    safety_factor: float
    slip_probability: float
    tangential_velocity: float
    normal_force_limit: float | None
    of: Averaged | None
    elements: float | None
    sensor: str | None = None


@dataclass(frozen=True, slots=True)
class GraspForce:
    """The normal force N that holds, and what else is known of it; bounds of None are infinite."""

    material: str
    method: str
    version: int
    chosen_because: str | None
    normal_force: float
    feasible_interval: tuple[float, float | None]
    margin: float | None
    largest_load: float | None
    element_force: float
    friction_coefficient: float
    slip_probability: float
    within_domain: bool
    warning: str | None
    of: Averaged
    elements: float
    support: Kind
    advice: str
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class ForceCurve:
    """The smallest and the largest normal force N that hold at each slip probability [n]: NaN where none does."""

    slip_probability: NDArray[np.float64]
    smallest: NDArray[np.float64]
    largest: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Candidate:
    """A material that it may be, with method and version of the model that was compared, and what that rests on."""

    material: str
    method: str
    version: int
    probability: float
    support: Kind
    advice: str


@dataclass(frozen=True, slots=True)
class Recognition:
    """How probable each material is, the likeliest first; ``unknown``: that it is none of them."""

    candidates: tuple[Candidate, ...]
    unknown: float


def grasp_force(context: Context, task: GraspTask) -> GraspForce:
    """The smallest normal force that holds; raises ``NoFeasibleForce``, ``InvalidValue``, ``NoModel``, ``NotFound``."""
    known = _model(context, task)
    model = _of_sensor(known, task)
    try:
        found = stiction_client.required_normal_force(
            model, task.tangential_load, task.slip_probability, **_given(task)
        )
    except stiction_client.NoFeasibleForce as refusal:
        facts = {
            "largest_load": refusal.largest_load,
            "normal_force": refusal.normal_force,
            "cause": refusal.cause,
            "largest_observed": refusal.largest_observed,
            "least_slip_probability": refusal.least_slip_probability,
        }
        raise NoFeasibleForce(str(refusal), facts=facts) from refusal
    except stiction_client.InvalidArgument as error:
        raise InvalidValue(error.name, error.value, error.allowed) from error
    low, high = found.feasible_interval
    force = asdict(found) | {
        "feasible_interval": (low, finite_or_none(high)),
        "margin": finite_or_none(found.margin),
        "largest_load": finite_or_none(found.largest_load),
        "warning": "; ".join(filter(None, (found.warning, known.disagreement))) or None,
    }
    return GraspForce(model.material, model.method, model.version, known.because, **force)


def force_curve(context: Context, task: GraspTask, probabilities: NDArray[np.float64]) -> ForceCurve:
    """The same question for each of some slip probabilities [n]; raises ``InvalidValue``, ``NoModel``, ``NotFound``."""
    model = _of_sensor(_model(context, task), task)
    load = np.full_like(probabilities, task.tangential_load)
    try:
        found = stiction_client.required_normal_force(model, load, probabilities, **_given(task))
    except stiction_client.InvalidArgument as error:
        raise InvalidValue(error.name, error.value, error.allowed) from error
    return ForceCurve(probabilities, *found.feasible_interval)


def _of_sensor(known: KnownModel, task: GraspTask) -> stiction_client.FrictionModel:
    model = to_client_model(known.stored)
    return model if task.sensor is None else model.on_sensor(task.sensor)


def _model(context: Context, task: GraspTask) -> KnownModel:
    """The model that answers; raises ``NoModel`` and ``NotFound``."""
    known = context.models.fresh(task.material, task.method)
    return known or context.models.read(context.database, task.material, task.method)


def _given(task: GraspTask) -> dict[str, Any]:
    """What a planner is given beside load and probability; raises ``InvalidArgument``."""
    return {
        "contacts": stiction_client.grasp(task.contact_area, task.round_at, task.fingers, task.object_radius),
        "torque": task.torque,
        "safety_factor": task.safety_factor,
        "tangential_velocity": task.tangential_velocity,
        "normal_force_limit": task.normal_force_limit,
        "of": task.of,
        "elements": task.elements,
    }


def recognise(
    context: Context,
    grasp: str | FrictionSamples,
    names: Sequence[str] | None,
    method: str,
    unknown: float,
    sensor: str | None = None,
) -> Recognition:
    """How probable it is that a grasp was of each material that has a model: of those named, or of all.

    Compared are the models of a ``method``, or each material's recommended one. ``grasp`` is the id of a stored log, or
    samples; ``unknown`` the probability beforehand that it is none of them. A model that knows the gain of the grasp's
    sensor is compared as that one shows it: of a stored log its own, or the one that is named.
    Raises ``InvalidSamples`` for those that say nothing, ``ResultsNotReady``, ``NoModel``, ``InvalidValue``,
    ``NotFound``.
    """
    stored = _candidates(context, names, method)
    evidence, own = _evidence(context, grasp)
    seen_by = grasping(sensor or own)
    models = {str(number): to_friction_model(each.model).of_sensor(seen_by) for number, each in enumerate(stored)}
    try:
        probabilities = estimators.recognise(evidence, models, unknown=unknown)
    except EstimatorError as error:
        raise InvalidSamples(str(error)) from error
    left = probabilities.pop("unknown")
    pairs = zip(stored, probabilities.values(), strict=True)
    candidates = [_candidate(each, probability) for each, probability in pairs]
    return Recognition(tuple(sorted(candidates, key=lambda each: -each.probability)), left)


def _candidate(stored: StoredModel, probability: float) -> Candidate:
    model = to_client_model(stored)
    return Candidate(stored.material, stored.model.method, stored.version, probability, model.support, model.advice)


def _candidates(context: Context, names: Sequence[str] | None, method: str) -> list[StoredModel]:
    methods = PREFERENCE if method == AUTO else (method,)
    with context.database.read() as session:
        if names is None:
            ids = friction_models.materials_with_current(session, methods, MOST_CANDIDATES + 1)
        else:
            ids = list(materials.find_ids(session, names).values())
        of_them = friction_models.all_current(session, ids).values()
    found = [best for models in of_them if (best := _preferred(models, methods)) is not None]
    if len(found) > MOST_CANDIDATES:
        allowed = f"at most {MOST_CANDIDATES} with a model: name those that it may be"
        raise InvalidValue("materials", f"more than {MOST_CANDIDATES}", allowed)
    if not found:
        raise NoModel(f"no material in question has a model fitted by {' or '.join(map(repr, methods))}", method)
    return found


def _preferred(models: Sequence[StoredModel], methods: Sequence[str]) -> StoredModel | None:
    """A material's model by the first of these methods that it has."""
    by_method = {stored.model.method: stored for stored in models}
    return next((by_method[method] for method in methods if method in by_method), None)


def _evidence(context: Context, grasp: str | FrictionSamples) -> "tuple[FrictionSamples | Moments, str]":
    """What is known of the grasp, and its sensor; the moments of a stored one say all that is asked."""
    if isinstance(grasp, FrictionSamples):
        return grasp, UNNAMED
    with context.database.read() as session:
        log = grasp_logs.get(session, grasp)
    if log.samples is None:
        raise ResultsNotReady(log.job.id, log.job.status)
    if log.samples.none_because is not None:
        raise InvalidSamples(log.samples.none_because)
    if log.samples.moments is not None:
        return estimators.Moments.from_bytes(log.samples.moments), log.sensor
    return decode_samples(context.blobs.path(log.samples.samples_blob)), log.sensor
