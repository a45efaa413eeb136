"""Errors as RFC 9457 problem details: one stable type a kind of problem (docs/problems.md)."""

import asyncio
import logging
from collections.abc import Mapping
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException
from starlette.routing import Match, Router

from db.errors import AlreadyExists, BlobDamaged, NotFound, StorageUnavailable
from service.domain.damage import record_damage
from service.processes.turns import Crowded

logger = logging.getLogger(__name__)

MEDIA_TYPE = "application/problem+json"
CROWD_SECONDS = "5"
"""s, as text, after which a file may find room to be read; most take less."""

LONGEST_VALUE = 200
"""Characters of an offending value that an answer repeats."""


@dataclass(frozen=True, slots=True)
class ProblemType:
    """A kind of problem: the last part of its URI, its title and its status."""

    name: str
    title: str
    status: int

    @property
    def uri(self) -> str:
        """What stands in ``type``: it never changes."""
        return f"/problems/{self.name}"


BAD_REQUEST = ProblemType("bad-request", "The request cannot be understood", 400)
UPLOAD_INTERRUPTED = ProblemType("upload-interrupted", "The upload broke off", 400)
KEY_REQUIRED = ProblemType("key-required", "An access key is needed", 401)
INVALID_KEY = ProblemType("invalid-key", "The access key is not valid", 401)
INSUFFICIENT_SCOPE = ProblemType("insufficient-scope", "The access key does not allow this", 403)
CROSS_SITE_REQUEST = ProblemType("cross-site-request", "The request is of another site's page", 403)
NOT_OWNER = ProblemType("not-owner", "The material is another's", 403)
UNKNOWN_ROUTE = ProblemType("unknown-route", "No such route", 404)
UNKNOWN_MATERIAL = ProblemType("unknown-material", "No such material", 404)
UNKNOWN_ALIAS = ProblemType("unknown-alias", "No such alias", 404)
UNKNOWN_OWNER = ProblemType("unknown-owner", "No such owner", 404)
UNKNOWN_GRASP_LOG = ProblemType("unknown-grasp-log", "No such grasp log", 404)
UNKNOWN_JOB = ProblemType("unknown-job", "No such job", 404)
METHOD_NOT_ALLOWED = ProblemType("method-not-allowed", "The route does not take this method", 405)
MATERIAL_EXISTS = ProblemType("material-exists", "The material exists already", 409)
NO_MODEL = ProblemType("no-model", "The material has no fitted model yet", 409)
NO_FEASIBLE_FORCE = ProblemType("no-feasible-force", "No normal force holds the load", 409)
JOB_ENDED = ProblemType("job-ended", "The job has ended", 409)
NOT_READY = ProblemType("not-ready", "The job has not got there", 409)
FILE_DELETED = ProblemType("file-deleted", "The upload was deleted", 410)
REQUEST_TIMEOUT = ProblemType("request-timeout", "The request came too slowly", 408)
MISDIRECTED_REQUEST = ProblemType("misdirected-request", "The request is for another host", 421)
UPLOAD_TOO_LARGE = ProblemType("upload-too-large", "The body is too large", 413)
UNSUPPORTED_FORMAT = ProblemType("unsupported-format", "The format is not supported", 415)
INVALID_GRASP_LOG = ProblemType("invalid-grasp-log", "The grasp log is not valid", 422)
INVALID_SAMPLES = ProblemType("invalid-samples", "The samples tell nothing", 422)
INVALID_REQUEST = ProblemType("invalid-request", "A value in the request is not allowed", 422)
IDEMPOTENCY_KEY_REUSED = ProblemType("idempotency-key-reused", "The key stands for another request", 422)
TOO_MANY_REQUESTS = ProblemType("too-many-requests", "Requests come too often", 429)
QUOTA_EXCEEDED = ProblemType("quota-exceeded", "The key has asked for as much as it may", 429)
HEADERS_TOO_LARGE = ProblemType("headers-too-large", "The headers are too large", 431)
FILE_DAMAGED = ProblemType("file-damaged", "A stored file is damaged", 500)
INTERNAL_ERROR = ProblemType("internal-error", "The service failed", 500)
TOO_MANY_CONNECTIONS = ProblemType("too-many-connections", "Too many connections", 503)
TOO_MANY_UPLOADS = ProblemType("too-many-uploads", "Too many files are being read", 503)
STOPPING = ProblemType("stopping", "The server stops", 503)
WORKERS_NOT_READY = ProblemType("workers-not-ready", "The workers take no jobs yet, or no longer", 503)
FILE_MISSING = ProblemType("file-missing", "A stored file is missing", 503)
STORAGE_QUOTA_EXCEEDED = ProblemType("storage-quota-exceeded", "The key has stored as much as it may", 507)
STORAGE_UNAVAILABLE = ProblemType("storage-unavailable", "Database or blob folder cannot be used now", 503)

PROBLEM_TYPES = {entry.name: entry for entry in list(globals().values()) if isinstance(entry, ProblemType)}

_UNKNOWN = {
    "material": UNKNOWN_MATERIAL,
    "alias": UNKNOWN_ALIAS,
    "grasp log": UNKNOWN_GRASP_LOG,
    "job": UNKNOWN_JOB,
    "blob": FILE_MISSING,
}
_BY_STATUS = {404: UNKNOWN_ROUTE, 405: METHOD_NOT_ALLOWED, 408: REQUEST_TIMEOUT, 413: UPLOAD_TOO_LARGE}


class Problem(Exception):
    """An answer other than the one that was asked for.

    ``name``, ``value`` and ``allowed`` say what was wrong, where one thing was; ``more`` are further members of
    the answer, ``headers`` its headers.
    """

    def __init__(
        self,
        kind: ProblemType,
        detail: str,
        *,
        name: str | None = None,
        value: object = None,
        allowed: str | None = None,
        headers: Mapping[str, str] | None = None,
        more: Mapping[str, object] | None = None,
    ) -> None:
        super().__init__(detail)
        self.kind, self.detail, self.headers, self.more = kind, detail, dict(headers or {}), dict(more or {})
        self.name, self.value, self.allowed = name, None if value is None else str(value), allowed

    @classmethod
    def wrong_value(cls, kind: ProblemType, name: str, value: object, allowed: str) -> "Problem":
        """One named thing has a value that is not allowed."""
        shown = str(value)[:LONGEST_VALUE].encode(errors="backslashreplace").decode()  # a lone surrogate is not UTF-8
        return cls(kind, f"{name} is {shown}; allowed: {allowed}", name=name, value=shown, allowed=allowed)


def install(app: FastAPI) -> None:
    """Let every error of the application be answered as problem details."""
    app.add_exception_handler(Problem, _on_problem)
    app.add_exception_handler(NotFound, _on_not_found)
    app.add_exception_handler(AlreadyExists, _on_already_exists)
    app.add_exception_handler(BlobDamaged, _on_blob_damaged)
    app.add_exception_handler(StorageUnavailable, _on_storage_unavailable)
    app.add_exception_handler(Crowded, _on_crowded)
    app.add_exception_handler(RequestValidationError, _on_invalid_request)
    app.add_exception_handler(HTTPException, _on_http_exception)


def storage_unavailable(error: StorageUnavailable) -> Problem:
    """That the stores cannot be used now, with the time to try again."""
    return Problem(STORAGE_UNAVAILABLE, str(error), headers={"Retry-After": "1"})


def stopping() -> Problem:
    """That the server stops before it is done with the request."""
    return Problem(STOPPING, "not done before the server stopped", headers={"Retry-After": "1"})


def answer(request: Request, problem: Problem) -> JSONResponse:
    """The problem as a response."""
    content: dict[str, Any] = {
        "type": problem.kind.uri,
        "title": problem.kind.title,
        "status": problem.kind.status,
        "detail": problem.detail,
        "instance": request.url.path,
        "request_id": getattr(request.state, "request_id", None),
    }
    if problem.name is not None:
        content |= {"name": problem.name, "value": problem.value, "allowed": problem.allowed}
    return JSONResponse(content | problem.more, problem.kind.status, problem.headers, MEDIA_TYPE)


def unexpected(request: Request, error: Exception) -> JSONResponse:
    """The answer to an error that nothing else answers; the log tells what it was, the client does not get to know."""
    logger.error("request failed", exc_info=error)
    return answer(request, Problem(INTERNAL_ERROR, "an unexpected error; the server's log has it"))


async def _on_problem(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, Problem)
    return answer(request, error)


async def _on_not_found(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, NotFound)
    kind = _UNKNOWN.get(error.kind, INTERNAL_ERROR)
    if kind in {INTERNAL_ERROR, FILE_MISSING}:
        logger.error("%s is referred to but missing", error.kind, exc_info=error)
    allowed = f"the name of a stored {error.kind}" if kind is not FILE_MISSING else "its copy from a backup, put back"
    return answer(request, Problem.wrong_value(kind, error.kind, error.name, allowed))


async def _on_already_exists(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, AlreadyExists)
    allowed = f"a name that no {error.kind} has yet"
    return answer(request, Problem.wrong_value(MATERIAL_EXISTS, "name", error.name, allowed))


async def _on_blob_damaged(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, BlobDamaged)
    found_by = f"{request.method} {request.url.path}"
    await asyncio.to_thread(record_damage, request.app.state.context.database, error, found_by)
    return answer(request, Problem(FILE_DAMAGED, f"{error}; allowed: a copy from a backup, or the same upload again"))


async def _on_storage_unavailable(request: Request, error: Exception) -> JSONResponse:
    logger.error("storage unavailable", exc_info=error)
    assert isinstance(error, StorageUnavailable)
    return answer(request, storage_unavailable(error))


async def _on_crowded(request: Request, error: Exception) -> JSONResponse:
    return answer(request, Problem(TOO_MANY_UPLOADS, str(error), headers={"Retry-After": CROWD_SECONDS}))


async def _on_invalid_request(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    wrong = [_wrong_value(entry) for entry in error.errors()]
    listed = [{"name": each.name, "value": each.value, "allowed": each.allowed} for each in wrong]
    wrong[0].more["errors"] = listed
    return answer(request, wrong[0])


def _wrong_value(entry: dict[str, Any]) -> Problem:
    if entry["type"] == "json_invalid":
        return Problem.wrong_value(INVALID_REQUEST, "body", f"not JSON ({entry['ctx']['error']})", "a JSON object")
    name = ".".join(str(part) for part in entry["loc"][1:]) or str(entry["loc"][0])
    if entry["type"] == "missing":
        return Problem.wrong_value(INVALID_REQUEST, name, "missing", "a value")
    allowed = entry["msg"].removeprefix("Input should be ").removeprefix("Value error, ")
    return Problem.wrong_value(INVALID_REQUEST, name, entry["input"], allowed)


async def _on_http_exception(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    kind = _BY_STATUS.get(error.status_code) or ProblemType(
        BAD_REQUEST.name, HTTPStatus(error.status_code).phrase, error.status_code
    )
    headers = dict(error.headers or {})
    if kind is METHOD_NOT_ALLOWED:
        headers["Allow"] = ", ".join(_allowed_methods(request))
    return answer(request, Problem(kind, f"{request.method} {request.url.path}: {error.detail}", headers=headers))


def _allowed_methods(request: Request) -> list[str]:
    """Methods that some route takes for this path: the framework names only those of the first route."""
    router: Router = request.app.router
    scopes = {method: {**request.scope, "method": method} for method in ("DELETE", "GET", "PATCH", "POST", "PUT")}
    taken = {
        method
        for method, scope in scopes.items()
        if any(route.matches(scope)[0] is Match.FULL for route in router.routes)
    }
    return sorted(taken | {"HEAD"} if "GET" in taken else taken)
