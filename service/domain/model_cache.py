"""Current models kept in memory, so that a look-up asks no database."""

import asyncio
import hashlib
import math
import time
from collections import OrderedDict
from collections.abc import Hashable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

from db.database import Database
from db.records import StoredModel
from db.repositories import friction_models, materials
from service.domain.stored_results import to_friction_model
from service.http.problems import NO_MODEL, Problem

if TYPE_CHECKING:
    from estimators import FrictionModel

MOST = 10_000
"""Models kept, each about 2 kB; when there are more, all are read anew."""

MOST_CHANGES = 2_000
"""Changes remembered, 270 bytes each, more than a page lists at once; one that was forgotten is taken for a new one,
which costs a look at the database."""


@dataclass(frozen=True, slots=True, eq=False)
class KnownModel:
    """A material's current model as it was at a moment, with the tag that stands for what it answers.

    ``read_at`` and ``until`` are s of the clock that nobody sets.
    """

    stored: StoredModel
    model: "FrictionModel"
    tag: str
    read_at: float
    until: float


class _Reading(NamedTuple):
    began_at: float
    task: asyncio.Task[KnownModel]


class ModelCache:
    """Models by a material's name and a method, each believed for ``seconds`` after it was read.

    What another process stores in that time is missed, unless this one gets to know of it (``seen``).
    """

    def __init__(self, seconds: float = 0.0) -> None:
        self._seconds = seconds
        self._known: dict[tuple[str, str], KnownModel] = {}
        self._readings: dict[tuple[str, str], _Reading] = {}
        self._changed_at = -math.inf
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
        if reading is None or reading.began_at <= self._changed_at or self._seconds == 0.0:
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
        """The model in memory, if it may still be believed."""
        known = self._known.get((material, method))
        if known is None or known.until < time.monotonic() or known.read_at <= self._changed_at:
            return None
        return known

    def read(self, database: Database, material: str, method: str) -> KnownModel:
        """The model in the database; raises ``NotFound``, and ``Problem`` where the material has none."""
        read_at = time.monotonic()
        until = read_at + self._seconds
        with database.read() as session:
            stored = friction_models.current(session, material, method)
            if stored is None:
                materials.find_id(session, material)
                detail = f"material {material!r} has no model fitted by {method!r} yet"
                raise Problem(NO_MODEL, detail, name="method", value=method, allowed="a method that was fitted")
        known = self._known.get((material, method))
        if known is not None and known.tag == _tag(stored):
            known = replace(known, read_at=read_at, until=until)
        else:
            known = KnownModel(stored, to_friction_model(stored.model), _tag(stored), read_at, until)
        if len(self._known) >= MOST:
            self._known.clear()
        self._known[material, method] = known
        return known

    def seen(self, *changes: Hashable) -> None:
        """That models, or names of materials, changed, as can be seen in the database by now.

        ``changes`` are what tells so, such as jobs that have ended: none of them counts a second time. They are told
        apart by what they are and not by when they were, since clocks differ and are set.
        """
        new = [each for each in changes if each not in self._changes]  # not by a set, which would walk over all of them
        if changes and not new:
            return
        self._changes.update(dict.fromkeys(new))
        while len(self._changes) > MOST_CHANGES:
            self._changes.popitem(last=False)
        self._changed_at = time.monotonic()


def _tag(stored: StoredModel) -> str:
    identity = (stored.id, stored.material, stored.outdated)
    return f'"{hashlib.blake2b(repr(identity).encode(), digest_size=12).hexdigest()}"'
