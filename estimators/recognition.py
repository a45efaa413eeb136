"""Which material is this: by the exact predictive likelihood of a grasp's samples under each model."""

import math
from collections.abc import Callable, Mapping
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.arguments import above_zero, check_kind, check_number
from estimators.defaults import GRID, RECOGNITION, REFERENCE
from estimators.errors import InvalidSamples
from estimators.friction_model import FrictionModel
from estimators.linear.fit_data import FitData, GraspData, gather
from estimators.linear.least_squares import whole_triangle
from estimators.linear.log_sum import log_sum
from estimators.linear.place_errors import error_of_places
from estimators.linear.unknown_velocity import offset_variance
from slipcore.arguments import shown

FloatArray = NDArray[np.float64]
LogDensity: TypeAlias = Callable[[FloatArray], FloatArray]
"""Log density at log σ, in its shape."""

UNKNOWN = "unknown"

SLOPES = np.geomspace(1.0, RECOGNITION.least_slope, 4)
"""Sizes, as likely as each other, of the slopes of a surface of which nothing is known: many have next to none."""

_NODES = (np.arange(RECOGNITION.nodes) + 0.5) / RECOGNITION.nodes
"""Probabilities of the quantiles that stand for a scale that is not known exactly."""


def recognise(
    samples: GraspData,
    materials: Mapping[str, FrictionModel],
    prior: Mapping[str, float] | None = None,
    unknown: float = RECOGNITION.unknown,
) -> dict[str, float]:
    """Probability of each material, and of "unknown", for the samples of one grasp (or several of one thing).

    The likelihood is that of Gaussian errors: β of a material is normal with its model's covariance (and, where the
    model has ``scales``, scatter of the whole law between grasps, which is Student-t as few grasps are
    it, and what the grasp's places, of which it has only so many, shift; where the samples' velocities are unknown,
    what those change), σ² inverse-gamma with its degrees of freedom, all integrated out. "unknown" is the same for a
    surface of which only a population of materials is known: levels, slopes of several sizes, and scatter, each for
    itself. ``prior``: weights of the materials, alike where None; ``unknown``: prior probability that it is none of
    them.

    Raises ``InvalidSamples`` for no materials or models, one called "unknown", and a prior that does not fit them.
    """
    check_kind("materials", materials, Mapping)
    if not materials or UNKNOWN in materials:
        raise InvalidSamples("materials", sorted(materials), f'at least one, none of them called "{UNKNOWN}"')
    for name, model in materials.items():
        check_kind(f"model of {name}", model, FrictionModel)
    check_number("unknown", unknown, lambda value: 0.0 <= value < 1.0, "at least 0 and below 1")
    data, belief = gather(samples), _belief(materials, prior)
    places = error_of_places(data)
    log = {name: belief[name] + np.log1p(-unknown) + _of_material(data, places, materials[name]) for name in materials}
    log[UNKNOWN] = (np.log(unknown) if unknown > 0.0 else -np.inf) + _of_unknown(data)
    probability = special.softmax(np.array(list(log.values())))
    return dict(zip(log, map(float, probability), strict=True))


def log_predictive(
    triangle: FloatArray, effective_n: float, mean: FloatArray, covariance: FloatArray, scatter: LogDensity
) -> FloatArray:
    """Log density [...] of the data behind a triangle [4, 4] in (1, v, f_n | μ), up to what only the data decide.

    Normal about X β with variance ``least_scatter``² + σ²: β normal with ``mean`` [3] and ``covariance`` [..., 3, 3],
    integrated out in closed form, log σ with the density ``scatter``, summed over nodes. The two are apart: how far the
    law of a grasp or of a new surface may lie off has nothing to do with how much the grasp's own samples scatter.
    """
    turned, size, _ = np.linalg.svd(triangle[:, :3] @ _root(covariance))
    away = np.einsum("...ij,i->...j", turned, triangle[:, 3] - triangle[:, :3] @ mean) ** 2
    shared = np.append(size**2, np.zeros((*size.shape[:-1], 1)), axis=-1)
    least = RECOGNITION.least_scatter**2

    def log_density(log_sigma: FloatArray) -> FloatArray:
        variance = least + np.exp(2.0 * log_sigma)
        spread = variance[..., None] + shared[..., None, :]
        parts = (np.log(spread) + away[..., None, :] / spread).sum(axis=-1)
        return np.asarray(scatter(log_sigma) - 0.5 * (parts + (effective_n - 4.0) * np.log(variance)))

    most = 0.5 * np.log(least + REFERENCE.scatter**2 + away.sum(axis=-1) / effective_n)
    return _integral(log_density, np.full_like(most, 0.5 * np.log(least)) - RECOGNITION.reach, most + RECOGNITION.reach)


def _root(covariance: FloatArray) -> FloatArray:
    """R [..., 3, 3] with R Rᵀ the covariance, which may be singular, and of any units."""
    size = np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1))
    size = np.where(size > 0.0, size, 1.0)
    values, vectors = np.linalg.eigh(covariance / (size[..., :, None] * size[..., None, :]))
    return np.asarray(size[..., :, None] * vectors * np.sqrt(np.maximum(values, 0.0))[..., None, :])


def _integral(log_density: LogDensity, low: FloatArray, high: FloatArray) -> FloatArray:
    """Log of the integrals [...] of a density between ``low`` and ``high`` [...], over nodes that close in on it."""
    for _ in range(RECOGNITION.rounds):
        nodes = np.linspace(low, high, RECOGNITION.scatter_nodes, axis=-1)
        log = log_density(nodes)
        matters = log > log.max(axis=-1, keepdims=True) - GRID.depth
        first, last = np.argmax(matters, axis=-1), np.argmax(matters[..., ::-1], axis=-1)
        step = (high - low) / (RECOGNITION.scatter_nodes - 1)
        low, high = low + step * np.maximum(first - 1, 0), high - step * np.maximum(last - 1, 0)
    return np.asarray(log_sum(log, axis=-1) + np.log(step))


def _belief(materials: Mapping[str, FrictionModel], prior: Mapping[str, float] | None) -> dict[str, float]:
    allowed = f"a weight above 0 for each of {sorted(materials)}"
    weight = dict.fromkeys(materials, 1.0) if prior is None else prior
    if not isinstance(weight, Mapping) or set(weight) != set(materials):
        raise InvalidSamples("prior", shown(prior), allowed)
    for value in weight.values():
        check_number("prior", value, above_zero, allowed)
    total = sum(weight.values())
    return {name: float(np.log(value / total)) for name, value in weight.items()}


def _of_material(data: FitData, places: FloatArray, model: FrictionModel) -> float:
    triangle, size = whole_triangle(data.factor).astype(float), np.ones(3)
    size[2] = model.element_area / data.element_area  # the same pressure on an element of the model's area
    triangle[:, :3] *= size
    shared = _shared(data, places / np.outer(size, size), model)
    found = log_predictive(triangle, data.effective_n, model.coefficients, shared, _known(*_scatter(model)))
    return float(log_sum(found) - np.log(len(found)))


def _known(scale: float, freedom: float, spread: float = RECOGNITION.scatter_spread) -> LogDensity:
    """Of log σ of a grasp of a material: Student-t about that of what ``scale``² has above the least of any material.

    It is as wide as ``scale`` is uncertain by its ``freedom``, and by ``spread`` from grasp to grasp: most of what
    samples scatter by is noise of forces over f_n, which goes with the load and not with the material.
    """
    least, tail = RECOGNITION.least_scatter, RECOGNITION.spread_freedom
    own = 0.5 * math.log(max(scale**2 - least**2, (RECOGNITION.rounding * least) ** 2))
    width = math.hypot(spread, 1.0 / math.sqrt(2.0 * min(freedom, GRID.most_freedom)))
    whole = -math.log(width) - 0.5 * math.log(tail) - float(special.betaln(0.5, 0.5 * tail))

    def log_density(log_sigma: FloatArray) -> FloatArray:
        away = (log_sigma - own) / width
        return np.asarray(whole - 0.5 * (tail + 1.0) * np.log1p(away**2 / tail))

    return log_density


def _of_the_population(log_sigma: FloatArray) -> FloatArray:
    """Of log σ of a surface of which nothing is known: σ half-Student-t, its scale the reference scatter."""
    deviation, freedom = np.exp(log_sigma) / REFERENCE.scatter, RECOGNITION.scatter_freedom
    whole = math.log(2.0) - 0.5 * math.log(freedom) - float(special.betaln(0.5, 0.5 * freedom))
    return np.asarray(whole + np.log(deviation) - 0.5 * (freedom + 1.0) * np.log1p(deviation**2 / freedom))


def _scatter(model: FrictionModel) -> tuple[float, float]:
    """Scatter of a sample in a grasp of the material, and its degrees of freedom (Satterthwaite, 1946)."""
    if model.scales is None:
        return model.scale, model.scatter_degrees_of_freedom
    places, within = model.scales.between_places, model.scales.within
    parts = [each.value**2 for each in (places, within)]
    lost = parts[0] ** 2 / places.degrees_of_freedom + parts[1] ** 2 / within.degrees_of_freedom
    return math.sqrt(sum(parts)), sum(parts) ** 2 / lost if lost > 0.0 else float(model.n)


def _shared(data: FitData, places: FloatArray, model: FrictionModel) -> FloatArray:
    """Covariances [k, 3, 3] of a grasp's β, as likely as each other."""
    covariance = model.covariance.copy()
    if data.unknown_velocity > 0.0:
        slope, variance = float(model.coefficients[1]), float(model.covariance[1, 1])
        covariance[0, 0] += offset_variance(data.mean_friction, slope, variance)
    if model.scales is None:
        return covariance[None]
    covariance += model.scales.between_places.value**2 * places
    between = model.scales.between_grasps
    square = np.outer(model.coefficients, model.coefficients)
    if model.scales.between_sensors is not None:
        covariance += model.scales.between_sensors.scale.value**2 * square
    law = between.value**2 * square
    if not math.isfinite(between.degrees_of_freedom):
        return (covariance + law)[None]
    ratio = between.degrees_of_freedom / special.chdtri(between.degrees_of_freedom, _NODES)
    return np.asarray(covariance + ratio[:, None, None] * law)


def _of_unknown(data: FitData) -> float:
    spans = np.concatenate([[1.0], REFERENCE.spans(data.element_area)])
    slope = RECOGNITION.slope * SLOPES
    deviations = np.stack([np.full_like(slope, RECOGNITION.level), slope, slope], axis=1) / spans
    mean = np.array([REFERENCE.friction, 0.0, 0.0])
    covariance = deviations[:, :, None] ** 2 * np.eye(3)
    found = log_predictive(
        whole_triangle(data.factor).astype(float), data.effective_n, mean, covariance, _of_the_population
    )
    return float(log_sum(found) - np.log(len(found)))
