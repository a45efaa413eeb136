"""What independence sampling proposes: a mixture of multivariate Student-t's, fitted to a density by its weights."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.defaults import SAMPLING

FloatArray = NDArray[np.float64]
LogDensity = Callable[[FloatArray], FloatArray]
Random = np.random.Generator | np.random.RandomState

COMPONENTS, ROUNDS, DRAWS = 5, 8, 1500
"""Of the fit where one component does not do."""
PILOT_WALKERS, PILOT_STEPS = 100, 200
"""Of the run that finds where the mass is, of which the second half counts."""
DEFENSIVE = 0.1
"""Part of proposals that always come from the widest component: no region is left without any."""
POWERS = np.array([1.0, 0.7, 0.5, 0.3, 0.2, 0.1, 0.05, 0.02])


@dataclass(frozen=True, slots=True, eq=False)
class Proposal:
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
        return np.asarray(special.logsumexp(self._logs(x)[0], axis=1)) if len(self.part) > 1 else self._logs(x)[0][:, 0]

    def fitted(self, x: FloatArray, weight: FloatArray) -> "Proposal":
        """The components moved to weighted points x [k, d]: one step of EM for a mixture (Cappé et al., 2008).

        The first component stays as it is, and keeps a part of at least ``DEFENSIVE``.
        """
        degrees = SAMPLING.proposal_degrees_of_freedom
        logs, squares = self._logs(x)
        share = special.softmax(logs, axis=1) * (weight / weight.sum())[:, None]
        pull = share * (degrees + self.dimension) / (degrees + squares)
        part = np.maximum(share.sum(axis=0), 1e-3)
        part[0] = max(part[0], DEFENSIVE)
        centre, root = self.centre.copy(), self.root.copy()
        for k in range(1, len(part)):
            if not pull[:, k].sum() > 1e-100:
                continue  # nothing came near it
            centre[k] = pull[:, k] @ x / pull[:, k].sum()
            away = x - centre[k]
            spread = (away * pull[:, k : k + 1]).T @ away / share[:, k].sum()
            root[k] = root_of(spread, self.root[0])
        return Proposal(part / part.sum(), centre, root)

    def _logs(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Log of part times density [k, m], and squared distances [k, m], from each component."""
        degrees, size = SAMPLING.proposal_degrees_of_freedom, self.dimension
        inverse = np.linalg.inv(self.root)
        z = np.einsum("mij,kmj->kmi", inverse, x[:, None] - self.centre)
        with np.errstate(over="ignore"):
            squares = np.minimum(np.einsum("kmi,kmi->km", z, z), 1e200)  # so far off that no component is near
        height = np.log(self.part) + np.linalg.slogdet(inverse)[1]
        return height - 0.5 * (degrees + size) * np.log1p(squares / degrees), squares


class Fit(NamedTuple):
    """A proposal, and the evenness of the density's weights under it: effective number of draws over their number."""

    proposal: Proposal
    even: float


def standard(dimension: int) -> Proposal:
    """One component about 0 with scale 1: what suits a whitened density."""
    return Proposal(np.ones(1), np.zeros((1, dimension)), np.eye(dimension)[None])


def adapted(log_density: LogDensity, dimension: int, rng: np.random.Generator) -> Fit:
    """Proposal for a density that one component about 0 does not suit: a mixture grown on a short pilot run."""
    x = _pilot(log_density, dimension, rng)
    proposal, even = _split(x, rng), np.ones(len(x))
    for _ in range(3):
        proposal = proposal.fitted(x, even)
    best = Fit(proposal, 0.0)
    for _ in range(ROUNDS):
        x = proposal.draw(rng, DRAWS)
        log_weight = log_density(x) - proposal.log_density(x)
        if not np.isfinite(log_weight.max()):
            break
        best = max(best, Fit(proposal, evenness(log_weight)), key=lambda fit: fit.even)
        if best.even > SAMPLING.even:
            break
        proposal = proposal.fitted(x, flattened(log_weight))
    return best


def flattened(log_weight: FloatArray) -> FloatArray:
    """Weights [k] raised to the largest power at which a fifth of them counts."""
    power = next((power for power in POWERS if evenness(power * log_weight) > 0.2), POWERS[-1])
    return np.asarray(np.exp(power * (log_weight - log_weight.max())))


def evenness(log_weight: FloatArray) -> float:
    """Effective number of weights over their number."""
    weight = np.exp(log_weight - log_weight.max())
    return float(weight.sum() ** 2 / (weight @ weight) / len(weight))


def _pilot(log_density: LogDensity, dimension: int, rng: np.random.Generator) -> FloatArray:
    """Points [k, d] roughly where the density has its mass: walkers from near and far that evolve differentially."""
    from emcee.moves import DEMove

    from estimators.ensemble import VectorisedSampler

    near = standard(dimension)
    x = near.draw(rng, 8 * PILOT_WALKERS) * rng.choice([1.0, 2.0, 4.0, 8.0], (8 * PILOT_WALKERS, 1))
    log_weight = log_density(x) - near.log_density(x)
    possible = np.isfinite(log_weight)
    if possible.sum() < 2 * dimension:
        return np.asarray(x)
    weight = flattened(log_weight[possible]) + 1e-12
    start = x[possible][rng.choice(len(weight), PILOT_WALKERS, p=weight / weight.sum())]
    sampler = VectorisedSampler(PILOT_WALKERS, dimension, log_density, moves=DEMove(), vectorize=True)
    sampler.random_state = np.random.RandomState(rng.integers(2**31)).get_state()
    sampler.run_mcmc(start, PILOT_STEPS, skip_initial_state_check=True)
    chain = sampler.get_chain(discard=PILOT_STEPS // 2, thin=5, flat=True)
    return np.asarray(chain)


def _split(x: FloatArray, rng: np.random.Generator) -> Proposal:
    """A component as wide as all points [k, d], and others about some of them."""
    size = x.shape[1]
    wide = root_of(np.cov(x.T).reshape(size, size), np.eye(size))
    root = np.concatenate([1.3 * wide[None], np.repeat(0.7 * wide[None], COMPONENTS, axis=0)])
    part = np.concatenate([[DEFENSIVE], np.full(COMPONENTS, (1.0 - DEFENSIVE) / COMPONENTS)])
    return Proposal(part, np.vstack([x.mean(axis=0), x[rng.choice(len(x), COMPONENTS)]]), root)


def root_of(spread: FloatArray, wide: FloatArray) -> FloatArray:
    """Root [d, d] of a spread that few points may have made: nowhere thinner than a hundredth of ``wide``."""
    values, vectors = np.linalg.eigh(spread + 1e-4 * wide @ wide.T)
    return np.asarray(vectors * np.sqrt(np.maximum(values, np.finfo(float).tiny)))
