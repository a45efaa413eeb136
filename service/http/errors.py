"""Which problem each error is answered by: those of the use cases, of the stores and of the framework."""

import asyncio
import json
import logging
import re
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException
from starlette.routing import Match, Router

from db.errors import AlreadyExists, BlobDamaged, NotFound, StorageUnavailable
from service.domain import errors
from service.domain.errors import DomainError, InsufficientScope
from service.domain.logs.damage import record_damage
from service.http.access import CHALLENGE_OF_INVALID_KEY, challenge_of_scope
from service.http.fair_route import FairRoute
from service.http.idempotency import KEY_PATTERN, KEY_RULE
from service.http.problems import (
    BAD_REQUEST,
    FILE_DAMAGED,
    FILE_DELETED,
    FILE_MISSING,
    INSUFFICIENT_SCOPE,
    INTERNAL_ERROR,
    INVALID_GRASP_LOG,
    INVALID_KEY,
    INVALID_REQUEST,
    INVALID_SAMPLES,
    JOB_ENDED,
    MATERIAL_EXISTS,
    METHOD_NOT_ALLOWED,
    NO_FEASIBLE_FORCE,
    NO_MODEL,
    NOT_OWNER,
    NOT_READY,
    QUOTA_EXCEEDED,
    REQUEST_TIMEOUT,
    STORAGE_QUOTA_EXCEEDED,
    TOO_MANY_UPLOADS,
    UNKNOWN_ALIAS,
    UNKNOWN_CALIBRATION,
    UNKNOWN_GRASP_LOG,
    UNKNOWN_JOB,
    UNKNOWN_MATERIAL,
    UNKNOWN_OWNER,
    UNKNOWN_ROUTE,
    UNKNOWN_SENSOR,
    UNSUPPORTED_FORMAT,
    UPLOAD_INTERRUPTED,
    UPLOAD_TOO_LARGE,
    Problem,
    ProblemType,
    problem_response,
    storage_unavailable,
)
from service.http.schemas.common import NAME_PATTERN, NAME_RULE
from service.http.schemas.owners import OWNER_PATTERN, OWNER_RULE
from service.processes.fair_queue import QueueFull
from service.ranges import range_at

logger = logging.getLogger(__name__)

MOST_TOLD = 20
"""Values of one request that are told to be wrong."""

QUEUE_FULL_SECONDS = "5"
"""s, as text, after which a file may find room to be read; most take less."""

OF_USE_CASES: Mapping[type[DomainError], ProblemType] = {
    errors.InvalidValue: INVALID_REQUEST,
    errors.UnsupportedFormat: UNSUPPORTED_FORMAT,
    errors.InvalidGraspLog: INVALID_GRASP_LOG,
    errors.TooLarge: UPLOAD_TOO_LARGE,
    errors.UnknownOwner: UNKNOWN_OWNER,
    errors.StorageQuotaExceeded: STORAGE_QUOTA_EXCEEDED,
    errors.QuotaExceeded: QUOTA_EXCEEDED,
    errors.InsufficientScope: INSUFFICIENT_SCOPE,
    errors.KeyEnded: INVALID_KEY,
    errors.NotOwner: NOT_OWNER,
    errors.UploadInterrupted: UPLOAD_INTERRUPTED,
    errors.FileDeleted: FILE_DELETED,
    errors.NoModel: NO_MODEL,
    errors.NoFeasibleForce: NO_FEASIBLE_FORCE,
    errors.InvalidSamples: INVALID_SAMPLES,
    errors.ResultsNotReady: NOT_READY,
    errors.JobEnded: JOB_ENDED,
}
"""The problem type of every error of a use case."""

RULE_OF_PATTERN = {NAME_PATTERN: NAME_RULE, OWNER_PATTERN: OWNER_RULE, KEY_PATTERN: KEY_RULE}
"""What text is to be, in words."""

WORDS_OF_KIND = {
    "extra_forbidden": "no field of this name",
    "model_attributes_type": "a JSON object",
    "string_type": "text",
    "list_type": "a list",
    "too_short": "{min_length} or more of them",
    "too_long": "at most {max_length} of them",
    "string_too_short": "text of at least {min_length} character(s)",
    "string_too_long": "text of at most {max_length} characters",
}
"""Of an error of the framework's, by its type."""

BOUNDS = frozenset({"greater_than", "greater_than_equal", "less_than", "less_than_equal"})
"""Types of the framework's errors that NaN has, too, which is not to be taken for a number beyond a bound."""

OF_NUMBERS = BOUNDS | {
    *("float_parsing", "float_type", "finite_number"),
    *("int_parsing", "int_parsing_size", "int_type", "int_from_float"),
}
"""Types of its errors about what is to be a number; it tells the bound that was passed, and not the other."""

_UNKNOWN = {
    "material": UNKNOWN_MATERIAL,
    "alias": UNKNOWN_ALIAS,
    "grasp log": UNKNOWN_GRASP_LOG,
    "job": UNKNOWN_JOB,
    "sensor": UNKNOWN_SENSOR,
    "calibration": UNKNOWN_CALIBRATION,
    "blob": FILE_MISSING,
}
_BY_STATUS = {404: UNKNOWN_ROUTE, 405: METHOD_NOT_ALLOWED, 408: REQUEST_TIMEOUT, 413: UPLOAD_TOO_LARGE}


def install(app: FastAPI) -> None:
    """Let every error of the application be answered as problem details."""
    app.add_exception_handler(Problem, _on_problem)
    app.add_exception_handler(DomainError, _on_domain_error)
    app.add_exception_handler(NotFound, _on_not_found)
    app.add_exception_handler(AlreadyExists, _on_already_exists)
    app.add_exception_handler(BlobDamaged, _on_blob_damaged)
    app.add_exception_handler(StorageUnavailable, _on_storage_unavailable)
    app.add_exception_handler(QueueFull, _on_queue_full)
    app.add_exception_handler(RequestValidationError, _on_invalid_request)
    app.add_exception_handler(HTTPException, _on_http_exception)


def problem_of(error: DomainError) -> Problem:
    """The error of a use case as it is answered."""
    headers = {}
    if error.retry_seconds is not None:
        headers["Retry-After"] = str(error.retry_seconds)
    if isinstance(error, InsufficientScope):
        headers["WWW-Authenticate"] = challenge_of_scope(error.needed)
    if isinstance(error, errors.KeyEnded):
        headers["WWW-Authenticate"] = CHALLENGE_OF_INVALID_KEY
    about = {"name": error.name, "value": error.value, "allowed": error.allowed}
    return Problem(OF_USE_CASES[type(error)], str(error), **about, headers=headers, more=error.facts)


async def _on_problem(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, Problem)
    return problem_response(request, error)


async def _on_domain_error(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, DomainError)
    return problem_response(request, problem_of(error))


async def _on_not_found(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, NotFound)
    kind = _UNKNOWN.get(error.kind, INTERNAL_ERROR)
    if kind in {INTERNAL_ERROR, FILE_MISSING}:
        logger.error("%s is referred to but missing", error.kind, exc_info=error)
    known_by = {UNKNOWN_GRASP_LOG: "id", UNKNOWN_JOB: "id", UNKNOWN_CALIBRATION: "version"}.get(kind, "name")
    allowed = "its copy from a backup, put back" if kind is FILE_MISSING else f"the {known_by} of a stored {error.kind}"
    return problem_response(request, Problem.wrong_value(kind, error.kind, error.name, allowed))


async def _on_already_exists(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, AlreadyExists)
    allowed = f"a name that no {error.kind} has yet"
    return problem_response(request, Problem.wrong_value(MATERIAL_EXISTS, "name", error.name, allowed))


async def _on_blob_damaged(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, BlobDamaged)
    found_by = f"{request.method} {request.url.path}"
    await asyncio.to_thread(record_damage, request.app.state.context.database, error, found_by)
    return problem_response(
        request, Problem(FILE_DAMAGED, f"{error}; allowed: a copy from a backup, or the same upload again")
    )


async def _on_storage_unavailable(request: Request, error: Exception) -> JSONResponse:
    seen = error if logger.isEnabledFor(logging.DEBUG) else None  # each request of an outage has one, for a full disk
    logger.error("storage unavailable: %s", str(error).partition("\n")[0], exc_info=seen)
    assert isinstance(error, StorageUnavailable)
    return problem_response(request, storage_unavailable(error))


async def _on_queue_full(request: Request, error: Exception) -> JSONResponse:
    return problem_response(request, Problem(TOO_MANY_UPLOADS, str(error), headers={"Retry-After": QUEUE_FULL_SECONDS}))


async def _on_invalid_request(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    wrong = [_wrong_value(_with_range(request, entry)) for entry in error.errors()[:MOST_TOLD]]
    listed = [{"name": each.name, "value": each.value, "allowed": each.allowed} for each in wrong]
    wrong[0].more["errors"] = listed
    return problem_response(request, wrong[0])


def _with_range(request: Request, entry: dict[str, Any]) -> dict[str, Any]:
    """The error with the whole range of what is to be a number, where the route tells it."""
    route = request.scope.get("route")
    if entry["type"] not in OF_NUMBERS or not isinstance(route, FairRoute):
        return entry
    place, *path = entry["loc"]
    return {"range": range_at(route.schema_of(place), tuple(path)), **entry}


def _wrong_value(entry: dict[str, Any]) -> Problem:
    if entry["type"] == "json_invalid":
        return Problem.wrong_value(INVALID_REQUEST, "body", f"not JSON ({entry['ctx']['error']})", "a JSON object")
    name = ".".join(str(part) for part in entry["loc"][1:]) or str(entry["loc"][0])
    if entry["type"] == "missing":
        allowed = "a JSON object" if entry["loc"] == ("body",) else "a value"
        return Problem.wrong_value(INVALID_REQUEST, name, "missing", allowed)
    return Problem.wrong_value(INVALID_REQUEST, name, _given(entry), _allowed(entry))


def _given(entry: dict[str, Any]) -> object:
    """The value; as JSON has it where it is empty text or has parts, and in a body where it is of a wrong kind: "2" is
    text, and looks like a number without its marks.
    """
    value = entry["input"]
    is_of_wrong_kind = entry["type"].endswith(("_type", "_parsing")) and entry["loc"][0] == "body"
    shows_as_json = value == "" or isinstance(value, dict | list)
    shows_as_json |= is_of_wrong_kind and isinstance(value, str | bool | None)
    return json.dumps(value, ensure_ascii=False, default=str) if shows_as_json else value


def _allowed(entry: dict[str, Any]) -> str:
    """What would be right, in words of ours where the framework's are a pattern, or no more than what is wrong."""
    kind, ctx = entry["type"], entry.get("ctx", {})
    if kind in {"too_short", "too_long"} and isinstance(entry["input"], str):  # of what may also be nothing
        kind = f"string_{kind}"
    if kind in WORDS_OF_KIND:
        return WORDS_OF_KIND[kind].format(**ctx)
    if kind == "string_pattern_mismatch":
        return RULE_OF_PATTERN.get(ctx["pattern"], f"text that matches {ctx['pattern']}").removesuffix(".")
    if kind in OF_NUMBERS and entry.get("range") is not None:
        return str(entry["range"])
    allowed = entry["msg"].removeprefix("Input should be ").removeprefix("Value error, ")
    allowed = re.sub(r"0\.0{4,}\d+", lambda small: f"{float(small[0]):g}", allowed)
    allowed = allowed.partition(", unable to ")[0]
    return f"a number {allowed}" if kind in BOUNDS and str(entry["input"]).lower() == "nan" else allowed


async def _on_http_exception(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    kind = _BY_STATUS.get(error.status_code) or ProblemType(
        BAD_REQUEST.name, HTTPStatus(error.status_code).phrase, error.status_code
    )
    headers = dict(error.headers or {})
    if kind is METHOD_NOT_ALLOWED:
        headers["Allow"] = ", ".join(_allowed_methods(request))
        refused = Problem.wrong_value(kind, "method", request.method, headers["Allow"])
        refused.headers |= headers
        return problem_response(request, refused)
    return problem_response(
        request, Problem(kind, f"{request.method} {request.url.path}: {error.detail}", headers=headers)
    )


def _allowed_methods(request: Request) -> list[str]:
    """Methods that some route takes for this path: the framework names only those of the first route."""
    router: Router = request.app.router
    here = [route for route in router.routes if route.matches(request.scope)[0] is not Match.NONE]
    taken = {method for route in here for method in getattr(route, "methods", None) or ()}
    return sorted(taken | {"HEAD"} if "GET" in taken else taken)
