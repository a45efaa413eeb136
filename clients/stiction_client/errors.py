"""The exceptions of the client: one small tree."""

from collections.abc import Mapping
from typing import Any, Literal


class StictionError(Exception):
    """Whatever this package refuses to do, or could not."""


class InvalidArgument(StictionError, ValueError):
    """An argument that cannot be used: ``name`` of the thing, its ``value`` as text, what is ``allowed``."""

    def __init__(self, name: str, value: object, allowed: str) -> None:
        self.name, self.value, self.allowed = name, str(value), allowed
        super().__init__(name, self.value, allowed)  # all three, so that the error survives pickling

    def __str__(self) -> str:
        return f"{self.name} is {self.value}; allowed: {self.allowed}"


class ConnectionFailed(StictionError):
    """The service could not be reached, or the connection broke or timed out."""


class AnswerTimedOut(ConnectionFailed, TimeoutError):
    """A live stream's answer has not come in time."""


class StreamEnded(ConnectionFailed):
    """The service ended a live stream: its ``code`` and ``reason`` (docs/stream.md), 4422 where it was asked for what
    cannot be.
    """

    def __init__(self, code: int, reason: str) -> None:
        super().__init__(code, reason)
        self.code, self.reason = code, reason

    def __str__(self) -> str:
        return f"the service ended the stream: {self.reason} ({self.code})"


class ProblemError(StictionError):
    """The service refused a request (RFC 9457 problem).

    ``type`` is stable and made for programs, such as "/problems/unknown-material"; ``status`` is the HTTP status;
    ``detail`` is for people; ``name``, ``value`` and ``allowed`` say which input was wrong, where one was; ``facts``:
    what else the problem's type tells (docs/problems.md), such as ``owners`` or ``largest_load``.
    """

    def __init__(
        self,
        type: str,  # noqa: A002 - the name that RFC 9457 gives it
        status: int,
        detail: str,
        name: str | None = None,
        value: str | None = None,
        allowed: str | None = None,
        facts: Mapping[str, Any] | None = None,
    ) -> None:
        self.type, self.status, self.detail = type, status, detail
        self.name, self.value, self.allowed = name, value, allowed
        self.facts = dict(facts or {})
        # not super(): a problem that is an error of this package as well has other arguments there
        StictionError.__init__(self, type, status, detail, name, value, allowed, self.facts)

    def __str__(self) -> str:
        return f"{self.detail} ({self.status}, {self.type})"


class UnexpectedAnswer(StictionError):
    """The answer is not one that a Stiction service gives: a wrong address, a proxy, or another version."""


class AnswerTooLarge(UnexpectedAnswer):
    """The answer is longer than the client takes: 64 MiB, also once it is unpacked."""


class StaleModel(UserWarning):
    """The service can't be reached, so that a model is used as it was when it was last asked for."""


class NoModel(StictionError):
    """The material has no fitted model of this method yet."""


class JobError(StictionError):
    """A job that did not end well: ``job_id`` and its ``reason``."""

    def __init__(self, job_id: str, reason: str) -> None:
        self.job_id, self.reason = job_id, reason
        super().__init__(job_id, reason)

    def __str__(self) -> str:
        return f"job {self.job_id}: {self.reason}"


class JobRefused(JobError):
    """The data do not allow what was asked (no contact, no slip, too few samples); the log is kept."""


class JobFailed(JobError):
    """The service broke while it worked on the job."""


class JobCancelled(JobError):
    """Somebody cancelled the job."""


class JobTimedOut(JobError):
    """The job had not ended when waiting did; it goes on in the service."""


Cause = Literal["physics", "limit", "range", "ignorance"]
"""Why no normal force holds a load: even the expected friction would not; only forces above the limit would; only
forces beyond those observed would; or the expected friction would, but too little is known of it."""

_CAUSES: dict[str, str] = {
    "physics": "even the friction that is expected holds less",
    "limit": "a normal force above the limit would hold it",
    "range": "only normal forces beyond those observed{observed} would hold it: record grasps that press harder",
    "ignorance": "the friction that is expected would hold it, but is too uncertain: record more grasps",
    "": "",
}


class NoFeasibleForce(StictionError):
    """No normal force holds the load with the slip probability asked for.

    ``largest_load``: N, the most that can be held so (0 where nothing can), at ``normal_force`` N; ``cause``: whether
    physics, the limit, the range of the data or ignorance is why; ``largest_observed``: greatest normal force of an
    element in the data, N, where it is known; ``least_slip_probability``: the least with which a force does hold, None
    where none does by 0.1.
    """

    def __init__(
        self,
        tangential_load: float,
        largest_load: float,
        normal_force: float,
        reason: str,
        cause: Cause | str = "",
        largest_observed: float | None = None,
        least_slip_probability: float | None = None,
    ) -> None:
        self.tangential_load, self.largest_load = tangential_load, largest_load
        self.normal_force, self.reason, self.cause = normal_force, reason, cause
        self.largest_observed, self.least_slip_probability = largest_observed, least_slip_probability
        super().__init__(
            tangential_load, largest_load, normal_force, reason, cause, largest_observed, least_slip_probability
        )

    def __str__(self) -> str:
        most = (
            f"the largest load held so is {self.largest_load:.6g} N, at a normal force of {self.normal_force:.6g} N"
            if self.largest_load > 0.0
            else "no load is held so at any force"
        )
        up_to = "" if self.largest_observed is None else f", {self.largest_observed:.4g} N an element,"
        because = f"; {_CAUSES[self.cause].format(observed=up_to)}" if self.cause else ""
        least = self.least_slip_probability
        instead = "" if least is None else f"; with a slip probability of {least:g} it would be held"
        return f"no normal force holds {self.tangential_load:.6g} N ({self.reason}); {most}{because}{instead}"
