"""Robust regression: a high-breakdown start, then Huber's or Tukey's M-estimate with cluster-robust errors."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import NORMAL_MAD, REFERENCE, ROBUST
from estimators.linear.cluster_errors import cluster_sums
from estimators.linear.coefficient_errors import CoefficientErrors, clustered_errors
from estimators.linear.fit_data import FitData
from estimators.linear.least_squares import LinearFit, factorise, solve, triangular_inverse, upper_triangle
from estimators.linear.observations import Observations
from estimators.linear.orthonormal import orthonormal
from slipcore.medians import medians

FloatArray = NDArray[np.float64]


class Loss(NamedTuple):
    """An M-estimator: ``weight`` ψ(u)/u and ``slope`` ψ'(u); tuned to 95 % efficiency at normal errors."""

    weight: Callable[[FloatArray], FloatArray]
    slope: Callable[[FloatArray], FloatArray]


def _tukey_weight(u: FloatArray, c: float = ROBUST.tukey) -> FloatArray:
    return np.asarray(np.square(np.maximum(1.0 - np.square(u / c), 0.0)))


def _tukey_slope(u: FloatArray, c: float = ROBUST.tukey) -> FloatArray:
    square = np.square(np.minimum(np.abs(u) / c, 1.0))  # at most 1: far outliers do not overflow
    return np.asarray((1.0 - square) * (1.0 - 5.0 * square))


LOSSES = {
    "huber": Loss(
        lambda u: ROBUST.huber / np.maximum(np.abs(u), ROBUST.huber),
        lambda u: (np.abs(u) <= ROBUST.huber).astype(float),
    ),
    "tukey": Loss(_tukey_weight, _tukey_slope),
}


class Plane(NamedTuple):
    """Coefficients [r] in the orthonormal design, and the robust scale of the residuals about them."""

    coefficients: FloatArray
    scale: float


class MEstimate(NamedTuple):
    """The weighted least squares that an M-estimate is, ``linear``, with cluster-robust ``errors``.

    ``scale`` of the errors; ``downweighted``: part of the samples with less than half weight; ``settled``: whether the
    iteration came to rest.
    """

    linear: LinearFit
    errors: CoefficientErrors
    scale: float
    downweighted: float
    settled: bool


def m_estimate(data: FitData, observations: Observations, loss: Loss, seed: int = 0) -> MEstimate:
    """MM-estimate (Yohai, 1987): least trimmed squares from random elemental fits, then an M-step with its scale fixed.

    It breaks down at half of the samples; outliers that lie clear of the plane hardly move it, be they one or 45 %.
    The errors are CR2 of the weighted fit, times what the loss adds, with Satterthwaite's degrees of freedom.
    """
    linear = solve(data.factor, REFERENCE.spans(data.element_area))
    design, _ = orthonormal(observations, linear)
    root = np.sqrt(observations.weight)
    response = observations.friction - np.median(observations.friction)  # not least squares' residual: it may be 1e12
    plain = design / root[:, None]
    start = rescaled(plain, response, high_breakdown(plain, response, np.random.default_rng(seed)))
    plane, weight, settled = _m_step(design, root * response, root, start, loss)
    return _weighted_fit(observations, weight, plane, loss, settled)


def high_breakdown(design: FloatArray, response: FloatArray, rng: np.random.Generator) -> Plane:
    """Plane that half of the samples lie closest to (least trimmed squares; Rousseeuw & Van Driessen, 2006).

    ``design`` [n, r] and ``response`` [n]. Elemental fits are compared on at most ``subset_samples`` samples by their
    median residual; the best of the five best is improved on all.
    """
    count, size = design.shape
    rows = rng.integers(0, count, (ROBUST.subsets, size))
    regular = np.linalg.cond(design[rows]) < ROBUST.regular
    elemental = np.linalg.solve(design[rows[regular]], response[rows[regular], None])[..., 0]
    elemental = np.vstack([elemental, _least_squares(design, response)])  # should no subset be regular
    shown = rng.choice(count, min(count, ROBUST.subset_samples), replace=False)
    median = medians(np.abs(response[shown] - elemental @ design[shown].T))
    best = elemental[np.argsort(median)[: ROBUST.improved]]
    planes = [_concentrate(design[shown], response[shown], coefficients) for coefficients in best]
    return _concentrate(design, response, min(planes, key=lambda plane: plane.scale).coefficients)


def rescaled(design: FloatArray, response: FloatArray, start: Plane) -> Plane:
    """The start, its scale freed of outliers: that of what lies within ``near`` scales, again until it stays the same.

    The median residual is that of the best half; with 45 % of outliers it is 2.5 times too large, and an M-estimate
    that trusts it takes the nearer outliers for good samples. A tighter loss finds the scale of the rest, by itself no
    smaller than what half of the samples could have been inflated by.
    """
    least = _least_scale(response)
    loss, plane = Loss(*(partial(rule, c=ROBUST.near) for rule in (_tukey_weight, _tukey_slope))), start
    consistent = normal_square(loss)
    for _ in range(ROBUST.iterations):
        known = max(plane.scale, least)
        u = (response - design @ plane.coefficients) / known
        weight = loss.weight(u)
        half = np.sqrt(weight)
        scale = known * float(np.sqrt(np.average(u**2, weights=weight) / consistent))
        moved = Plane(
            _least_squares(design * half[:, None], response * half), max(scale, start.scale / ROBUST.inflated)
        )
        if abs(moved.scale - plane.scale) <= ROBUST.scale_tolerance * plane.scale:
            return moved
        plane = moved
    return plane


def _least_scale(response: FloatArray) -> float:
    """Below it a scale is rounding: most samples may lie on the plane to the last digit, or all have one friction."""
    size = np.abs(response[response != 0.0])
    return max(ROBUST.least_scale * float(np.median(size)), np.finfo(float).tiny) if size.size else np.finfo(float).tiny


def _concentrate(design: FloatArray, response: FloatArray, coefficients: FloatArray) -> Plane:
    """Refit to the closer half until it stays the same."""
    half = (len(response) + design.shape[1] + 1) // 2
    for _ in range(ROBUST.concentrations):
        closest = np.argpartition(np.abs(response - design @ coefficients), half - 1)[:half]
        moved = _least_squares(design[closest], response[closest])
        if np.allclose(moved, coefficients, rtol=ROBUST.same, atol=0.0):
            break
        coefficients = moved
    distance = np.sort(np.abs(response - design @ coefficients))
    return Plane(coefficients, float(distance[half - 1] / NORMAL_MAD))


def _least_squares(design: FloatArray, response: FloatArray) -> FloatArray:
    triangle = upper_triangle(np.column_stack([design, response]))
    return np.asarray(triangular_inverse(triangle[:-1, :-1]) @ triangle[:-1, -1], dtype=float)


def _m_step(
    design: FloatArray, residual: FloatArray, root: FloatArray, start: Plane, loss: Loss
) -> tuple[Plane, FloatArray, bool]:
    """Iteratively reweighted least squares from the start, its scale kept; the weights [n], and whether it settled."""
    coefficients = start.coefficients
    scale = max(start.scale, _least_scale(residual / root))
    for _ in range(ROBUST.iterations):
        weight = loss.weight((residual - design @ coefficients) / root / scale)
        half = np.sqrt(weight)
        moved = _least_squares(design * half[:, None], residual * half)
        step = float(np.linalg.norm(moved - coefficients))
        coefficients = moved
        rounding = ROBUST.rounding * np.finfo(float).eps * float(np.linalg.norm(moved))
        if step <= max(ROBUST.step_tolerance * scale * np.sqrt(len(coefficients)), rounding):
            return Plane(coefficients, scale), weight, True
    return Plane(coefficients, scale), weight, False


def normal_square(loss: Loss) -> float:
    """Mean of u² under the loss's weights at standard normal u: what makes a weighted variance consistent."""
    u = np.linspace(-ROBUST.reach, ROBUST.reach, ROBUST.nodes)
    weight = loss.weight(u) * np.exp(-0.5 * u**2)
    return float(weight @ u**2 / weight.sum())


def _weighted_fit(observations: Observations, weight: FloatArray, plane: Plane, loss: Loss, settled: bool) -> MEstimate:
    """The M-estimate as weighted least squares, whose sandwich wants ψ' in place of ψ(u)/u."""
    used = weight > 0.0
    kept = observations.take(used, observations.weight[used] * weight[used])
    linear = solve(factorise(kept.columns(), kept.weight), REFERENCE.spans(observations.element_area))
    design, residual = orthonormal(kept, linear)
    u = residual / np.sqrt(kept.weight) / plane.scale
    base = observations.weight[used]
    correction = float(base @ weight[used] / max(base @ loss.slope(u), ROBUST.least_slope * (base @ weight[used])))
    scale = plane.scale * float(np.sqrt(np.average(u**2, weights=kept.weight) / normal_square(loss)))
    downweighted = float(np.average(weight < 0.5, weights=observations.weight))
    sums = cluster_sums([(design, residual, kept.cluster)], kept.clusters)
    errors = clustered_errors(linear, *sums, scale, max(observations.effective_n - 1.0 - linear.rank, 1.0))
    corrected = linear.prior_covariance + correction**2 * (errors.covariance - linear.prior_covariance)
    errors = errors._replace(covariance=corrected, standard=correction * errors.standard)
    return MEstimate(linear, errors, scale, downweighted, settled)
