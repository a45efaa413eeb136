"""Materials: all of them, and one."""

from collections.abc import Sequence
from functools import partial
from hashlib import sha256
from typing import Annotated, Any, Literal
from urllib.parse import quote

from fastapi import APIRouter, Query, Request, Response
from fastapi.params import Form
from fastapi.responses import RedirectResponse

from db.paging import Window
from db.records import LogFilter, Material, SampledLog, StoredModel
from db.repositories import detections, friction_models, grasp_logs, materials
from estimators.method_names import ModelMethod
from service.domain.errors import NoModel
from service.domain.materials import curate
from service.domain.resources.context import Context
from service.http.access import READ, UPLOAD, CurrentPrincipal
from service.http.conditional import KEEP_AND_ASK, is_one_of, unchanged
from service.http.dependencies import CurrentContext
from service.http.long_answers import LONG_ANSWER
from service.http.paging import Page
from service.http.schemas.common import CursorText
from service.http.schemas.grasp_logs import GraspLogOut
from service.http.schemas.materials import MaterialOut, NewMaterial
from service.report.wording import NEWEST_LOGS
from service.web import reports
from service.web.derived import derive
from service.web.forms import FormRoute, checked
from service.web.friction import coefficients, friction_at, listed, next_of, sections, usual_model
from service.web.grasp_effects import MOST_GRASPS, differing, draw_effects
from service.web.posterior import densities, pairs
from service.web.rendering import render
from service.web.samples import SampleFile, write_samples
from service.web.working_point import PageQuery, shown_at
from stiction_client import records

router = APIRouter(include_in_schema=False, route_class=FormRoute)

ON_A_PAGE = 50
LOGS_ON_A_PAGE = 25
NEWEST_VERSIONS = Window("id", descending=True, limit=20)


@router.get("/", dependencies=[READ])
def list_materials(
    context: CurrentContext,
    request: Request,
    search: Annotated[str, Query(max_length=100)] = "",
    sort: Literal["name", "-name", "created_at", "-created_at"] = "name",
    cursor: CursorText = None,
) -> Response:
    """Friction at normal force ``fn`` of all whose name has the search in it; a greeting where there is no material."""
    page = Page(sort, ON_A_PAGE, cursor)
    with context.database.read() as session:
        found, after = page.cut(materials.list_all(session, page.window(), search or None))
    if not found and not search and cursor is None:
        return render(request, "welcome.html")

    def show(at: PageQuery) -> dict[str, Any]:
        asked = {"search": search, "sort": sort, "fn": at.typed()["fn"]}
        return {"rows": [listed(each, at.fn) for each in found], "asked": asked}

    return shown_at(request, "materials.html", show, after=after, is_first=cursor is None)


@router.post("/materials", dependencies=[UPLOAD])
def create_material(
    context: CurrentContext,
    principal: CurrentPrincipal,
    name: Annotated[str, Form(max_length=200)] = "",
    description: Annotated[str, Form(max_length=20_000)] = "",
) -> Response:
    """Make a material known; raises as the API's route does."""
    new = checked(NewMaterial, {"name": name.strip(), "description": description.strip()})
    with context.database.write() as session:
        curate.create(session, context.settings, new.name, new.description, principal)
    return RedirectResponse(f"/materials/{quote(new.name, safe='')}", 303)


@router.get("/materials/{name}", dependencies=[READ])
def show_material(context: CurrentContext, request: Request, name: str, cursor: CursorText = None) -> Response:
    """Its model at a working point (``fn``, ``v``, ``method``), the versions before it, and its logs.

    Raises ``NotFound``.
    """
    page = Page("-created_at", LOGS_ON_A_PAGE, cursor, identity="hex")
    with context.database.read() as session:
        found = materials.get(session, name)
        logs, after = page.cut(grasp_logs.list_all(session, page.window(), LogFilter(material_id=found.id)))
        sampled = detections.newest_sampled_logs(session, found.id, MOST_GRASPS)[::-1]
    show = partial(_model_at, context, found, sampled)
    given = {"material": found, "has_samples": bool(sampled), "logs": logs, "after": after}
    return shown_at(request, "material.html", show, **given)


def _model_at(context: Context, found: Material, sampled: Sequence[SampledLog], at: PageQuery) -> dict[str, Any]:
    """What the page shows of its model, and of the versions before it."""
    with context.database.read() as session:
        versions = friction_models.versions(session, found.id, at.method, window=NEWEST_VERSIONS)
    stored = usual_model(found.models, at.method)
    shown = None if stored is None else friction_at(stored, at.fn, at.v or 0.0, found.models)
    effects = [] if stored is None else differing(stored, sampled)
    return {
        "stored": stored,
        "friction": shown,
        "coefficients": [] if stored is None else coefficients(stored),
        "next_grasp": None if stored is None or shown is None else next_of(stored, shown),
        "charts": [] if stored is None or shown is None else sections(stored, shown),
        "effects": effects,
        "effect_chart": draw_effects(effects) if effects else None,
        "densities": [] if stored is None else densities(stored),
        "pairs": [] if stored is None else pairs(stored),
        "asked": at.typed(),
        "versions": versions,
    }


@router.get("/materials/{name}/samples", dependencies=[READ, LONG_ANSWER])
async def read_samples(
    context: CurrentContext,
    request: Request,
    principal: CurrentPrincipal,
    name: str,
    method: ModelMethod | None = None,
) -> Response:
    """The newest logs' samples beside the model (``service.web.samples``); raises ``NotFound``, ``NoModel``."""
    model, logs = await context.threads.run(principal.share, _sampled, context, name, method)
    blobs = [log.samples.samples_blob for log in logs]
    tag = f'"{sha256(" ".join([str(model.id), *blobs]).encode()).hexdigest()[:32]}"'
    if is_one_of(tag, request.headers.get("if-none-match", "")):
        return unchanged(tag)
    paths = await context.files(principal.share, blobs)
    files = [SampleFile(path, log.grid) for path, log in zip(paths, logs, strict=True)]
    headers = {"ETag": tag, "Cache-Control": KEEP_AND_ASK}
    write = partial(write_samples, model.model, files)
    return await derive(context, principal, "stored", write, headers=headers, media_type="application/octet-stream")


def _sampled(context: Context, name: str, method: str | None) -> tuple[StoredModel, list[SampledLog]]:
    """The model that is shown, and the logs whose samples stand beside it, newest first."""
    with context.database.read() as session:
        found = materials.get(session, name)
        logs = detections.newest_sampled_logs(session, found.id, MOST_GRASPS)
    model = usual_model(found.models, method)
    if model is None or not logs:
        raise NoModel(f"{name} has no model with samples", method or "any")
    return model, logs


@router.get("/materials/{name}/report", dependencies=[READ, LONG_ANSWER])
async def read_report(context: CurrentContext, principal: CurrentPrincipal, name: str) -> Response:
    """The material's report, as one file; raises ``NotFound``."""
    write = await context.threads.run(principal.share, _report_of, context, name)
    return await reports.show(context, principal, "stored", write)


def _report_of(context: Context, name: str) -> partial[None]:
    """What writes the report, of the records that a client would have."""
    newest = Window("created_at", descending=True, limit=NEWEST_LOGS)
    with context.database.read() as session:
        found = materials.get(session, name)
        logs = grasp_logs.list_all(session, newest, LogFilter(material_id=found.id))
    stored = usual_model(found.models)
    probe = None if stored is None else next_of(stored, friction_at(stored, None))
    receipts = [records.GraspLogReceipt.from_json(GraspLogOut.of(log).model_dump(mode="json")) for log in logs]
    material = records.Material.from_json(MaterialOut.of(found).model_dump(mode="json"))
    return partial(reports.write_material, material, receipts, probe)
