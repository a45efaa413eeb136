"""Current models kept in memory, so that a look-up asks no database."""

import asyncio
import hashlib
import math
import time
from collections import OrderedDict
from collections.abc import Hashable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

from sqlalchemy.orm import Session

from db.database import Database
from db.errors import NotFound, StorageUnavailable
from db.records import Job, StoredModel
from db.repositories import detections, friction_models, jobs, materials
from service.domain.errors import NoModel
from service.domain.models.recommended import AUTO, disagreeing, recommended
from service.domain.models.stored_results import to_friction_model
from slipcore.finding import severity_of

if TYPE_CHECKING:
    from estimators import FrictionModel

MOST = 10_000
"""Models kept, each about 2 kB; when there are more, all are read anew."""

MOST_BOUNDS = 20
"""Newest logs of a material by which friction is bounded where there is no model: of thousands it would take a second,
each time that somebody asks.
"""

MOST_CHANGES = 2_000
"""Changes remembered, 270 bytes each, more than a page lists at once; one that was forgotten is taken for a new one,
which costs a look at the database."""


@dataclass(frozen=True, slots=True, eq=False)
class KnownModel:
    """A material's current model as it was at a moment, with the tag that stands for what it answers.

    ``read_at`` and ``until`` are s of the monotonic clock; ``because``: why this model, where no method was named;
    ``disagreement`` with the material's models by other methods, where there is any.
    """

    stored: StoredModel
    model: "FrictionModel"
    tag: str
    read_at: float
    until: float
    because: str | None = None
    disagreement: str | None = None


class _Reading(NamedTuple):
    began_at: float
    task: asyncio.Task[KnownModel]


class ModelCache:
    """Models by a material's name and a method, each used for ``seconds`` after it was read.

    What another process stores in that time is missed, unless this one gets to know of it (``seen``, ``has_ended``).
    """

    def __init__(self, seconds: float = 0.0) -> None:
        self._seconds = seconds
        self._known: dict[tuple[str, str], KnownModel] = {}
        self._readings: dict[tuple[str, str], _Reading] = {}
        self._changed_at = -math.inf
        self._material_changed_at: dict[str, float] = {}
        self._last_change_at = -math.inf
        self._changes: OrderedDict[Hashable, None] = OrderedDict()

    async def get(self, database: Database, material: str, method: str) -> KnownModel:
        """The model in memory or in the database, read once for all who ask meanwhile; raises as ``read``.

        In memory it is read anew once it is half as old as it may get: who asks all the time never waits.
        """
        known = self.fresh(material, method)
        if known is None:
            return await asyncio.shield(self._read_once(database, material, method))
        self.renew(database, known, material, method)
        return known

    def renew(self, database: Database, known: KnownModel, material: str, method: str) -> None:
        """Begin to read a model anew that is half as old as it may get."""
        if known.until - time.monotonic() < 0.5 * self._seconds:
            self._read_once(database, material, method)

    def _read_once(self, database: Database, material: str, method: str) -> asyncio.Task[KnownModel]:
        key = material, method
        reading = self._readings.get(key)
        if reading is None or reading.began_at <= self._last_change_at or self._seconds == 0.0:
            task = asyncio.create_task(asyncio.to_thread(self.read, database, material, method))
            reading = self._readings[key] = _Reading(time.monotonic(), task)
            task.add_done_callback(lambda _: self._forget(key, reading))
        return reading.task

    def _forget(self, key: tuple[str, str], reading: _Reading) -> None:
        if self._readings.get(key) is reading:
            del self._readings[key]
        if not reading.task.cancelled():
            reading.task.exception()  # whoever waited was told; who renews need not be

    def fresh(self, material: str, method: str) -> KnownModel | None:
        """The model in memory, if it is still recent enough."""
        known = self._known.get((material, method))
        if known is None or known.until < time.monotonic():
            return None
        changed_at = max(self._changed_at, self._material_changed_at.get(known.stored.material, -math.inf))
        return known if known.read_at > changed_at else None

    def has_known(self, material: str, method: str) -> bool:
        """Whether there was a model when it was last read, however long ago."""
        return (material, method) in self._known

    def get_all(self, database: Database, names: Iterable[str], method: str) -> dict[str, KnownModel]:
        """The models of many materials, by these names, in memory or read together; raises as ``read``."""
        known = {name: self.fresh(name, method) for name in names}
        missing = [name for name, found in known.items() if found is None]
        read = self._read_all(database, missing, method) if missing else {}
        return {name: found or read[name] for name, found in known.items()}

    def read(self, database: Database, material: str, method: str) -> KnownModel:
        """The model in the database; raises ``NotFound``, and ``NoModel`` where the material has none."""
        return self._read_all(database, [material], method)[material]

    def _read_all(self, database: Database, names: Sequence[str], method: str) -> dict[str, KnownModel]:
        read_at = time.monotonic()
        with database.read() as session:
            found = _current(session, materials.find_ids(session, names), method)
        return {name: self._keep(name, method, each, read_at) for name, each in found.items()}

    def _keep(self, material: str, method: str, found: "_Current", read_at: float) -> KnownModel:
        disagreement = disagreeing(found.stored, found.all)
        until = read_at + self._seconds
        known, tag = self._known.get((material, method)), _tag(found.stored, disagreement)
        if known is not None and known.tag == tag:
            known = replace(known, read_at=read_at, until=until)
        else:
            model = to_friction_model(found.stored.model)
            known = KnownModel(found.stored, model, tag, read_at, until, found.because, disagreement)
        if len(self._known) >= MOST:
            self._known.clear()
        newer = self._known.get((material, method))
        if newer is None or newer.read_at < read_at:
            self._known[material, method] = known
        return known

    def seen(self, *changes: Hashable) -> None:
        """That models, or names of materials, changed, as can be seen in the database by now.

        ``changes`` show it, such as jobs that have ended: none of them counts a second time. They are told
        apart by what they are and not by when they were, since clocks differ and are set.
        """
        if not changes or self._has_new(changes):
            self._changed_at = self._last_change_at = time.monotonic()
            self._remember(changes)

    def has_ended(self, database: Database, job: Job) -> None:
        """That a job has ended, as can be seen in the database by now; to be called before anybody is told.

        The models of its material are read anew by the caller, at once: until then who looks one up has the one before
        and nobody waits, and models of other materials stay.
        """
        change = job.id, job.finished_at
        if job.material is None or not self._has_new([change]):
            return
        changed_at = time.monotonic()
        asked: dict[str, list[str]] = {}  # names by method, of what was asked lately
        for (name, method), known in list(self._known.items()):
            if known.stored.material == job.material and self.fresh(name, method) is not None:
                asked.setdefault(method, []).append(name)
        for method, names in asked.items():
            with suppress(NotFound, NoModel, StorageUnavailable):  # who looks it up will be told
                self._read_all(database, names, method)
        if len(self._material_changed_at) >= MOST:
            self._material_changed_at, self._changed_at = {}, changed_at
        self._material_changed_at[job.material] = self._last_change_at = changed_at
        self._remember([change])  # not before: who comes next would take it for done

    def _has_new(self, changes: Sequence[Hashable]) -> bool:
        return any(each not in self._changes for each in changes)  # not by a set, which would walk over all of them

    def _remember(self, changes: Sequence[Hashable]) -> None:
        self._changes.update({each: None for each in changes if each not in self._changes})
        while len(self._changes) > MOST_CHANGES:
            self._changes.popitem(last=False)


class _Current(NamedTuple):
    """A material's current model that was asked for, why it is this one, and all of its current models."""

    stored: StoredModel
    because: str | None
    all: Sequence[StoredModel]


def _current(session: Session, ids: Mapping[str, int], method: str) -> dict[str, _Current]:
    """The current models by a method, or the recommended ones, of materials by their names, in one query.

    With the one for their keys (5 µs in SQLite) it takes 1.4 ms of CPU; joined to one it took 1.8, for SQLAlchemy makes
    up a statement of that size anew each time. Raises ``NoModel``.
    """
    models = friction_models.all_current(session, list(ids.values()))
    return {
        name: _chosen(session, name, material_id, models.get(material_id, []), method)
        for name, material_id in ids.items()
    }


def _chosen(session: Session, material: str, material_id: int, models: Sequence[StoredModel], method: str) -> _Current:
    if method != AUTO:
        named = next((stored for stored in models if stored.model.method == method), None)
        if named is not None:
            return _Current(named, None, models)
    else:
        found = recommended(models)
        if found is not None:
            return _Current(found.stored, found.because, models)
    fitted = ", ".join(sorted(stored.model.method for stored in models))
    known = f"; fitted: {fitted}" if fitted else _without_model(session, material_id)
    raise NoModel(f"material {material!r} has no model fitted by {method!r} yet{known}", method)


def _without_model(session: Session, material_id: int) -> str:
    """What is known without a model: a bound by its newest logs that nothing speaks against, else what became of the
    newest of all.
    """
    bounds = detections.least_frictions(session, material_id, MOST_BOUNDS)
    sound = [least for least, names in bounds if all(severity_of(name) != "warning" for name in names)]
    least = max(sound, default=0.0)
    if least <= 0.0:
        return _newest_log(session, material_id)
    return (
        f"; of its newest grasps the one that held best bore a load for which friction was at least {least:.2g}: the "
        "next one may hold less"
    )


def _newest_log(session: Session, material_id: int) -> str:
    newest = jobs.newest_ingest(session, material_id)
    if newest is None:
        return ": it has no grasp log; upload one in which the contact slips"
    status, reason = newest
    return f"; its newest log is {status}{f': {reason}' if reason else ''}"


def _tag(stored: StoredModel, disagreement: str | None) -> str:
    identity = (stored.id, stored.material, stored.outdated, disagreement)
    return f'"{hashlib.blake2b(repr(identity).encode(), digest_size=12).hexdigest()}"'
