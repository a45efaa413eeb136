"""The errors of use cases: one small tree. Whoever serves a use case decides on the answer (``http/errors.py``)."""

from collections.abc import Mapping, Sequence

LONGEST_VALUE = 200
"""Characters of an offending value that an error repeats."""


def shown(value: object) -> str:
    """A value as an error repeats it: short, and without what UTF-8 cannot say, such as half of a surrogate pair."""
    return str(value)[:LONGEST_VALUE].encode(errors="backslashreplace").decode()


class DomainError(Exception):
    """A use case cannot do what it was asked.

    ``name``, ``value`` and ``allowed`` say what was wrong, where one thing was; ``facts`` are further ones by name;
    ``retry_seconds``: after how many it may go well, where time helps.
    """

    retry_seconds: int | None = None

    def __init__(
        self,
        detail: str,
        *,
        name: str | None = None,
        value: str | None = None,
        allowed: str | None = None,
        facts: Mapping[str, object] | None = None,
    ) -> None:
        super().__init__(detail)
        self.name, self.value, self.allowed, self.facts = name, value, allowed, dict(facts or {})


class InvalidValue(DomainError):
    """One named thing has a value that is not allowed."""

    def __init__(self, name: str, value: object, allowed: str) -> None:
        text = shown(value)
        super().__init__(f"{name} is {text}; allowed: {allowed}", name=name, value=text, allowed=allowed)


class UnsupportedFormat(InvalidValue):
    """A file's format, or the encoding of its bytes, is not one that is read or written here."""


class InvalidGraspLog(InvalidValue):
    """A file is no grasp log."""


class TooLarge(InvalidValue):
    """An upload has, or unpacks to, more bytes than are taken."""


class UnknownOwner(InvalidValue):
    """Somebody is to own a material no longer who does not own it."""


class StorageQuotaExceeded(InvalidValue):
    """An access key has stored as much as it may."""


class QuotaExceeded(DomainError):
    """An access key has asked for as much as it may, for now."""

    def __init__(self, detail: str, retry_seconds: int) -> None:
        super().__init__(detail)
        self.retry_seconds = retry_seconds


class InsufficientScope(DomainError):
    """An access key of ``scope`` may not do what needs ``needed``."""

    def __init__(self, scope: str, needed: str) -> None:
        super().__init__(f"the key has scope {scope}; this needs {needed}")
        self.scope, self.needed = scope, needed


class KeyEnded(DomainError):
    """The access key with which something was begun was revoked, or has expired, before it was done."""

    def __init__(self) -> None:
        super().__init__("the access key was revoked or has expired since this began; allowed: a valid one")


class NotOwner(DomainError):
    """A material has ``owners``, and who asks is none of them."""

    def __init__(self, owners: Sequence[str]) -> None:
        detail = "the material has owners, and this key is none of them; one of them, or an admin, can add it"
        super().__init__(detail, facts={"owners": owners})


class UploadInterrupted(DomainError):
    """The bytes of an upload ended before it did, or nobody waits for it any more."""


class FileDeleted(DomainError):
    """The file of a stored log was deleted, as old uploads are."""


class NoModel(DomainError):
    """No material that was asked for has a model fitted by this method."""

    def __init__(self, detail: str, method: str) -> None:
        super().__init__(detail, name="method", value=method, allowed="a method that was fitted")


class NoFeasibleForce(DomainError):
    """No normal force holds the load."""


class InvalidSamples(DomainError):
    """Friction samples say nothing."""


class ResultsNotReady(DomainError):
    """A log's job has not got to the results that were asked for."""

    def __init__(self, job_id: str, status: str) -> None:
        super().__init__(f"job {job_id} is {status}; its results are not there")


class JobEnded(DomainError):
    """A job has ended otherwise before it could be cancelled."""

    def __init__(self, job_id: str, status: str) -> None:
        detail = f"job {job_id} is {status}: it cannot be cancelled any more"
        super().__init__(detail, name="status", value=status, allowed="queued or running")
