"""Moves of ours against those of emcee that they stand for."""

import numpy as np
import pytest
from emcee.moves import DEMove, Move

from estimators.sampling.ensemble import EvolutionMove, VectorisedSampler

WALKERS, STEPS = 30, 200


def bent(x: np.ndarray) -> np.ndarray:
    """Log density [k] of points [k, 3] that no normal one is like, and none beyond a wall."""
    log_density = -0.5 * (x[:, 0] ** 2 + (x[:, 1] - x[:, 0] ** 2) ** 2 + np.abs(x[:, 2]))
    return np.where(x[:, 2] > -1.0, log_density, -np.inf)


def chain_of(move: Move, seed: int, walkers: int = WALKERS) -> np.ndarray:
    sampler = VectorisedSampler(walkers, 3, bent, moves=move, vectorize=True)
    sampler.random_state = np.random.RandomState(seed).get_state()
    start = np.abs(np.random.default_rng(seed).standard_normal((walkers, 3)))
    sampler.run_mcmc(start, STEPS, skip_initial_state_check=True)
    assert sampler.acceptance_fraction.min() > 0.0
    return np.concatenate((sampler.get_chain(), sampler.get_log_prob()[..., None]), axis=-1)


@pytest.mark.parametrize(("seed", "walkers"), [(0, WALKERS), (1, WALKERS), (2, 41)])
def test_differential_evolution_goes_where_emcees_does(seed: int, walkers: int) -> None:
    np.testing.assert_array_equal(chain_of(EvolutionMove(), seed, walkers), chain_of(DEMove(), seed, walkers))
