"""Slopes within grasps that differ by more than their samples tell: what errors that last as long as a grasp make."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import CLUSTERS, ROUNDING
from estimators.linear.grasp_statistics import GraspStatistics

FloatArray = NDArray[np.float64]


class Slopes(NamedTuple):
    """Of each grasp: the orthonormal ``axes`` [g, 3, 2] of its rows within places that slopes are told along, zero
    where there is none; ``regressors`` [g, 2, 2] along them, v and f_n as parts of ``size`` [3]; ``response`` [g, 2].
    """

    axes: FloatArray
    regressors: FloatArray
    response: FloatArray
    size: FloatArray


def with_slopes_that_differ(grasps: Sequence[GraspStatistics], law: FloatArray) -> list[GraspStatistics]:
    """The same grasps, whose samples within places say so many times less of slopes as grasps differ more in them.

    Errors that go together for as long as a grasp lasts make a slope in it, which no grasp by itself separates from the
    law's. Were all slopes alike, or alike but for the factor by which the level of their grasp is off the ``law`` [3]
    of (1, v, f_n), the mean square of what they differ by would be that of the samples (analysis of covariance). The
    ratio of the two, of what is nearer, divides what the samples say where it is above 1 (overdispersion; McCullagh &
    Nelder, 1989, §4.5): a level may be off by its few places, with which slopes do not go. What places leave open of a
    factor counts as noise (``_beside_levels``).
    """
    within = np.stack([grasp.within for grasp in grasps])
    found = _slopes(within)
    times = _times(grasps, within, found, law)
    if times <= 1.0:
        return list(grasps)
    lost = 1.0 - 1.0 / np.sqrt(times)
    rows = within - lost * found.axes @ (found.axes.swapaxes(1, 2) @ within)
    return [replace(grasp, within=own) for grasp, own in zip(grasps, np.linalg.qr(rows, mode="r"), strict=True)]


def _slopes(within: FloatArray) -> Slopes:
    size = np.sqrt(np.square(within).sum(axis=(0, 1)))
    scaled = within[..., :2] / np.where(size[:2] > 0.0, size[:2], 1.0)
    axes, parts, directions = np.linalg.svd(scaled, full_matrices=False)
    parts[parts <= CLUSTERS.alone] = 0.0
    axes = axes * (parts > 0.0)[:, None]
    return Slopes(axes, parts[..., None] * directions, np.einsum("gij,gi->gj", axes, within[..., 2]), size)


def _times(grasps: Sequence[GraspStatistics], within: FloatArray, found: Slopes, law: FloatArray) -> float:
    """Mean square of what slopes differ by, over that of the samples; 1 where the grasps don't tell."""
    places = sum(float(grasp.count.sum()) for grasp in grasps)
    samples = sum(grasp.total_weight for grasp in grasps) ** 2 / sum(grasp.weight_square for grasp in grasps)
    slopes = int(np.count_nonzero(found.regressors.any(axis=2)))
    left = float(np.square(within[..., 2] - np.einsum("gij,gj->gi", found.axes, found.response)).sum())
    if samples <= places + slopes or left <= (ROUNDING * found.size[2]) ** 2:
        return 1.0
    own = left / (samples - places - slopes)
    factor, unsure = _factors(grasps, law)
    alike = _mean_square(found.regressors, found.response)
    return min(alike, _mean_square(*_beside_levels(found, factor, unsure, own))) / own


def _beside_levels(found: Slopes, factor: FloatArray, unsure: FloatArray, own: float) -> tuple[FloatArray, FloatArray]:
    """Regressors and response of slopes that are ``factor`` [g] times those of the law, whitened.

    A factor that is ``unsure`` [g], a variance, takes a grasp's slopes along those of the law, beside the samples'
    ``own`` mean square: I + w·h·hᵀ in units of it, with h what the law's slopes make and w = unsure / own.
    """
    rows = factor[:, None, None] * found.regressors
    law = np.linalg.lstsq(rows.reshape(-1, 2), found.response.ravel(), rcond=CLUSTERS.alone)[0]
    along = found.regressors @ law
    square = np.square(along).sum(axis=1)
    lost = 1.0 - 1.0 / np.sqrt(1.0 + unsure / own * square)
    of_size = np.divide(lost, square, out=np.zeros_like(square), where=square > 0.0)
    whitening = np.eye(2) - of_size[:, None, None] * along[:, :, None] * along[:, None]
    return whitening @ rows, np.einsum("gij,gj->gi", whitening, found.response)


def _mean_square(regressors: FloatArray, response: FloatArray) -> float:
    """Of what the slopes of grasps differ by, were they those of one law; 0 where none is left."""
    rows, told = regressors.reshape(-1, 2), response.ravel()
    alike, _, rank, _ = np.linalg.lstsq(rows, told, rcond=CLUSTERS.alone)
    degrees = np.count_nonzero(rows.any(axis=1)) - rank
    return float(np.square(told - rows @ alike).sum()) / degrees if degrees > 0 else 0.0


def _factors(grasps: Sequence[GraspStatistics], law: FloatArray) -> tuple[FloatArray, FloatArray]:
    """By which the level of each grasp is off the law, and the variance of that by how its places differ; 1 and 0 where
    the law is hardly more than what grasps scatter by.

    A quotient there tells of scatter, not of a factor, and has any size and sign. Where the law is above twice the
    scatter (``above_scatter``), levels off by two of its deviations have factors from 0 to 2. Grasps that differ by
    factors have the law above twice their scatter up to a τ of 0.5.
    """
    means = np.stack([np.average(grasp.mean, axis=0, weights=grasp.weight * grasp.count) for grasp in grasps])
    expected, friction = law[0] + means[:, :2] @ law[1:], means[:, 2]
    scatter = np.sqrt(np.square(friction - expected).mean())
    above = np.abs(expected) > CLUSTERS.above_scatter * scatter
    factors, unsure = np.ones(len(means)), np.zeros(len(means))
    np.divide(friction, expected, out=factors, where=above)
    levels = np.array([_variance_of_level(grasp, law) for grasp in grasps])
    np.divide(levels, np.square(expected), out=unsure, where=above)
    return factors, unsure


def _variance_of_level(grasp: GraspStatistics, law: FloatArray) -> float:
    """Of the mean that a grasp's places have about the law; 0 of one place, which does not show it."""
    across = np.array([-law[1], -law[2], 1.0])
    places, level = float(grasp.count.sum()), grasp.mean @ across
    if places <= 1.0:
        return 0.0
    about = level - np.average(level, weights=grasp.count)
    square = float(grasp.count @ np.square(about) + np.square(grasp.spread @ across).sum())
    return square / (places - 1.0) / float(grasp.independent.sum())
