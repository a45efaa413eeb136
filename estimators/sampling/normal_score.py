"""A monotone map that turns one skewed density into a standard normal: whitening where an affine map will not do."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.defaults import PROPOSAL

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class NormalScore:
    """Piecewise linear map from scores u to x through the knots (``score``, ``value``), straight on beyond them."""

    score: FloatArray
    value: FloatArray

    def __call__(self, score: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Value [k] at scores [k], and the log slope dx/du there [k]."""
        piece = np.clip(np.searchsorted(self.score, score) - 1, 0, len(self.score) - 2)
        slope = (np.diff(self.value) / np.diff(self.score))[piece]
        return self.value[piece] + slope * (score - self.score[piece]), np.log(slope)


def normal_score(log_density: Callable[[FloatArray], FloatArray], lowest: float, highest: float) -> NormalScore:
    """Map from standard normal scores to a variable of the given log density, looked for between two bounds.

    The map is only as close as its knots; whoever samples in u takes the slope into account, and is exact.
    """
    value = np.linspace(lowest, highest, PROPOSAL.score_knots)
    for _ in range(2):  # the second grid spans only what the first found to matter
        log = log_density(value)
        matters = np.flatnonzero(log > log.max() - PROPOSAL.score_depth)
        value = np.linspace(
            value[max(matters[0] - 1, 0)], value[min(matters[-1] + 1, PROPOSAL.score_knots - 1)], PROPOSAL.score_knots
        )
    density = np.exp(log_density(value) - log.max())
    mass = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
    below, above = mass / mass[-1], (mass[-1] - mass) / mass[-1]
    score = np.where(below < 0.5, special.ndtri(below), -special.ndtri(above))
    finite = np.isfinite(score)
    score, value = score[finite], value[finite]
    rising = np.concatenate([[True], np.diff(score) > PROPOSAL.least_rise])
    return NormalScore(score[rising], value[rising])
