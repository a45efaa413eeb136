"""The sampler on densities whose answers are known."""

import emcee
import numpy as np
import pytest

from estimators.defaults import SAMPLING
from estimators.errors import InvalidSamples
from estimators.sampling import chain as sampling
from estimators.sampling.proposal import standard


def autoregressive(rho: float, steps: int, walkers: int, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    x = np.empty((steps, walkers, 1))
    x[0] = rng.standard_normal((walkers, 1))
    for k in range(1, steps):
        x[k] = rho * x[k - 1] + np.sqrt(1.0 - rho**2) * rng.standard_normal((walkers, 1))
    return x


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.9])
def test_autocorrelation_time_of_an_autoregression_is_its_closed_form(rho: float) -> None:
    chain = autoregressive(rho, 4000, 32)
    expected = (1.0 + rho) / (1.0 - rho)
    np.testing.assert_allclose(sampling.autocorrelation_time(chain), expected, rtol=0.05)  # 128,000 draws
    np.testing.assert_allclose(
        sampling.autocorrelation_time(chain), emcee.autocorr.integrated_time(chain), rtol=0.05
    )  # emcee takes each walker's own mean away


def test_monte_carlo_error_is_that_of_repeated_chains() -> None:
    """The spread over 200 chains of mean, 5 % and 95 % quantile, against what one chain says of itself."""
    claimed, found = [], []
    for seed in range(200):
        chain = autoregressive(0.5, 100, 32, seed)
        claimed.append(sampling.monte_carlo_error(chain, sampling.autocorrelation_time(chain)))
        found.append([chain.mean(), *np.quantile(chain, [0.05, 0.95])])
    np.testing.assert_allclose(np.mean(claimed), np.std(found, axis=0).max(), rtol=0.15)  # 200 chains: 5 % each


def test_split_rhat_sees_chains_that_disagree() -> None:
    rng = np.random.default_rng(0)
    chain = rng.standard_normal((400, 8, 2))
    assert sampling.split_rhat(chain) < 1.01
    chain[:, 0, 1] += 2.0
    assert sampling.split_rhat(chain) > 1.05


def test_a_target_far_from_the_proposal_falls_back_to_differential_evolution() -> None:
    scale = np.array([0.05, 1.0, 1.0])  # acceptance of the independence proposal about 0.05

    chain = sampling.sample(lambda x: -0.5 * np.sum((x / scale) ** 2, axis=1), standard(3), accuracy=0.1, seed=2)
    assert chain.move == "differential evolution"
    assert not chain.trouble
    assert np.isnan(chain.split_rhat)
    np.testing.assert_allclose(chain.flat().std(axis=0), scale, rtol=0.1)
    assert len(chain.draws) >= SAMPLING.chain_lengths * chain.autocorrelation_time.max()


def test_a_target_that_no_proposal_hits_is_sampled_from_its_mode_on() -> None:
    """A hundred thousandth of the proposals' width."""

    def density(x: np.ndarray) -> np.ndarray:
        return np.where((np.abs(x) < 1e-4).all(axis=1), -0.5 * ((x / 1e-5) ** 2).sum(axis=1), -np.inf)

    assert np.isneginf(density(standard(5).draw(np.random.RandomState(0), 10_000))).all()
    assert sampling.sample(density, standard(5)).flat().std() == pytest.approx(1e-5, rel=0.2)


def test_a_density_that_is_nowhere_is_told() -> None:
    with pytest.raises(InvalidSamples, match="mean friction is 0 or less with near certainty"):
        sampling.sample(lambda x: np.full(len(x), -np.inf), standard(5))


def test_more_accuracy_takes_more_steps_and_is_reached() -> None:
    rough, fine = (
        sampling.sample(lambda x: -0.5 * np.sum(x**2, axis=1), standard(2), accuracy=a) for a in (0.05, 0.007)
    )
    assert len(fine.flat()) > 4 * len(rough.flat())
    assert fine.monte_carlo_error <= 0.007
    assert abs(fine.flat().mean()) < 5 * 0.007


def test_an_error_three_times_too_large_takes_nine_times_the_steps() -> None:
    chain = sampling.Chain(np.zeros((400, 2, 1)), np.ones(1), np.full(1, 800.0), 0.03, 1.0, 1.0, "independence", "", "")
    steps = sampling._missing(chain, goal=0.01)
    assert steps % SAMPLING.batch == 0
    assert steps == pytest.approx(SAMPLING.more_steps * 9 * 400 - 400, abs=1.01 * SAMPLING.batch)


@pytest.mark.parametrize("slowness", [1.0, 4.0])
def test_walkers_are_as_many_as_their_first_block_needs(slowness: float) -> None:
    """Draws go by the square of the accuracy; never an odd number, fewer than the least or more than the most."""
    few, many = SAMPLING.fewest_walkers, SAMPLING.most_walkers
    assert sampling._walkers(1e6, slowness) == few
    assert sampling._walkers(1e-6, slowness) == many
    needed = 0.5 * (few + many)
    draws = needed * SAMPLING.block
    goal = SAMPLING.tail_error / np.sqrt(draws / (slowness * SAMPLING.more_walkers * SAMPLING.expected_time))
    assert sampling._walkers(goal, slowness) == pytest.approx(needed, abs=2.0)
    assert sampling._walkers(goal, slowness) % 2 == 0
