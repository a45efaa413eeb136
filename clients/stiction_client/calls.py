"""What each call says to the service and makes of its answers, without any I/O.

A call is a generator: it yields a ``Request`` or a ``Pause``, is sent the ``Reply``, and returns the result. The
clients only carry requests out, one waiting, the other awaiting, so nothing is written twice.
"""

import json
import math
import time
import warnings
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Generic, NoReturn, TypeVar
from urllib.parse import quote
from uuid import uuid4

import httpx
import numpy as np

from stiction_client import container, json_values, problems
from stiction_client.container import GraspLogLike
from stiction_client.errors import (
    AnswerTooLarge,
    ConnectionFailed,
    InvalidArgument,
    JobTimedOut,
    NoModel,
    ProblemError,
    StaleModel,
    StictionError,
    UnexpectedAnswer,
)
from stiction_client.model import FrictionModel
from stiction_client.records import AuditEntry, FrictionAnswer, GraspLogReceipt, Job, Material, NextGrasp, Recognition

ATTEMPTS = 3
"""Times that a request is tried before a broken connection, or a service that is busy, is an error."""

AWAY = frozenset({502, 503, 504})
"""Statuses by which a service, or a proxy before it, says that it is not there now."""
NOT_DONE = frozenset({429, 503})
"""Statuses with which the service says that it did nothing."""
MAY_BE_DONE = frozenset({None, "/problems/stopping"})
"""Types of problem with these statuses, None of answers that are no problem of the service's, which do not say so."""
BUSY = AWAY | NOT_DONE
"""Statuses after which what may be asked twice is asked again."""

LONGEST_RETRY = 30.0
"""s; a service that asks to be left alone for longer is not waited for."""

RETRY_PAUSE = 0.2
"""s before the second attempt; doubled for each one after."""

FIRST_POLL, POLL_GROWTH, LONGEST_POLL = 0.05, 1.5, 2.0
"""s, -, s: how often a job is asked for, denser at first because most jobs end within a second."""

SAMPLE_ARRAYS = (
    "friction_coefficient",
    "tangential_velocity",
    "normal_force",
    "tangential_force",
    "time",
    "element",
    "weight",
)

PAGE = 1000
"""Entries asked for at once: as many as the service gives."""

PAGE_OF_MATERIALS = 100
"""Of materials, whose models tell of each sensor: 1,000 with 50 sensors have more than an answer may."""


ECHOED = {
    "v": "tangential_velocity",
    "fn": "normal_force",
    **{name: name for name in ("quantile", "method", "of", "elements", "element_area")},
}
"""Parameters of a look-up that its answer repeats, and as what."""

NOT_MODIFIED = 304

NOT_JSON = (ValueError, RecursionError)
"""What an answer raises that is no JSON, or nested too deeply, or has a number of thousands of digits."""

OF_PROBLEMS = frozenset({"type", "title", "status", "detail", "instance", "name", "value", "allowed"})
"""Members of a problem that are arguments of their own, or say what is known: RFC 9457's, and this service's."""


@dataclass(frozen=True, slots=True)
class Request:
    """One HTTP request; ``is_repeatable``: harmless twice, or done once under its ``idempotency_key``.

    ``wait_seconds``: for which the service is asked to keep its answer back; ``tag``: that of its answer before.
    """

    method: str
    path: str
    params: Mapping[str, str | float] = field(default_factory=dict)
    json: Mapping[str, Any] | None = None
    content: bytes | None = None
    content_type: str | None = None
    idempotency_key: str | None = None
    wait_seconds: float = 0.0
    tag: str | None = None
    is_repeatable: bool = True


@dataclass(frozen=True, slots=True)
class Pause:
    """Wait this many seconds."""

    seconds: float


T = TypeVar("T")
Call = Generator[Request | Pause, httpx.Response | None, T]
Reply = httpx.Response | ConnectionFailed | AnswerTooLarge | None
"""What a client got for a step: for a request a response, or why there is none, and nothing for a pause."""


@dataclass(frozen=True, slots=True)
class Ended(Generic[T]):
    """A call is through."""

    result: T


def advance(call: Call[T], answer: Reply) -> Request | Pause | Ended[T]:
    """Give a call the result of its last step (None at the start) and get its next one."""
    try:
        return call.throw(answer) if isinstance(answer, StictionError) else call.send(answer)
    except StopIteration as end:
        return Ended(end.value)


def upload(
    log: GraspLogLike | Path | str,
    material: str | None,
    sensor: str | None,
    detector: str | None,
    scale: float | None,
    frame_rate: float | None,
    mapping: Mapping[str, Any] | str | None,
    rest: str | int | None = None,
) -> Call[GraspLogReceipt]:
    """Upload a log; the service knows logs by content, so that a repetition is no second log."""
    content, content_type = _body(log)
    params = _given(
        material=material,
        sensor=sensor,
        detector=detector,
        scale=scale,
        frame_rate=frame_rate,
        mapping=mapping if mapping is None or isinstance(mapping, str) else json.dumps(mapping),
        rest=rest,
    )
    request = Request("POST", "/v1/grasp-logs", params, content=content, content_type=content_type)
    return _record(GraspLogReceipt.from_json, (yield from _ask(request)))


def grasp_log(log_id: str) -> Call[GraspLogReceipt]:
    """Ask for a log."""
    found = _record(GraspLogReceipt.from_json, (yield from _get(f"/v1/grasp-logs/{_part(log_id)}")))
    _require_same({"id": log_id}, found)
    return found


def grasp_logs(material: str | None, limit: int) -> Call[list[GraspLogReceipt]]:
    """Ask for the newest logs."""
    return (yield from _listed("/v1/grasp-logs", GraspLogReceipt.from_json, limit, material=material))


def create_material(name: str, description: str) -> Call[Material]:
    """Create a material."""
    body = {"name": name, "description": description}
    return _record(Material.from_json, (yield from _ask(_post_once("/v1/materials", body))))


def ensure_material(name: str, description: str) -> Call[Material]:
    """Create a material unless it is there, whoever else does so at the same time."""
    try:
        return (yield from create_material(name, description))
    except problems.MaterialExists:
        return (yield from material(name))


def material(name: str) -> Call[Material]:
    """Ask for a material."""
    return _material(name, (yield from _get(f"/v1/materials/{_part(name)}")))


def materials() -> Call[list[Material]]:
    """Ask for all materials, page after page."""
    return (yield from _listed("/v1/materials", Material.from_json, page=PAGE_OF_MATERIALS))


def _listed(
    path: str, read: Callable[[Mapping[str, Any]], T], most: float = math.inf, page: int = PAGE, **asked: str | None
) -> Call[list[T]]:
    """Ask for a list, a ``page`` after the other, until there are enough; pages that are too large in halves."""
    found: list[T] = []
    cursor: str | None = None
    known = set[str | None]()
    while True:
        limit = int(min(page, most - len(found)))
        try:
            answer = yield from _get(path, _given(**asked, limit=limit, cursor=cursor))
        except AnswerTooLarge:
            if limit == 1:
                raise
            page = limit // 2
            continue
        more, cursor = _record(lambda record: ([read(item) for item in record["items"]], _next(record)), answer)
        found += more
        if cursor is None or len(found) >= most:
            return found
        if not more or cursor in known:
            raise UnexpectedAnswer(f"the service's list at {path} does not end")
        known.add(cursor)


def _next(record: Mapping[str, Any]) -> str | None:
    cursor = record.get("next")
    return None if cursor is None else json_values.text("next", cursor)


@dataclass(frozen=True, slots=True)
class CachedModel:
    """A material as the service last gave it, with the tag of that answer and when it was asked (monotonic, s)."""

    material: Material
    tag: str
    asked: float

    @property
    def age(self) -> float:
        """s since the service said so."""
        return time.monotonic() - self.asked


def model(name: str, method: str, kept: dict[str, CachedModel], stale_after: float) -> Call[FrictionModel]:
    """A material's current model of one method, or the recommended one ("auto").

    It is as ``kept`` where that is younger than ``stale_after`` s.
    An older one is asked for again; where nobody answers, the last is good enough, with a warning of its age.
    """
    known = kept.get(name)
    if known is None or known.age >= stale_after:
        try:
            known = yield from _ask_again(name, known)
            kept[name] = known
        except ConnectionFailed as error:
            if known is None:
                raise
            warnings.warn(f"{error}; going on with the model of {name!r} from {known.age:.0f} s ago", StaleModel, 5)
    models = known.material.models
    method = known.material.recommended or method if method == "auto" else method
    if method not in models:
        fitted = ", ".join(sorted(models)) or "none"
        raise NoModel(f"material {name!r} has no fitted model of method {method!r}; fitted: {fitted}")
    return models[method]


def _ask_again(name: str, known: CachedModel | None) -> Call[CachedModel]:
    """Ask for a material; it isn't sent once more if it is as ``known``.

    Raises ``ConnectionFailed`` also where one is known and the service, or a proxy before it, answers that it is away.
    """
    request = Request("GET", f"/v1/materials/{_part(name)}", tag=None if known is None else known.tag)
    asked = time.monotonic()
    response = yield from _send(request)
    if known is not None and response.status_code == NOT_MODIFIED:
        return replace(known, asked=asked)
    if known is not None and response.status_code in AWAY:
        raise ConnectionFailed(_summary(response))
    tag = response.headers.get("etag", "")
    return CachedModel(_material(name, _content(response)), tag if tag.isascii() else "", asked)


def rename_material(name: str, new_name: str) -> Call[Material]:
    """Rename a material."""
    request = Request("PATCH", f"/v1/materials/{_part(name)}", json={"name": new_name})
    return _record(Material.from_json, (yield from _ask(request)))


def merge_materials(name: str, source: str) -> Call[Material]:
    """Merge another material into one."""
    answer = yield from _ask(_post(f"/v1/materials/{_part(name)}/merges", {"source": source}))
    return _record(lambda record: Material.from_json(record["material"]), answer)


def begin_epoch(name: str, reason: str, first_log: str | None) -> Call[Material]:
    """Begin a new epoch of a material."""
    body = {"reason": reason, "first_grasp_log": first_log}
    answer = yield from _ask(_post(f"/v1/materials/{_part(name)}/epochs", body))
    return _record(lambda record: Material.from_json(record["material"]), answer)


def withdraw(log_id: str, reason: str) -> Call[GraspLogReceipt]:
    """Withdraw a log."""
    request = Request("PUT", f"/v1/grasp-logs/{_part(log_id)}/withdrawal", json={"reason": reason})
    return _record(_withdrawn, (yield from _ask(request)))


def _withdrawn(record: Mapping[str, Any]) -> GraspLogReceipt:
    log, other = GraspLogReceipt.from_json(record["grasp_log"]), record.get("counts_instead")
    return replace(log, counts_instead=None if other is None else json_values.text("counts_instead", other))


Names = set[tuple[str, str]]
"""Names that a client asked for materials by, each with the material's own, as the service said once."""


def friction(name: str, question: Mapping[str, float | str | None], known: Names) -> Call[FrictionAnswer]:
    """Look friction up."""
    asked = _given(**question)
    answer = _record(FrictionAnswer.from_json, (yield from _get(f"/v1/materials/{_part(name)}/friction", asked)))
    echoed = {ECHOED[each]: value for each, value in asked.items() if each in ECHOED}
    if echoed.get("of") == "element":
        echoed.pop("elements", None)  # of one, whatever was said
    _require_same(echoed, answer)
    yield from _require_named(name, answer.material, known)
    return answer


def next_grasp(name: str, working_point: Mapping[str, float | str | None], known: Names) -> Call[NextGrasp]:
    """Ask what to record next."""
    asked = _given(**working_point)
    answer = _record(NextGrasp.from_json, (yield from _get(f"/v1/materials/{_part(name)}/next-grasp", asked)))
    _require_same(_given(method=working_point.get("method")), answer)
    yield from _require_named(name, answer.material, known)
    return answer


def recognise(grasp: Any, materials: Sequence[str] | None, method: str | None, sensor: str | None) -> Call[Recognition]:
    """Ask which material a grasp was of."""
    body = {**_grasp(grasp), "materials": None if materials is None else list(materials)}
    body |= _given(method=method, sensor=sensor)
    return _record(Recognition.from_json, (yield from _ask(Request("POST", "/v1/recognise", json=body))))


def fit(name: str, method: str, seed: int) -> Call[Job]:
    """Ask for a fit."""
    request = _post_once(f"/v1/materials/{_part(name)}/fits", {"method": method, "seed": seed})
    return _record(Job.from_json, (yield from _ask(request)))


def job(job_id: str) -> Call[Job]:
    """Ask for a job."""
    return _job(job_id, (yield from _get(f"/v1/jobs/{_part(job_id)}")))


def jobs(status: str | None, limit: int) -> Call[list[Job]]:
    """Ask for the newest jobs."""
    return (yield from _listed("/v1/jobs", Job.from_json, limit, status=status))


def cancel(job_id: str) -> Call[Job]:
    """Cancel a job, which is harmless twice."""
    request = Request("POST", f"/v1/jobs/{_part(job_id)}/cancel")
    return _job(job_id, (yield from _ask(request)))


def owners(name: str) -> Call[list[str]]:
    """Ask whose a material is."""
    return _record(_owners, (yield from _get(f"/v1/materials/{_part(name)}/owners")))


def add_owner(name: str, owner: str) -> Call[list[str]]:
    """Let a key or a group own a material, too, which is harmless twice."""
    path = f"/v1/materials/{_part(name)}/owners/{_part(owner)}"
    return _record(_owners, (yield from _ask(Request("PUT", path))))


def remove_owner(name: str, owner: str) -> Call[None]:
    """Take a material from an owner."""
    yield from _ask(Request("DELETE", f"/v1/materials/{_part(name)}/owners/{_part(owner)}"))


def _owners(record: Mapping[str, Any]) -> list[str]:
    return [str(owner) for owner in record["owners"]]


def sensors() -> Call[list[dict[str, Any]]]:
    """Ask for all sensors, page after page."""
    return (yield from _listed("/v1/sensors", dict))


def describe_sensor(name: str, gel: Mapping[str, Any]) -> Call[dict[str, Any]]:
    """Say what a sensor's gel is."""
    return _record(dict, (yield from _ask(Request("PUT", f"/v1/sensors/{_part(name)}", json=dict(gel)))))


def calibrate_sensor(name: str, presses: Mapping[str, float | None]) -> Call[dict[str, Any]]:
    """Calibrate a sensor by stored logs, each with its known force."""
    pressed = [{"grasp_log": log, "known_force": force} for log, force in presses.items()]
    request = _post(f"/v1/sensors/{_part(name)}/calibrations", {"presses": pressed})
    return _record(dict, (yield from _ask(request)))


def calibrations(name: str) -> Call[list[dict[str, Any]]]:
    """Ask for the newest calibrations of a sensor."""
    path = f"/v1/sensors/{_part(name)}/calibrations"
    return _record(lambda record: [dict(each) for each in record["items"]], (yield from _get(path)))


def audit(actor: str | None, action: str | None, subject: str | None, limit: int) -> Call[list[AuditEntry]]:
    """Ask for the newest entries of the audit trail, page after page up to ``limit``."""
    return (yield from _listed("/v1/audit", AuditEntry.from_json, limit, actor=actor, action=action, subject=subject))


def wait(job_id: str, timeout: float) -> Call[Job]:
    """Ask for a job until it has ended; the service keeps its answer back that long, unless it is an older one."""
    deadline = time.monotonic() + timeout
    pause = FIRST_POLL
    while True:
        asked = time.monotonic()
        wait_seconds = min(max(deadline - asked, 0.0), LONGEST_POLL)
        request = Request("GET", f"/v1/jobs/{_part(job_id)}", {"wait": wait_seconds}, wait_seconds=wait_seconds)
        current = _job(job_id, (yield from _ask(request)))
        now = time.monotonic()
        if current.ended:
            return current
        if now >= deadline:
            raise JobTimedOut(job_id, f"still {current.status} after {timeout:g} s")
        yield Pause(max(min(pause, deadline - now) - (now - asked), 0.0))
        pause = min(pause * POLL_GROWTH, LONGEST_POLL)


def _get(path: str, params: Mapping[str, str | float] | None = None) -> Call[Any]:
    return (yield from _ask(Request("GET", path, params or {})))


def _post(path: str, body: Mapping[str, Any]) -> Request:
    """What would be done again."""
    return Request("POST", path, json=body, is_repeatable=False)


def _post_once(path: str, body: Mapping[str, Any]) -> Request:
    return Request("POST", path, json=body, idempotency_key=uuid4().hex)


def _ask(request: Request) -> Call[Any]:
    """Send a request, again where the connection breaks, and return the JSON of a good answer."""
    return _content((yield from _send(request)))


def _send(request: Request) -> Call[httpx.Response]:
    """Send a request, again where the connection breaks or the service is busy, and return what is answered.

    One that is not repeatable is sent again only where the answer says that nothing was done.
    """
    for attempt in range(ATTEMPTS):
        pause = RETRY_PAUSE * 2**attempt
        try:
            response = yield request
        except ConnectionFailed:
            if attempt == ATTEMPTS - 1 or not request.is_repeatable:
                raise
        else:
            assert response is not None  # what a driver sends for a request
            pause = max(_retry_after(response, pause), 0.0)
            if not _is_to_ask_again(request, response) or attempt == ATTEMPTS - 1 or pause > LONGEST_RETRY:
                return response
        yield Pause(pause)
    raise AssertionError("the last attempt returns or raises")


def _is_to_ask_again(request: Request, response: httpx.Response) -> bool:
    """Whether it was not done, or may be done twice; a proxy says 503 of what it had passed on, too."""
    if request.is_repeatable:
        return response.status_code in BUSY
    return response.status_code in NOT_DONE and _type_of_problem(response) not in MAY_BE_DONE


def _type_of_problem(response: httpx.Response) -> str | None:
    """As the service names it; None of an answer that is none of its problems."""
    try:
        kind = str(_json(response)["type"])
    except (*NOT_JSON, KeyError, TypeError):
        return None
    return kind if kind.startswith("/problems/") else None


def _retry_after(response: httpx.Response, default: float) -> float:
    """s that the service asks to wait; ``default`` where it doesn't say."""
    try:
        seconds = float(response.headers.get("retry-after", default))
    except ValueError:  # a date, of which it is not known by which clock
        return default
    return default if math.isnan(seconds) else seconds


def _content(response: httpx.Response) -> Any:
    if not response.is_success:
        _refuse(response)
    if response.status_code == httpx.codes.NO_CONTENT:
        return None
    try:
        return _json(response)
    except NOT_JSON as error:
        raise UnexpectedAnswer(f"{_summary(response)}, which is not JSON") from error


def _json(response: httpx.Response) -> Any:
    """What it says in JSON, which is UTF-8 between services (RFC 8259); raises one of ``NOT_JSON``."""
    return json.loads(response.content.decode())


def _refuse(response: httpx.Response) -> NoReturn:
    try:
        problem = _json(response)
        kind, detail = str(problem["type"]), str(problem.get("detail") or problem.get("title", ""))
    except (*NOT_JSON, KeyError, TypeError, AttributeError) as error:
        raise UnexpectedAnswer(f"{_summary(response)}, which is no problem+json") from error
    named = {name: None if problem.get(name) is None else str(problem[name]) for name in ("name", "value", "allowed")}
    facts = {name: value for name, value in problem.items() if name not in OF_PROBLEMS}
    raise problems.BY_TYPE.get(kind, ProblemError)(kind, response.status_code, detail, **named, facts=facts)


def _record(read: Callable[[Any], T], record: Any) -> T:
    try:
        return read(record)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise UnexpectedAnswer(f"the service's answer lacks or garbles {error}") from error


def _material(name: str, record: Any) -> Material:
    """The material in an answer, which has to be known by this name: its own, or an alias."""
    found = _record(Material.from_json, record)
    if name not in (found.name, *_aliases(record)):
        _require_same({"name": name}, found)
    return found


def _aliases(record: Mapping[str, Any]) -> list[str]:
    return _record(lambda known: list(known.get("aliases", ())), record)


def _job(job_id: str, record: Any) -> Job:
    found = _record(Job.from_json, record)
    _require_same({"id": job_id}, found)
    return found


def _require_named(name: str, answered: str, known: Names) -> Call[None]:
    """Ask, once, whether a material that is asked for by ``name`` is the one that was ``answered``, by its own name."""
    if answered != name and (name, answered) not in known:
        record = yield from _get(f"/v1/materials/{_part(name)}")
        if answered not in (_material(name, record).name, *_aliases(record)):
            raise UnexpectedAnswer(f"the answer is to another question: of material {answered!r}, asked {name!r}")
        known.add((name, answered))


def _require_same(asked: Mapping[str, str | float], answer: Any) -> None:
    """Raise ``UnexpectedAnswer`` where what an answer says it was asked is not what was sent."""
    for name, value in asked.items():
        answered = getattr(answer, name)
        sent = value
        if isinstance(answered, int | float):
            with suppress(ValueError):
                sent = float(str(value))  # as the address has it
        if answered != sent and (name, value) != ("method", "auto"):
            raise UnexpectedAnswer(f"the answer is to another question: its {name} is {answered!r}, asked {sent!r}")


def _summary(response: httpx.Response) -> str:
    begin = response.content[:80].decode(errors="replace")  # whatever charset it says it has
    return f"{response.request.url} answered {response.status_code} with {begin!r}"


def _body(log: GraspLogLike | Path | str) -> tuple[bytes, str]:
    if not isinstance(log, str | Path):
        return container.encode(log), container.CONTENT_TYPE
    path = Path(log)
    if path.is_dir():
        return container.pack_folder(path), container.RECORDING_TYPE
    return path.read_bytes(), "application/octet-stream"


def _grasp(grasp: Any) -> dict[str, Any]:
    """A stored log by its id, or the friction samples of any object that has them."""
    if isinstance(grasp, GraspLogReceipt | str):
        return {"grasp_log": grasp if isinstance(grasp, str) else grasp.id}
    arrays = {name: np.asarray(getattr(grasp, name)) for name in SAMPLE_ARRAYS}
    for name, array in arrays.items():
        if not np.isfinite(array).all():
            raise InvalidArgument(name, "not finite", "finite numbers")
    lists = {name: array.tolist() for name, array in arrays.items()}
    relative = getattr(grasp, "velocity_is_relative", None)
    if relative is not None and np.any(relative):
        lists["velocity_is_relative"] = np.asarray(relative, dtype=bool).tolist()
    return {"samples": lists | {"element_area": float(grasp.element_area)}}


def _given(**params: str | float | None) -> dict[str, str | float]:
    return {name: value for name, value in params.items() if value is not None}


def _part(text: str) -> str:
    """One segment of a path; a name of dots or nothing would lead to another route."""
    if not text.strip("."):
        raise InvalidArgument("name", repr(text), "a letter or digit, then letters, digits, space, '.', '_' or '-'")
    return quote(text, safe="")
