"""What a page tells of a stored model: its friction at a working point, with the interval that a new grasp shows."""

from collections.abc import Sequence
from dataclasses import dataclass

from db.records import Material, StoredModel
from service.domain.stored_results import to_friction_model
from service.http.schemas.models import LookUpQuery

USUAL_METHOD = LookUpQuery.model_fields["method"].default
LEVELS = (0.05, 0.95)
"""Quantiles between which 90 % of new observations are expected."""


@dataclass(frozen=True, slots=True)
class Friction:
    """Friction coefficient at a tangential velocity, m/s, and a normal force of an element, N, with its interval."""

    tangential_velocity: float
    normal_force: float
    mean: float
    interval: tuple[float, float]
    warning: str | None


def usual_model(models: Sequence[StoredModel], method: str | None = None) -> StoredModel | None:
    """The model of a method; without one, that which look-ups use, or else the first there is."""
    by_method = {stored.model.method: stored for stored in models}
    if method is not None:
        return by_method.get(method)
    return by_method.get(USUAL_METHOD) or next(iter(models), None)


def middle_force(stored: StoredModel) -> float:
    """The middle of the normal forces that the model's samples have, N an element."""
    return 0.5 * sum(stored.model.normal_force)


def friction_at(stored: StoredModel, normal_force: float | None, tangential_velocity: float = 0.0) -> Friction:
    """Friction of a model; without a normal force, in the middle of what its samples have."""
    model = to_friction_model(stored.model)
    v, f_n = tangential_velocity, middle_force(stored) if normal_force is None else normal_force
    low, high = (max(0.0, float(model.predict(v, f_n, quantile=level))) for level in LEVELS)
    return Friction(v, f_n, float(model.predict(v, f_n)), (low, high), model.extrapolation(v, f_n))


@dataclass(frozen=True, slots=True)
class Listed:
    """A material in a list, with the model that is told of and its friction, where it has one."""

    material: Material
    stored: StoredModel | None
    friction: Friction | None

    @property
    def grasps(self) -> int:
        """Logs that are not withdrawn."""
        return self.material.grasp_logs - self.material.withdrawn_grasp_logs


def listed(material: Material, normal_force: float | None) -> Listed:
    """A material as a list tells of it."""
    stored = usual_model(material.models)
    return Listed(material, stored, None if stored is None else friction_at(stored, normal_force))
