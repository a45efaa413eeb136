"""Answer a planner's other questions: which material this is, and how hard to grip."""

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

import estimators
import stiction_client
from db.records import StoredModel
from db.repositories import friction_models, grasp_logs, materials
from estimators.errors import EstimatorError
from service.context import Context
from service.domain.look_up import OUTDATED
from service.domain.stored_results import decode_samples, to_friction_model
from service.http.problems import INVALID_REQUEST, INVALID_SAMPLES, NO_FEASIBLE_FORCE, NO_MODEL, NOT_READY, Problem
from service.http.schemas.models import FrictionModelOut
from service.http.schemas.planning import (
    CandidateOut,
    GraspForceOut,
    NewGraspForce,
    NewRecognition,
    RecognitionOut,
    SamplesIn,
)
from slipcore import FrictionSamples
from stiction_client.errors import InvalidArgument, NoFeasibleForce

if TYPE_CHECKING:
    from estimators import Moments

MOST_CANDIDATES = 100
"""Materials compared in one answer, which keeps one thread of the server busy for 0.15 ms each."""


def grasp_force(context: Context, wish: NewGraspForce) -> GraspForceOut:
    """The smallest normal force that holds; raises ``Problem`` where none does, and ``NotFound``."""
    known = context.models.fresh(wish.material, wish.method)
    known = known or context.models.read(context.database, wish.material, wish.method)
    model = stiction_client.FrictionModel.from_json(FrictionModelOut.of(known.stored).model_dump(mode="json"))
    try:
        answer = stiction_client.required_normal_force(
            model,
            wish.tangential_load,
            wish.slip_probability,
            contacts=stiction_client.grasp(wish.contact_area, wish.round_at, wish.fingers, wish.object_radius),
            torque=wish.torque,
            safety_factor=wish.safety_factor,
            tangential_velocity=wish.tangential_velocity,
            normal_force_limit=wish.normal_force_limit,
            of=wish.of,
            elements=wish.elements,
        )
    except NoFeasibleForce as refusal:
        more = {"largest_load": refusal.largest_load, "normal_force": refusal.normal_force, "cause": refusal.cause}
        raise Problem(NO_FEASIBLE_FORCE, str(refusal), more=more) from refusal
    except InvalidArgument as error:
        raise Problem.wrong_value(INVALID_REQUEST, error.name, error.value, error.allowed) from error
    low, high = answer.feasible_interval
    told = asdict(answer) | {
        "feasible_interval": [low, _finite(high)],
        "margin": _finite(answer.margin),
        "largest_load": _finite(answer.largest_load),
        "warning": "; ".join(filter(None, (answer.warning, OUTDATED if known.stored.outdated else None))) or None,
    }
    return GraspForceOut(
        material=model.material, method=model.method, version=model.version, chosen_because=known.because, **told
    )


def recognise(context: Context, wish: NewRecognition) -> RecognitionOut:
    """The probability of each material that has a model; raises ``Problem`` for samples that tell nothing."""
    candidates = _candidates(context, wish.materials, wish.method)
    models = {str(number): to_friction_model(stored.model) for number, stored in enumerate(candidates)}
    try:
        told = estimators.recognise(_samples(context, wish), models, unknown=wish.unknown)
    except EstimatorError as error:
        raise Problem(INVALID_SAMPLES, str(error)) from error
    unknown = told.pop("unknown")
    listed = [
        CandidateOut(material=stored.material, version=stored.version, probability=probability)
        for stored, probability in zip(candidates, told.values(), strict=True)
    ]
    listed.sort(key=lambda candidate: -candidate.probability)
    return RecognitionOut(method=wish.method, candidates=listed, unknown=unknown)


def _candidates(context: Context, names: Sequence[str] | None, method: str) -> list[StoredModel]:
    with context.database.read() as session:
        if names is None:
            found = friction_models.current_of_all(session, method, MOST_CANDIDATES + 1)
        else:
            ids = [materials.find_id(session, name) for name in names]
            of_them = friction_models.all_current(session, ids).values()
            found = [model for models in of_them for model in models if model.model.method == method]
    if len(found) > MOST_CANDIDATES:
        allowed = f"at most {MOST_CANDIDATES} with a model: name those that it may be"
        raise Problem.wrong_value(INVALID_REQUEST, "materials", f"more than {MOST_CANDIDATES}", allowed)
    if not found:
        detail = f"no material in question has a model fitted by {method!r}"
        raise Problem(NO_MODEL, detail, name="method", value=method, allowed="a method that was fitted")
    return found


def _samples(context: Context, wish: NewRecognition) -> "FrictionSamples | Moments":
    """What is known of the grasp; the moments of a stored one say all that is asked, whatever its length."""
    if wish.samples is not None:
        return _given(wish.samples)
    with context.database.read() as session:
        log = grasp_logs.get(session, wish.grasp_log or "")
    if log.samples is None:
        raise Problem(NOT_READY, f"job {log.job.id} is {log.job.status}; its results are not there")
    if log.samples.none_because is not None:
        raise Problem(INVALID_SAMPLES, log.samples.none_because)
    if log.samples.moments is not None:
        return estimators.Moments.from_bytes(log.samples.moments)
    return decode_samples(context.blobs.path(log.samples.samples_blob))


def _given(samples: SamplesIn) -> FrictionSamples:
    arrays: dict[str, Any] = {
        name: np.array(value, float) for name, value in samples if name not in {"element", "element_area"}
    }
    return FrictionSamples(**arrays, element=np.array(samples.element), element_area=samples.element_area)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
