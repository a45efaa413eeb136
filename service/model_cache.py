"""Current models kept in memory, so that a look-up asks no database."""

import hashlib
import time
from collections.abc import Hashable
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta

from db.database import Database
from db.records import StoredModel
from db.repositories import friction_models, materials
from estimators.friction_model import FrictionModel
from service.problems import NO_MODEL, Problem
from service.stored_results import to_friction_model

MOST = 10_000
"""Models kept, each about 2 kB; when there are more, all are read anew."""

COMMIT_TIME = timedelta(seconds=1)
"""From the moment that a process writes into a row until others see the row, at most, and what clocks differ by."""


@dataclass(frozen=True, slots=True, eq=False)
class KnownModel:
    """A material's current model as it was at a moment, with the tag that stands for what it answers.

    ``answers``: those that were given, as JSON, by question.
    """

    stored: StoredModel
    model: FrictionModel
    tag: str
    read_at: datetime
    until: float
    answers: dict[Hashable, str] = field(default_factory=dict)


class ModelCache:
    """Models by a material's name and a method, each believed for ``seconds`` after it was read.

    What another process stores in that time is missed, unless this one gets to know of it (``seen``).
    """

    def __init__(self, seconds: float = 0.0) -> None:
        self._seconds = seconds
        self._known: dict[tuple[str, str], KnownModel] = {}
        self._changed_at = datetime.min.replace(tzinfo=UTC)

    def fresh(self, material: str, method: str) -> KnownModel | None:
        """The model in memory, if it may still be believed."""
        known = self._known.get((material, method))
        if known is None or known.until < time.monotonic() or known.read_at <= self._changed_at:
            return None
        return known

    def read(self, database: Database, material: str, method: str) -> KnownModel:
        """The model in the database; raises ``NotFound``, and ``Problem`` where the material has none."""
        read_at, until = datetime.now(UTC), time.monotonic() + self._seconds
        with database.read() as session:
            stored = friction_models.current(session, material, method)
            if stored is None:
                materials.find_id(session, material)
                detail = f"material {material!r} has no model fitted by {method!r} yet"
                raise Problem(NO_MODEL, detail, name="method", value=method, allowed="a method that was fitted")
        known = KnownModel(stored, to_friction_model(stored.model), _tag(stored), read_at, until)
        if len(self._known) >= MOST:
            self._known.clear()
        self._known[material, method] = known
        return known

    def seen(self, changed_at: datetime | None = None) -> None:
        """That models, or names of materials, changed at a moment (now), as can be seen in the database by now.

        What was read before, or might have been read before the change was committed, is read anew.
        """
        visible = datetime.now(UTC)
        if changed_at is not None:
            visible = min(visible, changed_at + COMMIT_TIME)
        self._changed_at = max(self._changed_at, visible)


def _tag(stored: StoredModel) -> str:
    identity = (stored.id, stored.material, stored.outdated)
    return f'"{hashlib.blake2b(repr(identity).encode(), digest_size=12).hexdigest()}"'
