"""A proposal for a density that one component does not suit: a mixture grown on a short pilot run."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import PROPOSAL, SAMPLING
from estimators.sampling.proposal import StudentMixture, evenness, flattened, root_of, standard

FloatArray = NDArray[np.float64]
LogDensity = Callable[[FloatArray], FloatArray]


PILOT_WIDTHS = 2.0 ** np.arange(4)
"""Of the draws that walkers of the pilot run start from: near and far."""


class ProposalFit(NamedTuple):
    """A proposal, and the evenness of the density's weights under it: effective number of draws over their number."""

    proposal: StudentMixture
    even: float


def adapted(log_density: LogDensity, dimension: int, rng: np.random.Generator) -> ProposalFit:
    """Proposal for a density that one component about 0 does not suit: a mixture grown on a short pilot run."""
    x = _pilot(log_density, dimension, rng)
    proposal, even = _split(x, rng), np.ones(len(x))
    for _ in range(PROPOSAL.first_fits):
        proposal = proposal.fitted(x, even)
    best = ProposalFit(proposal, 0.0)
    for _ in range(PROPOSAL.rounds):
        x = proposal.draw(rng, PROPOSAL.draws)
        log_weight = log_density(x) - proposal.log_density(x)
        if not np.isfinite(log_weight.max()):
            break
        best = max(best, ProposalFit(proposal, evenness(log_weight)), key=lambda fit: fit.even)
        if best.even > SAMPLING.even:
            break
        proposal = proposal.fitted(x, flattened(log_weight))
    return best


def _pilot(log_density: LogDensity, dimension: int, rng: np.random.Generator) -> FloatArray:
    """Points [k, d] roughly where the density has its mass: walkers from near and far that evolve differentially."""
    from estimators.sampling.ensemble import EvolutionMove, VectorisedSampler  # emcee takes a second to load

    near = standard(dimension)
    count = PROPOSAL.pilot_candidates * PROPOSAL.pilot_walkers
    x = near.draw(rng, count) * rng.choice(PILOT_WIDTHS, (count, 1))
    log_weight = log_density(x) - near.log_density(x)
    possible = np.isfinite(log_weight)
    if possible.sum() < 2 * dimension:
        return np.asarray(x)
    weight = flattened(log_weight[possible]) + PROPOSAL.pilot_floor
    start = x[possible][rng.choice(len(weight), PROPOSAL.pilot_walkers, p=weight / weight.sum())]
    sampler = VectorisedSampler(PROPOSAL.pilot_walkers, dimension, log_density, moves=EvolutionMove(), vectorize=True)
    sampler.random_state = np.random.RandomState(rng.integers(2**31)).get_state()
    sampler.run_mcmc(start, PROPOSAL.pilot_steps, skip_initial_state_check=True)
    chain = sampler.get_chain(discard=PROPOSAL.pilot_steps // 2, thin=PROPOSAL.pilot_thin, flat=True)
    return np.asarray(chain)


def _split(x: FloatArray, rng: np.random.Generator) -> StudentMixture:
    """A component as wide as all points [k, d], and others about some of them."""
    size = x.shape[1]
    wide = root_of(np.cov(x.T).reshape(size, size), np.eye(size))
    root = np.concatenate(
        [PROPOSAL.wide * wide[None], np.repeat(PROPOSAL.narrow * wide[None], PROPOSAL.components, axis=0)]
    )
    part = np.concatenate(
        [[PROPOSAL.defensive], np.full(PROPOSAL.components, (1.0 - PROPOSAL.defensive) / PROPOSAL.components)]
    )
    return StudentMixture(part, np.vstack([x.mean(axis=0), x[rng.choice(len(x), PROPOSAL.components)]]), root)
