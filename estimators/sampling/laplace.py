"""Laplace's approximation of a smooth density: its mode, and the spread that its curvature there implies."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import PROPOSAL, STEP_SHARES
from estimators.sampling.proposal import evenness, flattened, root_of, standard

FloatArray = NDArray[np.float64]
LogDensity = Callable[[FloatArray], FloatArray]


def laplace(log_density: LogDensity, start: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mode [d] and root [d, d] of the covariance (root rootᵀ), by Newton steps from ``start`` [d].

    ``log_density`` takes [k, d] in coordinates whose posterior spread is about 1; every iteration is two calls, one
    for all differences and one for all step lengths. Directions without curvature get the flattest spread.
    """
    mode = np.array(start, dtype=float)
    root = np.eye(len(mode))
    for _ in range(PROPOSAL.newton_steps):
        gradient, hessian = _differences(log_density, mode, root)
        values, vectors = np.linalg.eigh(-hessian)
        spread = vectors / np.sqrt(np.maximum(values, PROPOSAL.flattest**-2))
        step = spread @ (spread.T @ gradient)
        size = float(np.linalg.norm(spread.T @ gradient))
        shares = np.array(STEP_SHARES)
        within = shares * PROPOSAL.longest_step / max(size, PROPOSAL.longest_step)  # far away, only so far at once
        lengths = np.concatenate([shares, within])
        trial = mode + lengths[:, None] * (root @ step)
        heights = log_density(np.vstack([trial, mode]))
        best = int(np.nanargmax(heights))
        mode = trial[best] if best < len(trial) else mode
        root = root @ spread
        if size < PROPOSAL.close or best == len(trial):
            break
    return mode, root


def _differences(log_density: LogDensity, at: FloatArray, root: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Gradient and Hessian along the columns of ``root``, by central differences in one call."""
    size = len(at)
    first, second = np.triu_indices(size, 1)
    unit = PROPOSAL.difference * np.eye(size)
    moves = np.vstack([np.zeros((1, size)), unit, -unit, unit[first] + unit[second], -unit[first] - unit[second]])
    value = log_density(at + moves @ root.T)
    value = np.where(np.isfinite(value), value, value[0] - PROPOSAL.fall)
    centre, plus, minus = value[0], value[1 : size + 1], value[size + 1 : 2 * size + 1]
    both = value[2 * size + 1 :].reshape(2, -1).sum(axis=0)
    hessian = np.diag(plus + minus - 2.0 * centre)
    curve = np.diag(hessian)
    hessian[first, second] = hessian[second, first] = 0.5 * (both - 2.0 * centre - curve[first] - curve[second])
    return (plus - minus) / (2.0 * PROPOSAL.difference), hessian / PROPOSAL.difference**2


def refine(
    log_density: LogDensity, centre: FloatArray, root: FloatArray, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray, float]:
    """Centre [d] and root [d, d] closer to a skewed density than mode and curvature are, and how even weights are then.

    Adaptive importance sampling (Cappé et al., 2004): draws from a Student-t are weighted by the density, their weights
    flattened until enough of them counts, and their mean and covariance taken, until the weights are even enough.
    """
    proposal, even = standard(len(centre)), 0.0
    for _ in range(PROPOSAL.refine_rounds):
        draws = proposal.draw(rng, PROPOSAL.refine_draws)
        at = centre + draws @ root.T
        log_weight = log_density(at) - proposal.log_density(draws)
        even = evenness(log_weight) if np.isfinite(log_weight.max()) else 0.0
        if not np.isfinite(log_weight.max()) or even > PROPOSAL.refine_even:
            break
        weight = flattened(log_weight)
        centre = weight @ at / weight.sum()
        away = at - centre
        root = root_of((away * weight[:, None]).T @ away / weight.sum(), root)
    return centre, root, even
