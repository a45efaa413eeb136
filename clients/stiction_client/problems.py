"""One exception a type of problem that the service answers with (docs/problems.md).

Each is a ``ProblemError``, whose ``type`` says the same; a type that this version doesn't know stays one.
"""

import math
import re
import sys
from typing import Any

from stiction_client import errors
from stiction_client.errors import ProblemError


class BadRequest(ProblemError):
    """The request cannot be understood as HTTP for this service."""


class UploadInterrupted(ProblemError):
    """The connection ended before the whole body was there."""


class KeyRequired(ProblemError):
    """No access key was sent."""


class InvalidKey(ProblemError):
    """The access key is unknown, revoked, expired or garbled."""


class InsufficientScope(ProblemError):
    """The key may do less than this."""


class CrossSiteRequest(ProblemError):
    """A request without a key would change something or open a stream, and was sent for a page of another site."""


class NotOwner(ProblemError):
    """The material has owners (``owners`` lists them), and the key is none of them."""


class UnknownRoute(ProblemError):
    """There is nothing under this path."""


class UnknownMaterial(ProblemError):
    """No material has this name or alias."""


class UnknownAlias(ProblemError):
    """The material has no such alias (its own name is none)."""


class UnknownOwner(ProblemError):
    """The material has no such owner."""


class UnknownGraspLog(ProblemError):
    """No grasp log has this id."""


class UnknownSensor(ProblemError):
    """No sensor of this name is known."""


class UnknownCalibration(ProblemError):
    """The sensor has no calibration of this version."""


class UnknownJob(ProblemError):
    """No job has this id."""


class MethodNotAllowed(ProblemError):
    """The path exists but not for this method."""


class MaterialExists(ProblemError):
    """A material of this name, or with such an alias, is there already."""


class NoModel(ProblemError, errors.NoModel):
    """The material has no model by this method yet."""


class NoFeasibleForce(ProblemError, errors.NoFeasibleForce):
    """No normal force holds the load, says the service: ``stiction_client.NoFeasibleForce`` with its numbers."""

    def __init__(self, *args: Any, **named: Any) -> None:
        super().__init__(*args, **named)
        self.tangential_load, self.reason = math.nan, self.detail  # the load is what was asked
        self.largest_load, self.normal_force = self._number("largest_load"), self._number("normal_force")
        self.cause = str(self.facts.get("cause", ""))
        self.largest_observed = self._number_or_none("largest_observed")
        self.least_slip_probability = self._number_or_none("least_slip_probability")

    def _number(self, name: str) -> float:
        """A number of the problem; NaN where it tells none."""
        value = self.facts.get(name)
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= sys.float_info.max:
            return math.nan
        return float(value)

    def _number_or_none(self, name: str) -> float | None:
        """The same of one that may be unknown: None where the problem tells none."""
        value = self._number(name)
        return None if math.isnan(value) else value


class JobEnded(ProblemError):
    """The job has ended, so it cannot be cancelled any more."""


class NotReady(ProblemError):
    """The log's job has not got to this result, or failed before it."""


class FileDeleted(ProblemError):
    """The log is known, but its upload was old and is deleted."""


class PreconditionFailed(ProblemError):
    """What is to be changed is not as ``If-Match`` says."""


class RequestTimeout(ProblemError):
    """The body came too slowly."""


class MisdirectedRequest(ProblemError):
    """A request without a key from this machine names another host."""


class UploadTooLarge(ProblemError):
    """The body is larger than the service takes, or unpacks to more or to too many times its size."""


class UnsupportedFormat(ProblemError):
    """The content type, content encoding or the file itself is none that the service reads."""


class InvalidGraspLog(ProblemError):
    """The file is of a known format, but its content cannot be a grasp log."""


class InvalidSamples(ProblemError):
    """Friction samples from which nothing follows."""


class InvalidRequest(ProblemError):
    """A parameter or a field of the body is missing or outside its range."""


class IdempotencyKeyReused(ProblemError):
    """Something else was asked under this ``Idempotency-Key``."""


class TooManyRequests(ProblemError):
    """One key, or one address, asks more often than is set."""


class QuotaExceeded(ProblemError):
    """One key has as many jobs queued, or logs of the last day, as it may."""


class HeadersTooLarge(ProblemError):
    """The headers have more than 16 kB."""


class FileDamaged(ProblemError):
    """A stored file has other bytes than those that it was stored with."""


class InternalError(ProblemError):
    """A defect of the service."""


class TooManyConnections(ProblemError):
    """``STICTION_MAX_CONNECTIONS`` are open already."""


class TooManyUploads(ProblemError):
    """Too many files wait to be read already, or the server found no room for this one within 30 s."""


class Stopping(ProblemError):
    """The server was told to stop, and the request was not done within ``STICTION_SHUTDOWN_SECONDS``."""


class WorkersNotReady(ProblemError):
    """The workers are still warming up, or take no jobs any more because the database is of a newer version."""


class FileMissing(ProblemError):
    """A file that a row refers to is not where files are kept."""


class StorageQuotaExceeded(ProblemError):
    """One key has as many bytes of uploads stored as it may."""


class StorageUnavailable(ProblemError):
    """The database or the blob folder cannot be used now."""


def _uri(kind: type[ProblemError]) -> str:
    """``type`` in the service's answer: the class's name in small letters, with hyphens."""
    return "/problems/" + re.sub(r"(?<!^)([A-Z])", r"-\1", kind.__name__).lower()


BY_TYPE = {_uri(kind): kind for kind in ProblemError.__subclasses__()}
"""The exception of each ``type``."""
