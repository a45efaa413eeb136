"""Upload a grasp log by a form."""

from collections.abc import AsyncIterator
from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.responses import RedirectResponse
from pydantic import BaseModel, ConfigDict, Field
from starlette.datastructures import FormData, UploadFile

from db.blobs import disk_errors_named
from service import formats
from service.domain.access.principal import Principal
from service.domain.resources.context import Context
from service.domain.resources.receive import CHUNK_BYTES
from service.domain.uploads.upload import UploadRequest, upload
from service.formats.tracked_markers import FRAME_RATE, SCALE
from service.http.access import READ, UPLOAD, CurrentPrincipal
from service.http.bodies import limited
from service.http.dependencies import CurrentContext
from service.http.fair_route import FairRoute
from service.http.problems import INVALID_REQUEST, Problem
from service.http.schemas.materials import NewMaterial
from service.web.forms import checked, read_form
from service.web.materials import names
from service.web.rendering import on_problem, render
from slipcore.defaults import METHOD_NAMES

router = APIRouter(include_in_schema=False, route_class=FairRoute)

BESIDE_THE_FILE = 2**20
"""Bytes of a form that are not its file: fields, and what stands between them."""


EXAMPLE_OF_A_MAPPING = """{"time": "time", "element": "marker", "grid": [8, 8], "pitch": 0.001,
 "displacement": {"field": ["dx", "dy"], "unit": "mm"},
 "force": {"field": ["fx", "fy", "fz"], "unit": "N"}}"""
"""Of a table with a row for each marker and frame."""


class NewUpload(BaseModel):
    """What the form says beside the file; what was left empty is None."""

    model_config = ConfigDict(extra="forbid")

    material: str | None = None
    create: bool = False
    sensor: str | None = None
    detector: str | None = None
    format: str = formats.UNSPECIFIC_TYPES[1]
    scale: float | None = Field(default=None, ge=SCALE[0], le=SCALE[1])
    frame_rate: float | None = Field(default=None, ge=FRAME_RATE[0], le=FRAME_RATE[1])
    mapping: str | None = None
    rest: str | None = None


@router.get("/upload", dependencies=[READ])
def show_upload(context: CurrentContext, request: Request, material: str = "") -> Response:
    """The form."""
    return render(request, "upload.html", **_form(context, {"material": material}), problem=None)


@router.post("/upload", dependencies=[UPLOAD])
async def receive_upload(context: CurrentContext, request: Request, principal: CurrentPrincipal) -> Response:
    """Store the file with its job, and lead to the log; raises as the API's route does."""
    on_problem(request, "upload.html", **await context.threads.run(principal.share, _form, context, {}))
    most = context.settings.max_upload_bytes + BESIDE_THE_FILE
    bounded = Request(request.scope, limited(request.receive, most))
    with disk_errors_named():
        form = await read_form(bounded, context.blobs.unnamed_file, max_files=1, max_fields=len(NewUpload.model_fields))
    try:
        fields = {name: text.strip() for name, text in form.items() if isinstance(text, str)}
        on_problem(request, "upload.html", **await context.threads.run(principal.share, _form, context, fields))
        file, wanted = _file(form), checked(NewUpload, fields)
        stored = await upload(context, _chunks(file), _asked(wanted, file, principal))
    finally:
        await form.close()
    return RedirectResponse(f"/logs/{stored.log.id}", 303)


def _form(context: Context, fields: dict[str, str]) -> dict[str, Any]:
    """What the template needs beside a problem."""
    choices = {"names": names(context), "formats": formats.FORMATS, "detectors": METHOD_NAMES}
    return {"fields": fields, **choices, "example_of_a_mapping": EXAMPLE_OF_A_MAPPING}


def _file(form: FormData) -> UploadFile:
    file = form.get("file")
    if not isinstance(file, UploadFile) or not file.size:
        raise Problem.wrong_value(INVALID_REQUEST, "file", "missing or empty", "the file of a grasp log")
    return file


def _asked(wanted: NewUpload, file: UploadFile, principal: Principal) -> UploadRequest:
    """The upload; raises ``RequestValidationError`` for a new material with a name that none may have."""
    settings = {name: getattr(wanted, name) for name in ("scale", "frame_rate", "mapping", "rest")}
    declared = (wanted.material, wanted.sensor or None, wanted.detector, wanted.format)
    creates = wanted.create and wanted.material is not None
    if creates:
        checked(NewMaterial, {"name": wanted.material or ""})
    return UploadRequest(*declared, file.size, settings=settings, principal=principal, creates_material=creates)


async def _chunks(file: UploadFile) -> AsyncIterator[bytes]:
    while chunk := await file.read(CHUNK_BYTES):
        yield chunk
