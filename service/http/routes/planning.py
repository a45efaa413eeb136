"""What a planner asks beyond a look-up: which material this is, how hard to grip. Questions, though sent by POST."""

from dataclasses import asdict
from typing import Any

import numpy as np
from fastapi import APIRouter

from service.domain.planning import plan
from service.http.access import READ
from service.http.bodies import LongJsonRoute
from service.http.dependencies import CurrentContext
from service.http.descriptions import problems
from service.http.problems import (
    INVALID_REQUEST,
    INVALID_SAMPLES,
    NO_FEASIBLE_FORCE,
    NO_MODEL,
    NOT_READY,
    STORAGE_UNAVAILABLE,
    UNKNOWN_GRASP_LOG,
    UNKNOWN_MATERIAL,
    UNSUPPORTED_FORMAT,
    UPLOAD_TOO_LARGE,
)
from service.http.schemas.planning import GraspForceOut, NewGraspForce, NewRecognition, RecognitionOut, SamplesIn
from slipcore.samples import KIND, FrictionSamples

router = APIRouter(prefix="/v1", tags=["planning"], route_class=LongJsonRoute)

_ALWAYS = (UNKNOWN_MATERIAL, NO_MODEL, UPLOAD_TOO_LARGE, UNSUPPORTED_FORMAT, INVALID_REQUEST, STORAGE_UNAVAILABLE)


@router.post(
    "/grasp-force",
    dependencies=[READ],
    summary="Ask how hard to grip",
    responses=problems(NO_FEASIBLE_FORCE, *_ALWAYS),
)
def find_grasp_force(context: CurrentContext, asked: NewGraspForce) -> GraspForceOut:
    """The smallest normal force at which a contact that bears the load slips no more often than accepted.

    The model's uncertainty is in it. A planner that asks often gets the model once and evaluates it by itself.
    """
    return GraspForceOut.model_validate(asdict(plan.grasp_force(context, asked.task())))


@router.post(
    "/recognise",
    dependencies=[READ],
    summary="Ask which material this is",
    responses=problems(UNKNOWN_GRASP_LOG, NOT_READY, INVALID_SAMPLES, *_ALWAYS),
)
def recognise_material(context: CurrentContext, asked: NewRecognition) -> RecognitionOut:
    """From the friction samples of one grasp: a stored log's, or those that are sent.

    "unknown" is the probability that it is none of the materials compared.
    """
    grasp = asked.grasp_log or "" if asked.samples is None else _samples(asked.samples)
    found = plan.recognise(context, grasp, asked.materials, asked.method, asked.unknown, asked.sensor)
    return RecognitionOut.model_validate({"method": asked.method, **asdict(found)})


def _samples(given: SamplesIn) -> FrictionSamples:
    arrays: dict[str, Any] = {
        name: np.array(value, float)
        for name, value in given
        if name not in {"element", "element_area", "kind", "velocity_is_relative"}
    }
    return FrictionSamples(
        **arrays,
        element=np.array(given.element),
        element_area=given.element_area,
        kind=np.array(given.kind or [], KIND),
        velocity_is_relative=np.array(given.velocity_is_relative or [], bool),
    )
