"""What a page says of a stored model: its friction at a working point, with the interval that a new grasp shows."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from db.records import Material, StoredModel
from service.domain.models.recommended import disagreeing, recommended
from service.domain.models.stored_results import to_friction_model
from service.domain.planning.record_next import RecordNext, record_next
from service.formatting import number
from service.report.wording import COEFFICIENTS, LEVELS, expected_friction
from service.web.charts import Chart, Curve, draw
from stiction_client.support import OUTDATED, Support

POINTS = 61
"""At which a section is computed."""

BEYOND = 1.25
"""How far past the data a section is drawn, as a factor."""


@dataclass(frozen=True, slots=True)
class FrictionEstimate:
    """Friction coefficient at a tangential velocity, m/s, and a normal force of an element, N, with its interval; None
    where the law falls below 0, far outside of the data, and nothing is known.

    ``disagreement`` with the material's models by other methods, where there is any; ``notes``: what else is to be
    known of the model.
    """

    tangential_velocity: float
    normal_force: float
    mean: float | None
    interval: tuple[float, float] | None
    support: Support
    disagreement: str | None = None
    notes: tuple[str, ...] = ()


def usual_model(models: Sequence[StoredModel], method: str | None = None) -> StoredModel | None:
    """The model of a method; without one, the recommended model, or else the first there is."""
    if method is not None:
        return {stored.model.method: stored for stored in models}.get(method)
    best = recommended(models)
    return next(iter(models), None) if best is None else best.stored


def middle_force(stored: StoredModel) -> float:
    """The middle of the normal forces that the model's samples have, N an element."""
    return 0.5 * sum(stored.model.normal_force)


def friction_at(
    stored: StoredModel,
    normal_force: float | None,
    tangential_velocity: float = 0.0,
    others: Sequence[StoredModel] = (),
) -> FrictionEstimate:
    """Friction of a model; without a normal force, in the middle of what its samples have.

    ``others``: current models of the same material, with which it may disagree.
    """
    model = to_friction_model(stored.model)
    v, f_n = tangential_velocity, middle_force(stored) if normal_force is None else normal_force
    low, high = (float(model.predict(v, f_n, quantile=level)) for level in LEVELS)
    support = model.support_at(v, f_n, OUTDATED if stored.outdated else None)
    mean, apart = float(model.predict(v, f_n)), disagreeing(stored, others)
    shown, interval = (mean, (low, high)) if mean > 0.0 else (None, None)
    return FrictionEstimate(v, f_n, shown, interval, support, apart, model.notes)


def next_of(stored: StoredModel, at: FrictionEstimate) -> RecordNext | None:
    """What to record next to know friction ``at`` its working point; None without a normal force."""
    if not at.normal_force > 0.0:
        return None
    return record_next(stored, at.normal_force, at.tangential_velocity)


@dataclass(frozen=True, slots=True)
class Listed:
    """A material in a list, with the model that is shown and its friction, where it has one."""

    material: Material
    stored: StoredModel | None
    friction: FrictionEstimate | None

    @property
    def grasps(self) -> int:
        """Logs that are not withdrawn."""
        return self.material.grasp_logs - self.material.withdrawn_grasp_logs


def listed(material: Material, normal_force: float | None) -> Listed:
    """A material as a list shows it."""
    stored = usual_model(material.models)
    return Listed(material, stored, None if stored is None else friction_at(stored, normal_force))


@dataclass(frozen=True, slots=True)
class Coefficient:
    """A coefficient of a model with its meaning, its 95 % interval, and whether the data determine it."""

    symbol: str
    meaning: str
    unit: str
    value: float
    interval: tuple[float, float]
    is_told: bool


def coefficients(stored: StoredModel) -> list[Coefficient]:
    """What μ = β₀ + β₁ v + β₂ f_n + ε is made of."""
    model = to_friction_model(stored.model)
    numbers = zip(model.coefficients.tolist(), model.interval(0.95).tolist(), model.identifiable.tolist(), strict=True)
    return [
        Coefficient(*words, value, (low, high), identifiable)
        for words, (value, (low, high), identifiable) in zip(COEFFICIENTS, numbers, strict=True)
    ]


def sections(stored: StoredModel, at: FrictionEstimate) -> list[Chart]:
    """Friction over normal force and, where any is known or asked for, over velocity, through the point ``at``."""
    forces, velocities = stored.model.normal_force, stored.model.tangential_velocity
    f_n = np.linspace(0.0, max(BEYOND * forces[1], at.normal_force), POINTS)
    v = np.linspace(0.0, max(BEYOND * velocities[1], at.tangential_velocity), POINTS)
    over_force = _Section(f_n, forces, at.normal_force, "normal force on an element, N")
    over_velocity = _Section(v, velocities, at.tangential_velocity, "tangential velocity, m/s")
    charts = [
        _chart(stored, over_force, at.tangential_velocity, f_n, f"At velocity {number(at.tangential_velocity)} m/s")
    ]
    if v[-1] > 0.0:
        charts.append(
            _chart(stored, over_velocity, v, at.normal_force, f"At a normal force of {number(at.normal_force)} N")
        )
    return charts


@dataclass(frozen=True, slots=True, eq=False)
class _Section:
    """Along what a section runs: values ``x`` [n], the range of the data, the working point, and the axis' label."""

    x: NDArray[np.float64]
    seen: tuple[float, float]
    marked: float
    label: str


def _chart(stored: StoredModel, along: _Section, v: ArrayLike, f_n: ArrayLike, title: str) -> Chart:
    model = to_friction_model(stored.model)
    low, high = (model.predict(v, f_n, quantile=level).tolist() for level in LEVELS)
    mean = expected_friction(model, v, f_n).tolist()
    x = along.x.tolist()
    return draw(Curve(x, mean, low, high, along.seen, along.marked, along.label, "friction coefficient μ", title))
