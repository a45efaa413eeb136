"""What unknown velocities do to what least squares and its like find; the hierarchical model allows for them itself."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import LINEAR, ROUNDING
from estimators.likelihoods.posterior import PosteriorSummary
from estimators.linear.fit_data import FitData
from estimators.linear.least_squares import LinearFit
from estimators.linear.unknown_velocity import offset_variance

FloatArray = NDArray[np.float64]


def sensitivity(data: FitData, linear: LinearFit) -> FloatArray:
    """Change of the least-squares coefficients by an offset of 1 of all samples of unknown velocity, [3].

    (XᵀWX)⁻¹ XᵀW r, with r = 1 for these samples and 0 for all others.
    """
    root = linear.root.astype(float)
    return np.asarray(root @ (root.T @ data.unknown))


def widened(found: PosteriorSummary, data: FitData, linear: LinearFit) -> PosteriorSummary:
    """What a method found that knows nothing of the offset, its uncertainty with that of the offset added.

    Draws are moved at random with it, by a seed of their own.
    """
    along = sensitivity(data, linear)
    variance = offset_variance(data.mean_friction, float(found.coefficients[1]), float(found.covariance[1, 1]))
    found = replace(found, covariance=found.covariance + variance * np.outer(along, along))
    if found.draws is None:
        return found
    draws = found.draws.copy()
    offset = np.sqrt(variance) * np.random.default_rng(len(draws)).standard_normal(len(draws))
    draws[:, :3] += offset[:, None] * along
    return replace(found, draws=draws)


def slope_inflation(data: FitData, linear: LinearFit) -> float:
    """By what the error of β₁ grows if the samples of unknown velocity say nothing of it: were their offset any.

    What they differ by from the others would determine it else, by the velocity taken for theirs.
    """
    along = sensitivity(data, linear)
    left = float(data.unknown[0] - data.unknown @ along)
    own = float(linear.root[1].astype(float) @ linear.root[1].astype(float))
    if along[1] == 0.0 or own == 0.0:
        return 1.0
    return float(np.sqrt(1.0 + min(along[1] ** 2 / (max(left, ROUNDING * data.unknown[0]) * own), LINEAR.unbounded)))


def in_words(data: FitData) -> str:
    """Which velocities are unknown, and what follows."""
    if data.unknown_velocity > 1.0 - ROUNDING:
        return "the object's motion is unknown, so that no velocity is and the samples do not determine β₁"
    return f"the object's motion is unknown to {data.unknown_velocity:.0%} of the samples: the others determine β₁"
