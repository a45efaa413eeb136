"""What independence sampling proposes: a mixture of multivariate Student-t's, fitted to a density by its weights."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.defaults import PROPOSAL, SAMPLING, WEIGHT_POWERS
from estimators.linear.log_sum import log_sum

FloatArray = NDArray[np.float64]
Random = np.random.Generator | np.random.RandomState

TINY = 1e-100
"""Weight of a component that nothing came near; its inverse square is farther off than any other."""


@dataclass(frozen=True, slots=True, eq=False)
class StudentMixture:
    """Mixture of m Student-t's: ``part`` [m] that sums to 1, ``centre`` [m, d], ``root`` [m, d, d] of the scale."""

    part: FloatArray
    centre: FloatArray
    root: FloatArray

    @property
    def dimension(self) -> int:
        """Dimension d of what is proposed."""
        return int(self.centre.shape[1])

    def draw(self, random: Random, count: int) -> FloatArray:
        """Independent draws [count, d]."""
        degrees = SAMPLING.proposal_degrees_of_freedom
        radius = np.sqrt(degrees / random.chisquare(degrees, (count, 1)))
        standard = random.standard_normal((count, self.dimension)) * radius
        if len(self.part) == 1:
            return np.asarray(self.centre[0] + standard @ self.root[0].T)
        which = random.choice(len(self.part), count, p=self.part)
        return np.asarray(self.centre[which] + np.einsum("kij,kj->ki", self.root[which], standard))

    def log_density(self, x: FloatArray) -> FloatArray:
        """Log density [k] at x [k, d], up to a constant."""
        return np.asarray(log_sum(self._logs(x)[0], axis=1)) if len(self.part) > 1 else self._logs(x)[0][:, 0]

    def fitted(self, x: FloatArray, weight: FloatArray) -> "StudentMixture":
        """The components moved to weighted points x [k, d]: one step of EM for a mixture (Cappé et al., 2008).

        The first component stays as it is, and keeps a part of at least ``defensive``.
        """
        degrees = SAMPLING.proposal_degrees_of_freedom
        logs, squares = self._logs(x)
        share = special.softmax(logs, axis=1) * (weight / weight.sum())[:, None]
        weighted_share = share * (degrees + self.dimension) / (degrees + squares)
        part = np.maximum(share.sum(axis=0), PROPOSAL.least_part)
        part[0] = max(part[0], PROPOSAL.defensive)
        centre, root = self.centre.copy(), self.root.copy()
        for k in range(1, len(part)):
            if not weighted_share[:, k].sum() > TINY:
                continue  # nothing came near it
            centre[k] = weighted_share[:, k] @ x / weighted_share[:, k].sum()
            away = x - centre[k]
            spread = (away * weighted_share[:, k : k + 1]).T @ away / share[:, k].sum()
            root[k] = root_of(spread, self.root[0])
        return StudentMixture(part / part.sum(), centre, root)

    def _logs(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Log of part times density [k, m], and squared distances [k, m], from each component."""
        degrees, size = SAMPLING.proposal_degrees_of_freedom, self.dimension
        inverse = np.linalg.inv(self.root)
        z = np.einsum("mij,kmj->kmi", inverse, x[:, None] - self.centre)
        with np.errstate(over="ignore"):
            squares = np.minimum(np.einsum("kmi,kmi->km", z, z), 1.0 / TINY**2)  # so far off that no component is near
        height = np.log(self.part) + np.linalg.slogdet(inverse)[1]
        return height - 0.5 * (degrees + size) * np.log1p(squares / degrees), squares


def standard(dimension: int) -> StudentMixture:
    """One component about 0 with scale 1: what suits a whitened density."""
    return StudentMixture(np.ones(1), np.zeros((1, dimension)), np.eye(dimension)[None])


def flattened(log_weight: FloatArray) -> FloatArray:
    """Weights [k] raised to the largest power at which enough of them count."""
    enough = (power for power in WEIGHT_POWERS if evenness(power * log_weight) > PROPOSAL.enough)
    power = next(enough, WEIGHT_POWERS[-1])
    return np.asarray(np.exp(power * (log_weight - log_weight.max())))


def evenness(log_weight: FloatArray) -> float:
    """Effective number of weights over their number."""
    weight = np.exp(log_weight - log_weight.max())
    return float(weight.sum() ** 2 / (weight @ weight) / len(weight))


def root_of(spread: FloatArray, wide: FloatArray) -> FloatArray:
    """Root [d, d] of a spread that few points may have made: nowhere much thinner than ``wide``."""
    values, vectors = np.linalg.eigh(spread + PROPOSAL.thinnest * wide @ wide.T)
    return np.asarray(vectors * np.sqrt(np.maximum(values, np.finfo(float).tiny)))
