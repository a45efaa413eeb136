"""Errors as RFC 9457 problem details: one stable type a kind of problem (docs/problems.md)."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fastapi import Request
from fastapi.responses import JSONResponse

from db.errors import StorageUnavailable
from service.domain.errors import shown

logger = logging.getLogger(__name__)

MEDIA_TYPE = "application/problem+json"


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
UNKNOWN_SENSOR = ProblemType("unknown-sensor", "No such sensor", 404)
UNKNOWN_CALIBRATION = ProblemType("unknown-calibration", "No such calibration", 404)
UNKNOWN_GRASP_LOG = ProblemType("unknown-grasp-log", "No such grasp log", 404)
UNKNOWN_JOB = ProblemType("unknown-job", "No such job", 404)
METHOD_NOT_ALLOWED = ProblemType("method-not-allowed", "The route does not take this method", 405)
MATERIAL_EXISTS = ProblemType("material-exists", "The material exists already", 409)
NO_MODEL = ProblemType("no-model", "The material has no fitted model yet", 409)
NO_FEASIBLE_FORCE = ProblemType("no-feasible-force", "No normal force holds the load", 409)
JOB_ENDED = ProblemType("job-ended", "The job has ended", 409)
NOT_READY = ProblemType("not-ready", "The job has not got there", 409)
FILE_DELETED = ProblemType("file-deleted", "The upload was deleted", 410)
PRECONDITION_FAILED = ProblemType("precondition-failed", "It has changed meanwhile", 412)
REQUEST_TIMEOUT = ProblemType("request-timeout", "The request came too slowly", 408)
MISDIRECTED_REQUEST = ProblemType("misdirected-request", "The request is for another host", 421)
UPLOAD_TOO_LARGE = ProblemType("upload-too-large", "The body is too large", 413)
UNSUPPORTED_FORMAT = ProblemType("unsupported-format", "The format is not supported", 415)
INVALID_GRASP_LOG = ProblemType("invalid-grasp-log", "The grasp log is not valid", 422)
INVALID_SAMPLES = ProblemType("invalid-samples", "Nothing follows from the samples", 422)
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
        text = shown(value)
        return cls(kind, f"{name} is {text}; allowed: {allowed}", name=name, value=text, allowed=allowed)


def storage_unavailable(error: StorageUnavailable) -> Problem:
    """That the stores cannot be used now, with the time to try again."""
    return Problem(STORAGE_UNAVAILABLE, str(error), headers={"Retry-After": "1"})


def stopping() -> Problem:
    """That the server stops before it is done with the request."""
    return Problem(STOPPING, "not done before the server stopped", headers={"Retry-After": "1"})


def problem_response(request: Request, problem: Problem) -> JSONResponse:
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
    """The answer to an error that nothing else answers; the log shows what it was, the client does not get to know."""
    logger.error("request failed", exc_info=error)
    return problem_response(request, Problem(INTERNAL_ERROR, "an unexpected error; the server's log has it"))
