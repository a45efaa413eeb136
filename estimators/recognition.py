"""Which material is this: by the exact predictive likelihood of a grasp's samples under each model."""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.defaults import RECOGNITION, REFERENCE
from estimators.errors import InvalidSamples
from estimators.friction_model import FrictionModel
from estimators.linear.fit_data import FitData, GraspData, gather
from estimators.linear.least_squares import upper_triangle, whole_triangle
from estimators.linear.place_errors import error_of_places
from estimators.linear.unknown_velocity import offset_variance

FloatArray = NDArray[np.float64]

UNKNOWN = "unknown"

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
    model tells its ``scales``, scatter of the whole law between grasps, which is Student-t as far as few grasps tell
    it, and what the grasp's places, of which it has only so many, shift; where the samples' velocities are unknown,
    what those change), σ² inverse-gamma with its degrees of freedom, all integrated out. "unknown" is the same for a
    surface of which only a population of materials is known. ``prior``: weights of the materials, alike where None;
    ``unknown``: prior probability that it is none of them.

    Raises ``InvalidSamples`` for no materials, one called "unknown", and a prior that does not fit them.
    """
    if not materials or UNKNOWN in materials:
        raise InvalidSamples("materials", sorted(materials), f'at least one, none of them called "{UNKNOWN}"')
    if not 0.0 <= unknown < 1.0:
        raise InvalidSamples("unknown", unknown, "at least 0 and below 1")
    data, belief = gather(samples), _belief(materials, prior)
    places = error_of_places(data)
    log = {name: belief[name] + np.log1p(-unknown) + _of_material(data, places, materials[name]) for name in materials}
    log[UNKNOWN] = (np.log(unknown) if unknown > 0.0 else -np.inf) + _of_unknown(data)
    probability = special.softmax(np.array(list(log.values())))
    return dict(zip(log, map(float, probability), strict=True))


def log_predictive(
    triangle: FloatArray, effective_n: float, mean: FloatArray, covariance: FloatArray, scale: float, freedom: float
) -> float:
    """Log density of the data behind a triangle [4, 4] in (1, v, f_n | μ), up to what only the data decide.

    Multivariate Student-t on ``freedom`` degrees of freedom (infinite: normal) about X ``mean`` with scale matrix
    ``scale``² I + X ``covariance`` Xᵀ (Gelman et al., BDA3, §14.2), through a factor of 7 × 4: nothing of the size n is
    formed.
    """
    values, vectors = np.linalg.eigh(covariance / scale**2)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    rows = np.column_stack([triangle[:, :3] @ root, triangle[:, 3] - triangle[:, :3] @ mean])
    updated = upper_triangle(np.concatenate([np.eye(3, 4), rows]))
    square, determinant = float(updated[3, 3] / scale) ** 2, np.log(np.diag(updated)[:3]).sum()
    if math.isinf(freedom):
        return float(-0.5 * effective_n * np.log(2.0 * scale**2) - determinant - 0.5 * square)
    total = freedom + effective_n
    return float(
        special.gammaln(0.5 * total)
        - special.gammaln(0.5 * freedom)
        - 0.5 * effective_n * np.log(freedom * scale**2)
        - determinant
        - 0.5 * total * np.log1p(square / freedom)
    )


def _belief(materials: Mapping[str, FrictionModel], prior: Mapping[str, float] | None) -> dict[str, float]:
    weight = dict.fromkeys(materials, 1.0) if prior is None else dict(prior)
    if set(weight) != set(materials) or not all(value > 0.0 for value in weight.values()):
        raise InvalidSamples("prior", prior, f"a weight above 0 for each of {sorted(materials)}")
    total = sum(weight.values())
    return {name: float(np.log(value / total)) for name, value in weight.items()}


def _of_material(data: FitData, places: FloatArray, model: FrictionModel) -> float:
    triangle, size = whole_triangle(data.factor).astype(float), np.ones(3)
    size[2] = model.element_area / data.element_area  # the same pressure on an element of the model's area
    triangle[:, :3] *= size
    floor = RECOGNITION.least_scatter * max(
        abs(float(data.mean_friction)), RECOGNITION.least_scatter
    )  # a model without scatter still meets rounded data
    scale, freedom = _scatter(model)
    shared = _shared(data, places / np.outer(size, size), model)
    found = [
        log_predictive(triangle, data.effective_n, model.coefficients, each, max(scale, floor), freedom)
        for each in shared
    ]
    return float(special.logsumexp(found) - np.log(len(found)))


def _scatter(model: FrictionModel) -> tuple[float, float]:
    """Scatter of a sample in a grasp of the material, and its degrees of freedom (Satterthwaite, 1946)."""
    if model.scales is None:
        return model.scale, model.scatter_degrees_of_freedom
    places, within = model.scales.between_places, model.scales.within
    parts = [each.value**2 for each in (places, within)]
    lost = parts[0] ** 2 / places.degrees_of_freedom + parts[1] ** 2 / within.degrees_of_freedom
    return math.sqrt(sum(parts)), sum(parts) ** 2 / lost if lost > 0.0 else float(model.n)


def _shared(data: FitData, places: FloatArray, model: FrictionModel) -> list[FloatArray]:
    """Covariances of a grasp's β, as likely as each other."""
    covariance = model.covariance.copy()
    if data.unknown_velocity > 0.0:
        slope, variance = float(model.coefficients[1]), float(model.covariance[1, 1])
        covariance[0, 0] += offset_variance(data.mean_friction, slope, variance)
    if model.scales is None:
        return [covariance]
    covariance += model.scales.between_places.value**2 * places
    between = model.scales.between_grasps
    law = between.value**2 * np.outer(model.coefficients, model.coefficients)
    if not math.isfinite(between.degrees_of_freedom):
        return [covariance + law]
    ratio = between.degrees_of_freedom / special.chdtri(between.degrees_of_freedom, _NODES)
    return [covariance + each * law for each in ratio]


def _of_unknown(data: FitData) -> float:
    spans = np.concatenate([[1.0], REFERENCE.spans(data.element_area)])
    return log_predictive(
        whole_triangle(data.factor).astype(float),
        data.effective_n,
        np.array([REFERENCE.friction, 0.0, 0.0]),
        np.diag((np.array([RECOGNITION.level, RECOGNITION.slope, RECOGNITION.slope]) / spans) ** 2),
        REFERENCE.scatter,
        RECOGNITION.scatter_freedom,
    )
