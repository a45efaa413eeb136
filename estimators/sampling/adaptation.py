"""A proposal for a density that one component does not suit: a mixture grown on a short pilot run."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import SAMPLING
from estimators.sampling.proposal import DEFENSIVE, StudentMixture, evenness, flattened, root_of, standard

FloatArray = NDArray[np.float64]
LogDensity = Callable[[FloatArray], FloatArray]

COMPONENTS, ROUNDS, DRAWS = 5, 8, 1500
"""Of the mixture, of its fit, and of each round of the fit."""
PILOT_WALKERS, PILOT_STEPS = 100, 200
"""Of the run that finds where the mass is, of which the second half counts."""


class Fit(NamedTuple):
    """A proposal, and the evenness of the density's weights under it: effective number of draws over their number."""

    proposal: StudentMixture
    even: float


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


def _pilot(log_density: LogDensity, dimension: int, rng: np.random.Generator) -> FloatArray:
    """Points [k, d] roughly where the density has its mass: walkers from near and far that evolve differentially."""
    from emcee.moves import DEMove  # emcee takes a second to load

    from estimators.sampling.ensemble import VectorisedSampler

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


def _split(x: FloatArray, rng: np.random.Generator) -> StudentMixture:
    """A component as wide as all points [k, d], and others about some of them."""
    size = x.shape[1]
    wide = root_of(np.cov(x.T).reshape(size, size), np.eye(size))
    root = np.concatenate([1.3 * wide[None], np.repeat(0.7 * wide[None], COMPONENTS, axis=0)])
    part = np.concatenate([[DEFENSIVE], np.full(COMPONENTS, (1.0 - DEFENSIVE) / COMPONENTS)])
    return StudentMixture(part, np.vstack([x.mean(axis=0), x[rng.choice(len(x), COMPONENTS)]]), root)
