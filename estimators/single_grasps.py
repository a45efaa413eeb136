"""How far single grasps lie off their material's friction model."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.defaults import IDENTIFIABILITY
from estimators.errors import InvalidSamples
from estimators.friction_model import FrictionModel
from estimators.linear.grasp_statistics import GraspStatistics
from estimators.linear.statistics import SufficientStatistics
from estimators.linear.unknown_velocity import columns_off, offset_variance

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class GraspEffect:
    """By which part of itself friction in one grasp differs from the model's, with its 95 % ``interval``.

    ``velocity_unknown``: its samples know only velocities relative to what seems to stick.
    """

    value: float
    interval: tuple[float, float]
    velocity_unknown: bool


def grasp_effects(model: FrictionModel, moments: Sequence[SufficientStatistics]) -> list[GraspEffect]:
    """The effect u of each grasp in μ = (1 + u)(β₀ + β₁ v + β₂ f_n) + p + ε, from the moments of its samples.

    Given the model's scales, u, the places' p and ε are normal, and so is u given β and the samples (Searle et al.,
    1992, ch. 7): its mean shrinks towards 0 where they say little. The interval holds the uncertainty of β, too, and
    not that of the scales. A grasp is compared with what its sensor shows, where the model knows that.
    Raises ``InvalidSamples`` for a model without ``scales``, and for moments that are not those of one grasp, place by
    place.
    """
    if model.scales is None:
        raise InvalidSamples("model", f"by {model.method}, without scales", "one that separates scatter between grasps")
    if not moments:
        return []
    grasps = [_only_grasp(part.at_element_area(model.element_area)) for part in moments]
    unit = sum(each.total_weight for each in grasps) / sum(each.weight_square for each in grasps)
    return [_effect(model.of_sensor(grasp.sensor), grasp, unit) for grasp in grasps]


def _only_grasp(moments: SufficientStatistics) -> GraspStatistics:
    if len(moments.grasps) != 1:
        raise InvalidSamples("moments", f"of {len(moments.grasps)} grasps", "those of one grasp, place by place")
    return moments.grasps[0]


def _effect(model: FrictionModel, grasp: GraspStatistics, unit: float) -> GraspEffect:
    """Of one grasp; its weights are in units of ``unit``."""
    assert model.scales is not None
    law, residual = np.append(model.coefficients, 0.0), np.append(-model.coefficients, 1.0)
    square = _square(grasp, unit, model.scales.between_places.value, model.scales.within.value)
    projected = square @ law
    before = model.scales.between_grasps.value**2
    variance = before / (1.0 + before * float(projected @ law))
    value = float(variance * (projected @ residual))
    gradient = -variance * projected[:3]
    own = variance + (_offset_variance(model, grasp, gradient) if grasp.velocity_unknown else 0.0)
    level = IDENTIFIABILITY.ends[1]
    uncertain = special.stdtrit(model.degrees_of_freedom, level) ** 2 * (gradient @ model.covariance @ gradient)
    half = float(np.sqrt(special.ndtri(level) ** 2 * own + uncertain))
    return GraspEffect(value, (value - half, value + half), grasp.velocity_unknown)


def _square(grasp: GraspStatistics, unit: float, places: float, within: float) -> FloatArray:
    """Σ x xᵀ [4, 4] over the samples' x = (1, v, f_n, μ), by the inverse covariance of what adds to the law.

    The mean of a place of weight W has the variance ω² + σ²/W, a deviation from it σ²/w; that of an only place shows
    nothing of its grasp (``linear.hierarchical``).
    """
    inverse = 1.0 / (places**2 + within**2 / (unit * grasp.weight))
    means = np.sqrt(inverse * grasp.independent)[:, None] * np.column_stack([np.ones(len(grasp.mean)), grasp.mean])
    spread = (np.sqrt(inverse * grasp.share)[:, None, None] * grasp.spread).reshape(-1, 3)
    per_deviation = 0.0 if grasp.of_one_place else np.sqrt(unit) / within
    deviations = np.concatenate([spread, per_deviation * grasp.within])
    rows = np.concatenate([means, np.pad(deviations, ((0, 0), (1, 0)))])
    return np.asarray(rows.T @ rows)


def _offset_variance(model: FrictionModel, grasp: GraspStatistics, gradient: FloatArray) -> float:
    """What not knowing the velocities adds to the variance of u."""
    force = float(grasp.weight * grasp.count @ grasp.mean[:, 1] / (grasp.weight @ grasp.count))
    friction = float(model.coefficients @ [1.0, 0.0, force])
    offset = offset_variance(friction, float(model.coefficients[1]), float(model.covariance[1, 1]))
    return float(offset * np.square(columns_off(force) @ gradient).sum())
