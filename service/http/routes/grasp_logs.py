"""Grasp logs and what was found in them."""

from functools import partial
from typing import Annotated, Any, TypeVar

from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import FileResponse

from db.records import LogFilter, StoredGraspLog
from db.repositories import grasp_logs, materials
from service import formats
from service.domain.errors import ResultsNotReady
from service.domain.logs.export import export
from service.domain.models.stored_results import (
    EVENT_KINDS,
    SAMPLE_ARRAYS,
    StoredHistory,
    decode_history,
    decode_samples,
)
from service.domain.resources.context import Context
from service.domain.uploads.accept import ReceivedLog, StoredUpload, accept
from service.domain.uploads.upload import UploadRequest, receive_digest, received, store
from service.formats import writing
from service.http.access import READ, UPLOAD, CurrentPrincipal
from service.http.bodies import chunks
from service.http.conditional import KEEP_AND_ASK, NOT_MODIFIED, is_one_of, unchanged
from service.http.dependencies import CurrentContext
from service.http.descriptions import problems
from service.http.download import Download, checked_within
from service.http.fair_route import FairRoute, gone
from service.http.idempotency import (
    EarlierResponse,
    IdempotencyKey,
    KeyWithoutBody,
    NothingDone,
    RepeatableResponse,
    find_earlier,
    respond_once,
)
from service.http.long_answers import LONG_ANSWER, Room
from service.http.long_json import long_json
from service.http.paging import Page, link_next
from service.http.problems import (
    FILE_DAMAGED,
    FILE_DELETED,
    IDEMPOTENCY_KEY_REUSED,
    INVALID_GRASP_LOG,
    INVALID_REQUEST,
    NOT_OWNER,
    NOT_READY,
    QUOTA_EXCEEDED,
    STORAGE_QUOTA_EXCEEDED,
    STORAGE_UNAVAILABLE,
    TOO_MANY_UPLOADS,
    UNKNOWN_GRASP_LOG,
    UNKNOWN_MATERIAL,
    UNSUPPORTED_FORMAT,
    UPLOAD_INTERRUPTED,
    UPLOAD_TOO_LARGE,
    Problem,
)
from service.http.schemas.grasp_logs import GraspLogOut, GraspLogsOut, GraspLogsQuery, UploadQuery
from service.http.schemas.results import EventsOut, SamplesOut, StickRatioOut

router = APIRouter(prefix="/v1/grasp-logs", tags=["grasp logs"], route_class=FairRoute)

Found = TypeVar("Found")

_BINARY = {"schema": {"type": "string", "format": "binary"}}
_BODY: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "description": "The file itself, as it is (docs/formats.md)",
        "content": dict.fromkeys((*formats.CONTENT_TYPES, *formats.UNSPECIFIC_TYPES), _BINARY),
    }
}
_ALREADY_THERE: dict[int | str, dict[str, Any]] = {
    200: {"model": GraspLogOut, "description": "The same content, material and detector is stored already"}
}
_FILE: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The log as a file",
        "content": {formats.FORMATS[name].content_type: _BINARY for name in writing.SUFFIXES},
    }
}
_FOUND = problems(UNKNOWN_GRASP_LOG, INVALID_REQUEST, STORAGE_UNAVAILABLE)
_RESULTS = problems(UNKNOWN_GRASP_LOG, NOT_READY, INVALID_REQUEST, FILE_DAMAGED, STORAGE_UNAVAILABLE, TOO_MANY_UPLOADS)


@router.post(
    "",
    dependencies=[UPLOAD],
    summary="Upload a grasp log",
    status_code=202,
    response_model=GraspLogOut,
    openapi_extra=_BODY,
    responses=_ALREADY_THERE
    | problems(
        UPLOAD_INTERRUPTED,
        NOT_OWNER,
        NOT_READY,
        UNKNOWN_MATERIAL,
        UPLOAD_TOO_LARGE,
        UNSUPPORTED_FORMAT,
        INVALID_GRASP_LOG,
        INVALID_REQUEST,
        IDEMPOTENCY_KEY_REUSED,
        STORAGE_UNAVAILABLE,
        TOO_MANY_UPLOADS,
        QUOTA_EXCEEDED,
        STORAGE_QUOTA_EXCEEDED,
    ),
)
async def create_grasp_log(
    context: CurrentContext,
    request: Request,
    key: KeyWithoutBody,
    principal: CurrentPrincipal,
    asked: Annotated[UploadQuery, Query()],
) -> Response:
    """Stored once it is answered; slip, samples and, with a material, its refit follow in the job.

    The body is streamed to disk, up to the largest size that is set; `Content-Encoding` may be gzip or zstd.
    """
    length = request.headers.get("content-length", "")
    wanted = UploadRequest(
        asked.material,
        asked.sensor or None,
        asked.detector,
        request.headers.get("content-type"),
        int(length) if length.isdecimal() else None,
        ",".join(request.headers.getlist("content-encoding")),
        {name: getattr(asked, name) for name in ("scale", "frame_rate", "mapping", "rest")},
        principal,
    )
    if key is not None and (earlier := await context.threads.run(principal.share, _find_earlier, context, key)):
        repeated = key.for_body(await receive_digest(context, chunks(request), wanted))
        return earlier.to(repeated).response()
    async with received(context, chunks(request), wanted, partial(gone, request)) as log:
        about = key and key.for_body(log.body_sha256)
        answer = await context.store_threads.run(principal.share, _store, context, log, about)
    return answer.response()


def _store(context: Context, log: ReceivedLog, key: IdempotencyKey | None) -> RepeatableResponse:
    return store(
        context, log, lambda session: respond_once(session, key, lambda: _answer(accept(session, context, log)))
    )


def _find_earlier(context: Context, key: IdempotencyKey) -> EarlierResponse | None:
    """A repetition is answered as before, whatever has become of the material's name meanwhile."""
    with context.database.read() as session:
        return find_earlier(session, key)


def _answer(stored: StoredUpload) -> RepeatableResponse:
    body = GraspLogOut.of(stored.log).model_dump(mode="json")
    kind = RepeatableResponse if stored.changes else NothingDone
    return kind(202 if stored.is_new else 200, f"/v1/grasp-logs/{stored.log.id}", body)


@router.get(
    "",
    dependencies=[READ],
    summary="List grasp logs",
    responses=problems(UNKNOWN_MATERIAL, INVALID_REQUEST, STORAGE_UNAVAILABLE),
)
def list_grasp_logs(
    context: CurrentContext,
    request: Request,
    response: Response,
    asked: Annotated[GraspLogsQuery, Query()],
) -> GraspLogsOut:
    """Each with its job and, once there, what was found in it."""
    page = Page(asked.sort, asked.limit, asked.cursor, identity="hex")
    with context.database.read() as session:
        material_id = None if asked.material is None else materials.find_id(session, asked.material)
        wanted = LogFilter(material_id, asked.sensor, asked.status, asked.withdrawn)
        found, after = page.cut(grasp_logs.list_all(session, page.window(), wanted))
    return GraspLogsOut(items=[GraspLogOut.of(each) for each in found], next=link_next(request, response, after))


@router.get("/{id}", dependencies=[READ], summary="Look at a grasp log", responses=_FOUND)
def read_grasp_log(context: CurrentContext, id: str) -> GraspLogOut:  # noqa: A002  (the path's own name)
    """With its job and, once there, what was found in it."""
    log = _find(context, id)
    if log.job.finished_at is not None:
        context.models.has_ended(context.database, log.job)
    return GraspLogOut.of(log)


@router.get(
    "/{id}/stick-ratio",
    dependencies=[READ, LONG_ANSWER],
    summary="Look at the stick ratio over time",
    response_model=StickRatioOut,
    responses=_RESULTS,
)
def read_stick_ratio(context: CurrentContext, id: str) -> Response:  # noqa: A002
    """One value a frame."""
    history = _history(context, id)
    return long_json({"time": history.time, "stick_ratio": history.stick_ratio})


@router.get(
    "/{id}/events",
    dependencies=[READ, LONG_ANSWER],
    summary="Look at slip and contact events",
    response_model=EventsOut,
    responses=_RESULTS,
)
def read_events(context: CurrentContext, id: str) -> Response:  # noqa: A002
    """Of each element."""
    events = _history(context, id).events
    of_kind = {kind: getattr(events, kind) for kind in EVENT_KINDS}
    return long_json({kind: {"element": found.element, "time": found.time} for kind, found in of_kind.items()})


@router.get(
    "/{id}/samples",
    dependencies=[READ, LONG_ANSWER],
    summary="Look at the friction samples",
    response_model=SamplesOut,
    responses=_RESULTS,
)
def read_samples(context: CurrentContext, id: str) -> Response:  # noqa: A002
    """One entry an element and frame; empty where no slip gave one."""
    log = _find(context, id)
    samples = decode_samples(context.blobs.path(_ready(log.samples, log).samples_blob))
    arrays = {name: getattr(samples, name) for name in SAMPLE_ARRAYS}
    return long_json({**arrays, "element_area": samples.element_area})


@router.get(
    "/{id}/file",
    dependencies=[READ],
    summary="Download a grasp log",
    response_class=FileResponse,
    responses=_FILE
    | NOT_MODIFIED
    | problems(
        UNKNOWN_GRASP_LOG,
        FILE_DELETED,
        UNSUPPORTED_FORMAT,
        INVALID_REQUEST,
        FILE_DAMAGED,
        STORAGE_UNAVAILABLE,
        TOO_MANY_UPLOADS,
    ),
)
async def read_file(
    context: CurrentContext,
    request: Request,
    principal: CurrentPrincipal,
    room: Room,
    id: str,  # noqa: A002
    format: Annotated[  # noqa: A002
        str, Query(description="Of the file", json_schema_extra={"enum": list(writing.SUFFIXES)})
    ] = "npz",
) -> Response:
    """As it was uploaded, or as NPZ, Parquet or MCAP made of it: each is read back bit for bit.

    `ETag` and `If-None-Match` save the answer to who has it, and `If-Range` goes on with one that broke off.
    """
    if format not in writing.SUFFIXES:
        raise Problem.wrong_value(INVALID_REQUEST, "format", format, ", ".join(writing.SUFFIXES))
    share, within = principal.share, checked_within(request)
    log = await context.threads.run(share, _find, context, id)
    file = await export(context, log, format, share, room, within)
    tag = f'"{file.sha256}"'
    if is_one_of(tag, request.headers.get("if-none-match", "")):
        file.close.close()
        return unchanged(tag)
    return Download(
        file.path,
        file.close.close,
        headers={"ETag": tag, "Cache-Control": KEEP_AND_ASK},
        media_type=formats.FORMATS[format].content_type,
        filename=f"{id}{writing.SUFFIXES[format]}",
    )


def _find(context: Context, log_id: str) -> StoredGraspLog:
    with context.database.read() as session:
        return grasp_logs.get(session, log_id)


def _history(context: Context, log_id: str) -> StoredHistory:
    """What was found over time, without the maps of all elements and frames."""
    log = _find(context, log_id)
    return decode_history(context.blobs.path(_ready(log.detection, log).history_blob), with_maps=False)


def _ready(found: Found | None, log: StoredGraspLog) -> Found:
    if found is None:
        raise ResultsNotReady(log.job.id, log.job.status)
    return found
