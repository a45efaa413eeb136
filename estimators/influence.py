"""Which grasp lowers the friction that a planner may count on: fits with one grasp left out."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from estimators.defaults import INFLUENCE
from estimators.errors import EstimatorError
from estimators.fitting import fit
from estimators.friction_model import FrictionModel
from estimators.grasp_design import WorkingPoint
from estimators.linear.priors import WEAK, ScatterPrior
from estimators.linear.statistics import SufficientStatistics
from estimators.single_grasps import grasp_effects


class Influence(NamedTuple):
    """A grasp's ``place`` among the moments, by which part its friction differs from the model's (``effect``), and the
    friction that a planner may count on with all grasps and ``without`` this one.
    """

    place: int
    effect: float
    friction: float
    without: float


def counted_on(model: FrictionModel, at: WorkingPoint, sensor: str | None = None) -> float:
    """Friction that a planner may count on: the quantile of a contact's mean at its working point, at least 0.

    ``sensor``: that which grasps; without, any.
    """
    elements = float(at.elements)
    model = model if sensor is None else model.of_sensor(sensor)
    return float(model.predict(at.tangential_velocity, at.normal_force, at.quantile, of="contact", elements=elements))


def most_lowering(
    model: FrictionModel,
    moments: Sequence[SufficientStatistics],
    at: WorkingPoint,
    scatter_prior: ScatterPrior = WEAK,
    sensor: str | None = None,
) -> Influence | None:
    """The grasp without which a planner may count on most; None where that is on no more than with all of them.

    Of the newest, the last of the ``moments`` [grasps], and those of least and of most friction: an odd grasp of either
    kind makes all seem to scatter. Each is left out of a fit by the hierarchical model, in tens of milliseconds.
    ``sensor``: that by which the planner grasps; without, any. Raises ``InvalidSamples`` for a model without
    ``scales``.
    """
    effects = np.array([each.value for each in grasp_effects(model, moments)])
    order = np.argsort(effects, kind="stable")
    candidates = {len(moments) - 1, *order[: INFLUENCE.lowest].tolist(), *order[-1:].tolist()}
    friction = counted_on(fit(moments, "hierarchical", scatter_prior=scatter_prior), at, sensor)
    best = None
    for index in sorted(candidates):
        rest = [part for k, part in enumerate(moments) if k != index]
        try:
            without = counted_on(fit(rest, "hierarchical", scatter_prior=scatter_prior), at, sensor)
        except EstimatorError:  # too few samples are left to say
            continue
        if without > (friction if best is None else best.without):
            best = Influence(index, float(effects[index]), friction, without)
    return best
