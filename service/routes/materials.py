"""Materials, their models and their friction."""

from typing import Annotated
from urllib.parse import quote

from fastapi import APIRouter, Query, Response

from db.repositories import friction_models, materials
from service.access import READ, UPLOAD
from service.context import Given
from service.idempotency import Answer, OnceGiven, answer_once
from service.problems import (
    IDEMPOTENCY_KEY_REUSED,
    INVALID_REQUEST,
    MATERIAL_EXISTS,
    NO_MODEL,
    STORAGE_UNAVAILABLE,
    UNKNOWN_MATERIAL,
    UNSUPPORTED_FORMAT,
    UPLOAD_TOO_LARGE,
)
from service.routes.common import JsonRoute, problems
from service.schemas import (
    FitMethod,
    FrictionModelOut,
    FrictionModelsOut,
    FrictionOut,
    JobOut,
    MaterialOut,
    MaterialsOut,
    NewFit,
    NewMaterial,
)
from service.use_cases.fit import request_fit
from service.use_cases.look_up import Question, look_up

router = APIRouter(prefix="/v1/materials", tags=["materials"], route_class=JsonRoute)

_BODY = (UPLOAD_TOO_LARGE, UNSUPPORTED_FORMAT, INVALID_REQUEST, IDEMPOTENCY_KEY_REUSED, STORAGE_UNAVAILABLE)

Finite = Query(allow_inf_nan=False, ge=0.0)

LARGEST_FORCE, LARGEST_VELOCITY = 1e4, 1e3
"""N on one element, as of an uploaded log, and m/s: beyond, a question is a mistake of units."""

SMALLEST_TAIL = 1e-12
"""As the planner's smallest slip probability; a Student-t quantile further out says nothing of friction."""


@router.post(
    "",
    dependencies=[UPLOAD],
    summary="Make a material known",
    status_code=201,
    response_model=MaterialOut,
    responses=problems(MATERIAL_EXISTS, *_BODY),
)
def create_material(context: Given, new: NewMaterial, once: OnceGiven) -> Response:
    """Logs can be uploaded for it from then on."""
    with context.database.write() as session:

        def create() -> Answer:
            made = MaterialOut.of(materials.create(session, new.name, new.description))
            return Answer(201, f"/v1/materials/{quote(new.name)}", made.model_dump(mode="json"))

        return answer_once(session, once, create).response()


@router.get("", dependencies=[READ], summary="List all materials", responses=problems(STORAGE_UNAVAILABLE))
def list_materials(context: Given) -> MaterialsOut:
    """By name, each with its current models."""
    with context.database.read() as session:
        return MaterialsOut(items=[MaterialOut.of(found) for found in materials.list_all(session)])


@router.get(
    "/{name}",
    dependencies=[READ],
    summary="Look at one material",
    responses=problems(UNKNOWN_MATERIAL, INVALID_REQUEST, STORAGE_UNAVAILABLE),
)
def read_material(context: Given, name: str) -> MaterialOut:
    """With the current model of each method."""
    with context.database.read() as session:
        return MaterialOut.of(materials.get(session, name))


@router.get(
    "/{name}/friction",
    dependencies=[READ],
    summary="Look up the friction coefficient",
    responses=problems(UNKNOWN_MATERIAL, NO_MODEL, INVALID_REQUEST, STORAGE_UNAVAILABLE),
)
def read_friction(
    context: Given,
    name: str,
    fn: Annotated[float, Finite, Query(le=LARGEST_FORCE, description="Normal force on an element, N", examples=[0.05])],
    v: Annotated[
        float, Finite, Query(le=LARGEST_VELOCITY, description="Tangential velocity, m/s", examples=[0.0])
    ] = 0.0,
    quantile: Annotated[
        float | None,
        Query(
            ge=SMALLEST_TAIL,
            le=1.0 - SMALLEST_TAIL,
            description="Of a new observation of μ; the mean without",
            examples=[0.05],
        ),
    ] = None,
    method: Annotated[FitMethod, Query(description="Whose current model answers")] = "ols",
) -> FrictionOut:
    """At a tangential velocity and a normal force: the mean, or a quantile that a cautious planner asks for.

    A quantile includes the scatter of μ and the uncertainty of the model.
    """
    return look_up(context, name, method, Question(v, fn, quantile))


@router.post(
    "/{name}/fits",
    dependencies=[UPLOAD],
    summary="Fit a material's model",
    status_code=202,
    response_model=JobOut,
    responses=problems(UNKNOWN_MATERIAL, *_BODY),
)
def create_fit(context: Given, name: str, wish: NewFit, once: OnceGiven) -> Response:
    """Over the samples of all its logs. Answers at once; the job at `Location` tells how it went."""
    return request_fit(context, name, wish.method, wish.seed, once).response()


@router.get(
    "/{name}/fits",
    dependencies=[READ],
    summary="List all versions of a material's models",
    responses=problems(UNKNOWN_MATERIAL, INVALID_REQUEST, STORAGE_UNAVAILABLE),
)
def list_fits(
    context: Given, name: str, method: Annotated[FitMethod | None, Query(description="Only those of it")] = None
) -> FrictionModelsOut:
    """Newest first."""
    with context.database.read() as session:
        found = friction_models.versions(session, materials.find_id(session, name), method)
    return FrictionModelsOut(items=[FrictionModelOut.of(stored) for stored in found])
