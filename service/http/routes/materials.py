"""Materials, their models and their friction."""

from dataclasses import asdict
from typing import Annotated, Literal
from urllib.parse import quote

from fastapi import APIRouter, Query, Request, Response

from db.repositories import friction_models, materials
from estimators.method_names import ModelMethod
from service.domain.materials import curate
from service.domain.materials.fit import request_fit
from service.domain.planning.look_up import look_up
from service.domain.planning.record_next import record_next
from service.http.access import READ, UPLOAD, CurrentPrincipal
from service.http.bodies import JsonRoute
from service.http.conditional import NOT_MODIFIED, conditional, tagged
from service.http.dependencies import CurrentContext
from service.http.descriptions import problems
from service.http.idempotency import KeyWithBody, RepeatableResponse, respond_once
from service.http.paging import Page, link_next
from service.http.problems import (
    IDEMPOTENCY_KEY_REUSED,
    INVALID_REQUEST,
    MATERIAL_EXISTS,
    NO_MODEL,
    NOT_OWNER,
    QUOTA_EXCEEDED,
    STORAGE_UNAVAILABLE,
    UNKNOWN_MATERIAL,
    UNSUPPORTED_FORMAT,
    UPLOAD_TOO_LARGE,
)
from service.http.schemas.common import USUAL, CursorText, Limit
from service.http.schemas.jobs import JobOut
from service.http.schemas.materials import MaterialOut, MaterialsOut, NewMaterial
from service.http.schemas.models import (
    FrictionModelOut,
    FrictionModelsOut,
    FrictionOut,
    LookUpQuery,
    NewFit,
    NextGraspOut,
    NextGraspQuery,
)

router = APIRouter(prefix="/v1/materials", tags=["materials"], route_class=JsonRoute)

_BODY = (UPLOAD_TOO_LARGE, UNSUPPORTED_FORMAT, INVALID_REQUEST, IDEMPOTENCY_KEY_REUSED, STORAGE_UNAVAILABLE)


@router.post(
    "",
    dependencies=[UPLOAD],
    summary="Make a material known",
    status_code=201,
    response_model=MaterialOut,
    responses=problems(MATERIAL_EXISTS, QUOTA_EXCEEDED, *_BODY),
)
def create_material(
    context: CurrentContext, new: NewMaterial, key: KeyWithBody, principal: CurrentPrincipal
) -> Response:
    """Logs can be uploaded for it from then on. It belongs to the key that is sent, and to its group."""
    with context.database.write() as session:

        def create() -> RepeatableResponse:
            made = MaterialOut.of(curate.create(session, context.settings, new.name, new.description, principal))
            return RepeatableResponse(201, f"/v1/materials/{quote(new.name)}", made.model_dump(mode="json"))

        return respond_once(session, key, create).response()


@router.get(
    "",
    dependencies=[READ],
    summary="List materials",
    responses=problems(INVALID_REQUEST, STORAGE_UNAVAILABLE),
)
def list_materials(
    context: CurrentContext,
    request: Request,
    response: Response,
    search: Annotated[str | None, Query(max_length=100, description="Part of a name or an alias")] = None,
    sort: Annotated[
        Literal["name", "-name", "created_at", "-created_at"], Query(description="By what; `-` for the last ones first")
    ] = "name",
    limit: Limit = USUAL,
    cursor: CursorText = None,
) -> MaterialsOut:
    """Each with its current models."""
    page = Page(sort, limit, cursor)
    with context.database.read() as session:
        found, after = page.cut(materials.list_all(session, page.window(), search))
    return MaterialsOut(items=[MaterialOut.of(each) for each in found], next=link_next(request, response, after))


@router.get(
    "/{name}",
    dependencies=[READ],
    summary="Look at one material",
    response_model=MaterialOut,
    responses=NOT_MODIFIED | problems(UNKNOWN_MATERIAL, INVALID_REQUEST, STORAGE_UNAVAILABLE),
)
def read_material(context: CurrentContext, request: Request, name: str) -> Response:
    """With the current model of each method. `ETag` and `If-None-Match` save the answer to who has it."""
    with context.database.read() as session:
        found = materials.get(session, name)
    context.models.seen((found.id, found.name), *((model.id, model.outdated) for model in found.models))
    return tagged(request, MaterialOut.of(found).model_dump_json())


@router.get(
    "/{name}/friction",
    dependencies=[READ],
    summary="Look up the friction coefficient",
    response_model=FrictionOut,
    responses=NOT_MODIFIED | problems(UNKNOWN_MATERIAL, NO_MODEL, INVALID_REQUEST, STORAGE_UNAVAILABLE),
)
async def read_friction(
    context: CurrentContext,
    request: Request,
    name: str,
    asked: Annotated[LookUpQuery, Query()],
) -> Response:
    """At a tangential velocity and a normal force: the mean, or a quantile that a cautious planner asks for.

    A quantile includes the scatter of μ and the uncertainty of the model. `ETag` and `If-None-Match` save the answer to
    who has it.
    """
    known = await context.models.get(context.database, name, asked.method)
    return conditional(request, known.tag, lambda: FrictionOut.json_of(look_up(known, asked.question())))


@router.get(
    "/{name}/next-grasp",
    dependencies=[READ],
    summary="Ask what to record next",
    responses=problems(UNKNOWN_MATERIAL, NO_MODEL, INVALID_REQUEST, STORAGE_UNAVAILABLE),
)
def read_next_grasp(context: CurrentContext, name: str, asked: Annotated[NextGraspQuery, Query()]) -> NextGraspOut:
    """The grasp that most narrows friction at the planner's working point, per second of robot time."""
    known = context.models.read(context.database, name, asked.method)
    at = (asked.fn, asked.v, asked.quantile, asked.elements)
    found = record_next(known.stored, *at, asked.load, asked.drop_probability, asked.sensor)
    return NextGraspOut.model_validate(asdict(found))


@router.post(
    "/{name}/fits",
    dependencies=[UPLOAD],
    summary="Fit a material's model",
    status_code=202,
    response_model=JobOut,
    responses=problems(NOT_OWNER, UNKNOWN_MATERIAL, QUOTA_EXCEEDED, *_BODY),
)
def create_fit(
    context: CurrentContext, name: str, new: NewFit, key: KeyWithBody, principal: CurrentPrincipal
) -> Response:
    """Over the samples of all its logs. Answers at once; the job at `Location` shows how it went."""
    with context.queueing() as session:

        def create() -> RepeatableResponse:
            job = request_fit(session, context.settings, name, new.method, new.seed, principal)
            return RepeatableResponse(202, f"/v1/jobs/{job.id}", JobOut.of(job).model_dump(mode="json"))

        return respond_once(session, key, create).response()


@router.get(
    "/{name}/fits",
    dependencies=[READ],
    summary="List versions of a material's models",
    responses=problems(UNKNOWN_MATERIAL, INVALID_REQUEST, STORAGE_UNAVAILABLE),
)
def list_fits(
    context: CurrentContext,
    request: Request,
    response: Response,
    name: str,
    method: Annotated[ModelMethod | None, Query(description="Only those of it")] = None,
    current: Annotated[bool | None, Query(description="Only those that are current, or are not")] = None,
    limit: Limit = USUAL,
    cursor: CursorText = None,
) -> FrictionModelsOut:
    """Newest first."""
    page = Page("-id", limit, cursor)
    with context.database.read() as session:
        material_id = materials.find_id(session, name)
        versions = friction_models.versions(session, material_id, method, current=current, window=page.window())
        found, after = page.cut(versions)
    if found:
        context.models.seen((found[0].id, found[0].outdated))
    return FrictionModelsOut(
        items=[FrictionModelOut.of(each) for each in found], next=link_next(request, response, after)
    )
