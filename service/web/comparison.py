"""Several stored models side by side: of different materials, or versions of one."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from db.records import StoredModel
from service.domain.models.stored_results import to_friction_model
from service.report.wording import LEVELS, expected_friction
from service.web.charts import Curve, ManyChart, draw_together
from service.web.friction import POINTS, FrictionEstimate, friction_at

MOST_COMPARED = 6
"""Models in one picture: so many colours are told apart."""


@dataclass(frozen=True, slots=True)
class ComparedModel:
    """A model, and its friction where all of them are compared."""

    stored: StoredModel
    friction: FrictionEstimate


def compare(models: Sequence[StoredModel], normal_force: float) -> list[ComparedModel]:
    """Each with its friction at the beginning of slip under this normal force, N an element."""
    return [ComparedModel(stored, friction_at(stored, normal_force)) for stored in models]


def common_force(models: Sequence[StoredModel]) -> float:
    """The middle of the normal forces that the data of all have, N an element; where none are common, that between."""
    lows, highs = zip(*(stored.model.normal_force for stored in models), strict=True)
    return float(0.5 * (max(lows) + min(highs)))


def picture(models: Sequence[StoredModel], normal_force: float) -> ManyChart:
    """Friction over normal force, each with its band and as far as its data reach."""
    return draw_together([_curve(stored, normal_force) for stored in models])


def _curve(stored: StoredModel, marked: float) -> Curve:
    model, seen = to_friction_model(stored.model), stored.model.normal_force
    f_n = np.linspace(*seen, POINTS)
    low, high = (model.predict(0.0, f_n, quantile=level).tolist() for level in LEVELS)
    labels = "normal force on an element, N", "friction coefficient μ", "Friction over normal force, at velocity 0"
    return Curve(f_n.tolist(), expected_friction(model, 0.0, f_n).tolist(), low, high, seen, marked, *labels)
