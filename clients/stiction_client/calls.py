"""What each call says to the service and makes of its answers, without any I/O."""

import json
import math
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from stiction_client import container, json_values, problems
from stiction_client.arguments import for_json, number_of_items
from stiction_client.container import GraspLogLike
from stiction_client.errors import (
    AnswerTooLarge,
    ConnectionFailed,
    InvalidArgument,
    JobTimedOut,
    NoModel,
    StaleModel,
    UnexpectedAnswer,
)
from stiction_client.exchange import (
    AWAY,
    Call,
    Pause,
    Request,
    T,
    ask,
    content_of,
    get,
    post,
    post_once,
    read_as,
    segment,
    send,
    summary_of,
    without_none,
)
from stiction_client.model import FrictionModel
from stiction_client.records import AuditEntry, FrictionAnswer, GraspLogReceipt, Job, Material, NextGrasp, Recognition
from stiction_client.support import CHOSEN_BECAUSE, DISAGREEMENT, disagreement

NOT_MODIFIED = 304

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
    params = without_none(
        material=material,
        sensor=sensor,
        detector=detector,
        scale=scale,
        frame_rate=frame_rate,
        mapping=mapping if mapping is None or isinstance(mapping, str) else json.dumps(for_json("mapping", mapping)),
        rest=rest,
    )
    request = Request("POST", "/v1/grasp-logs", params, content=content, content_type=content_type)
    return read_as(GraspLogReceipt.from_json, (yield from ask(request)))


def grasp_log(log_id: str) -> Call[GraspLogReceipt]:
    """Ask for a log."""
    found = read_as(GraspLogReceipt.from_json, (yield from get(f"/v1/grasp-logs/{segment(log_id)}")))
    _require_same({"id": log_id}, found)
    return found


def grasp_logs(material: str | None, limit: int | None) -> Call[list[GraspLogReceipt]]:
    """Ask for the newest logs."""
    return (yield from _listed("/v1/grasp-logs", GraspLogReceipt.from_json, limit, material=material))


def create_material(name: str, description: str) -> Call[Material]:
    """Create a material."""
    body = {"name": name, "description": description}
    return read_as(Material.from_json, (yield from ask(post_once("/v1/materials", body))))


def ensure_material(name: str, description: str) -> Call[Material]:
    """Create a material unless it is there, whoever else does so at the same time."""
    try:
        return (yield from create_material(name, description))
    except problems.MaterialExists:
        return (yield from material(name))


def material(name: str) -> Call[Material]:
    """Ask for a material."""
    return _material(name, (yield from get(f"/v1/materials/{segment(name)}")))


def materials() -> Call[list[Material]]:
    """Ask for all materials, page after page."""
    return (yield from _listed("/v1/materials", Material.from_json, page=PAGE_OF_MATERIALS))


def _listed(
    path: str, read: Callable[[Mapping[str, Any]], T], limit: int | None = None, page: int = PAGE, **asked: str | None
) -> Call[list[T]]:
    """Ask for a list up to a ``limit``, a ``page`` after the other; pages that are too large in halves."""
    most = number_of_items(limit)
    found: list[T] = []
    cursor: str | None = None
    known = set[str | None]()
    while True:
        size = int(min(page, most - len(found)))
        try:
            answer = yield from get(path, without_none(**asked, limit=size, cursor=cursor))
        except AnswerTooLarge:
            if size == 1:
                raise
            page = size // 2
            continue
        more, cursor = read_as(lambda record: ([read(item) for item in record["items"]], _next(record)), answer)
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
    """A material as the service last gave it, with the tag of that answer and when it was asked (monotonic, s).

    ``answers``: the models that were made of it, by the method asked for: to compare methods takes as long as a grip
    force, and controllers ask for a model in each cycle.
    """

    material: Material
    tag: str
    asked: float
    answers: dict[str, FrictionModel] = field(default_factory=dict)

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
    if method not in known.answers:
        known.answers[method] = _answer(known.material, method)
    return known.answers[method]


def _answer(material: Material, asked: str) -> FrictionModel:
    """The material's model of the method that is ``asked`` for; raises ``NoModel``."""
    models, because = material.models, material.because if asked == "auto" else None
    method = material.recommended or asked if asked == "auto" else asked
    if method not in models:
        fitted = ", ".join(sorted(models)) or "none"
        raise NoModel(f"material {material.name!r} has no fitted model of method {method!r}; fitted: {fitted}")
    return _compared(method, models, because)


def _compared(method: str, models: Mapping[str, FrictionModel], because: str | None) -> FrictionModel:
    """The model of a ``method``, with why it is this one, and with what others of the same logs say against it; those
    that take all samples for independent are not asked.
    """
    model = models[method]
    known = {name: each for name, each in models.items() if not each.outdated and "assumes" not in each.diagnostics}
    others = {name: each for name, each in known.items() if name != method}
    told = None if model.outdated else disagreement(method, model, others)
    added = without_none(**{CHOSEN_BECAUSE: because, DISAGREEMENT: told})
    return replace(model, diagnostics={**model.diagnostics, **added}) if added else model


def _ask_again(name: str, known: CachedModel | None) -> Call[CachedModel]:
    """Ask for a material; it isn't sent once more if it is as ``known``.

    Raises ``ConnectionFailed`` also where one is known and the service, or a proxy before it, answers that it is away.
    """
    request = Request("GET", f"/v1/materials/{segment(name)}", tag=None if known is None else known.tag)
    asked = time.monotonic()
    response = yield from send(request)
    if known is not None and response.status_code == NOT_MODIFIED:
        return replace(known, asked=asked)
    if known is not None and response.status_code in AWAY:
        raise ConnectionFailed(summary_of(response))
    tag = response.headers.get("etag", "")
    return CachedModel(_material(name, content_of(response)), tag if tag.isascii() else "", asked)


def rename_material(name: str, new_name: str) -> Call[Material]:
    """Rename a material."""
    request = Request("PATCH", f"/v1/materials/{segment(name)}", json={"name": new_name})
    return read_as(Material.from_json, (yield from ask(request)))


def merge_materials(name: str, source: str) -> Call[Material]:
    """Merge another material into one."""
    answer = yield from ask(post(f"/v1/materials/{segment(name)}/merges", {"source": source}))
    return read_as(lambda record: Material.from_json(record["material"]), answer)


def begin_epoch(name: str, reason: str, first_log: str | None) -> Call[Material]:
    """Begin a new epoch of a material."""
    body = {"reason": reason, "first_grasp_log": first_log}
    answer = yield from ask(post(f"/v1/materials/{segment(name)}/epochs", body))
    return read_as(lambda record: Material.from_json(record["material"]), answer)


def withdraw(log_id: str, reason: str) -> Call[GraspLogReceipt]:
    """Withdraw a log."""
    request = Request("PUT", f"/v1/grasp-logs/{segment(log_id)}/withdrawal", json={"reason": reason})
    return read_as(_withdrawn, (yield from ask(request)))


def _withdrawn(record: Mapping[str, Any]) -> GraspLogReceipt:
    log, other = GraspLogReceipt.from_json(record["grasp_log"]), record.get("counts_instead")
    return replace(log, counts_instead=None if other is None else json_values.text("counts_instead", other))


Names = set[tuple[str, str]]
"""Names that a client asked for materials by, each with the material's own, as the service said once."""


def friction(name: str, question: Mapping[str, float | str | None], known: Names) -> Call[FrictionAnswer]:
    """Look friction up."""
    for each in ("v", "fn"):
        if question[each] is None:
            raise InvalidArgument(each, None, "a number")
    asked = without_none(**question)
    answer = read_as(FrictionAnswer.from_json, (yield from get(f"/v1/materials/{segment(name)}/friction", asked)))
    echoed = {ECHOED[each]: value for each, value in asked.items() if each in ECHOED}
    if echoed.get("of") == "element":
        echoed.pop("elements", None)  # of one, whatever was said
    _require_same(echoed, answer)
    yield from _require_named(name, answer.material, known)
    return answer


def next_grasp(name: str, working_point: Mapping[str, float | str | None], known: Names) -> Call[NextGrasp]:
    """Ask what to record next."""
    asked = without_none(**working_point)
    answer = read_as(NextGrasp.from_json, (yield from get(f"/v1/materials/{segment(name)}/next-grasp", asked)))
    _require_same(without_none(method=working_point.get("method")), answer)
    yield from _require_named(name, answer.material, known)
    return answer


def recognise(grasp: Any, materials: Sequence[str] | None, method: str | None, sensor: str | None) -> Call[Recognition]:
    """Ask which material a grasp was of."""
    body = {**_grasp(grasp), "materials": None if materials is None else list(materials)}
    body |= without_none(method=method, sensor=sensor)
    return read_as(Recognition.from_json, (yield from ask(Request("POST", "/v1/recognise", json=body))))


def fit(name: str, method: str, seed: int) -> Call[Job]:
    """Ask for a fit."""
    request = post_once(f"/v1/materials/{segment(name)}/fits", {"method": method, "seed": seed})
    return read_as(Job.from_json, (yield from ask(request)))


def job(job_id: str) -> Call[Job]:
    """Ask for a job."""
    return _job(job_id, (yield from get(f"/v1/jobs/{segment(job_id)}")))


def jobs(status: str | None, limit: int | None) -> Call[list[Job]]:
    """Ask for the newest jobs."""
    return (yield from _listed("/v1/jobs", Job.from_json, limit, status=status))


def cancel(job_id: str) -> Call[Job]:
    """Cancel a job, which is harmless twice."""
    request = Request("POST", f"/v1/jobs/{segment(job_id)}/cancel")
    return _job(job_id, (yield from ask(request)))


def owners(name: str) -> Call[list[str]]:
    """Ask whose a material is."""
    return read_as(_owners, (yield from get(f"/v1/materials/{segment(name)}/owners")))


def add_owner(name: str, owner: str) -> Call[list[str]]:
    """Let a key or a group own a material, too, which is harmless twice."""
    path = f"/v1/materials/{segment(name)}/owners/{segment(owner)}"
    return read_as(_owners, (yield from ask(Request("PUT", path))))


def remove_owner(name: str, owner: str) -> Call[None]:
    """Take a material from an owner."""
    yield from ask(Request("DELETE", f"/v1/materials/{segment(name)}/owners/{segment(owner)}"))


def _owners(record: Mapping[str, Any]) -> list[str]:
    return [str(owner) for owner in record["owners"]]


def sensors() -> Call[list[dict[str, Any]]]:
    """Ask for all sensors, page after page."""
    return (yield from _listed("/v1/sensors", dict))


def describe_sensor(name: str, gel: Mapping[str, Any]) -> Call[dict[str, Any]]:
    """Say what a sensor's gel is."""
    return read_as(dict, (yield from ask(Request("PUT", f"/v1/sensors/{segment(name)}", json=dict(gel)))))


def calibrate_sensor(name: str, presses: Mapping[str, float | None]) -> Call[dict[str, Any]]:
    """Calibrate a sensor by stored logs, each with its known force."""
    pressed = [{"grasp_log": log, "known_force": force} for log, force in presses.items()]
    request = post(f"/v1/sensors/{segment(name)}/calibrations", {"presses": pressed})
    return read_as(dict, (yield from ask(request)))


def calibrations(name: str) -> Call[list[dict[str, Any]]]:
    """Ask for the newest calibrations of a sensor."""
    path = f"/v1/sensors/{segment(name)}/calibrations"
    return read_as(lambda record: [dict(each) for each in record["items"]], (yield from get(path)))


def audit(actor: str | None, action: str | None, subject: str | None, limit: int | None) -> Call[list[AuditEntry]]:
    """Ask for the newest entries of the audit trail, page after page up to ``limit``."""
    return (yield from _listed("/v1/audit", AuditEntry.from_json, limit, actor=actor, action=action, subject=subject))


def wait(job_id: str, timeout: float) -> Call[Job]:
    """Ask for a job until it has ended; the service keeps its answer back that long, unless it is an older one."""
    if math.isnan(timeout):
        raise InvalidArgument("timeout", timeout, "a number of seconds")
    deadline = time.monotonic() + timeout
    pause = FIRST_POLL
    while True:
        asked = time.monotonic()
        wait_seconds = min(max(deadline - asked, 0.0), LONGEST_POLL)
        request = Request("GET", f"/v1/jobs/{segment(job_id)}", {"wait": wait_seconds}, wait_seconds=wait_seconds)
        current = _job(job_id, (yield from ask(request)))
        now = time.monotonic()
        if current.ended:
            return current
        if now >= deadline:
            raise JobTimedOut(job_id, f"still {current.status} after {timeout:g} s")
        yield Pause(max(min(pause, deadline - now) - (now - asked), 0.0))
        pause = min(pause * POLL_GROWTH, LONGEST_POLL)


def _material(name: str, record: Any) -> Material:
    """The material in an answer, which has to be known by this name: its own, or an alias."""
    found = read_as(Material.from_json, record)
    if name not in (found.name, *_aliases(record)):
        _require_same({"name": name}, found)
    return found


def _aliases(record: Mapping[str, Any]) -> list[str]:
    return read_as(lambda known: list(known.get("aliases", ())), record)


def _job(job_id: str, record: Any) -> Job:
    found = read_as(Job.from_json, record)
    _require_same({"id": job_id}, found)
    return found


def _require_named(name: str, answered: str, known: Names) -> Call[None]:
    """Ask, once, whether a material that is asked for by ``name`` is the one that was ``answered``, by its own name."""
    if answered != name and (name, answered) not in known:
        record = yield from get(f"/v1/materials/{segment(name)}")
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


def _body(log: GraspLogLike | Path | str) -> tuple[bytes, str]:
    if not isinstance(log, str | Path):
        if not hasattr(log, "displacement"):
            raise InvalidArgument("log", type(log).__name__, "a grasp log, a file, or a recording folder")
        return container.encode(log), container.CONTENT_TYPE
    path = Path(log)
    if path.is_dir():
        return container.pack_folder(path), container.RECORDING_TYPE
    return path.read_bytes(), "application/octet-stream"


def _grasp(grasp: Any) -> dict[str, Any]:
    """A stored log by its id, or the friction samples of any object that has them."""
    if isinstance(grasp, GraspLogReceipt | str):
        return {"grasp_log": grasp if isinstance(grasp, str) else grasp.id}
    if not hasattr(grasp, "friction_coefficient"):
        raise InvalidArgument("grasp", type(grasp).__name__, "a receipt, a log's id, or samples as slipcore gives them")
    arrays = {name: np.asarray(getattr(grasp, name)) for name in SAMPLE_ARRAYS}
    for name, array in arrays.items():
        if not np.isfinite(array).all():
            raise InvalidArgument(name, "not finite", "finite numbers")
    lists = {name: array.tolist() for name, array in arrays.items()}
    relative = getattr(grasp, "velocity_is_relative", None)
    if relative is not None and np.any(relative):
        lists["velocity_is_relative"] = np.asarray(relative, dtype=bool).tolist()
    return {"samples": lists | {"element_area": float(grasp.element_area)}}
