"""Simulation-based calibration of the sampled posteriors, around the posterior of a first data set.

Draw θ from p(θ | y₀), simulate y₁ from θ, fit both: the rank of θ among the draws of p(θ | y₀, y₁) is uniform if, and
only if, prior, likelihood and sampler agree (Talts et al., 2018; Säilynoja et al., 2025, who condition on y₀ so that
weak priors do no harm). Test level: 1e-3 a parameter. "errors_in_variables" takes the true f_n as normal, and their
mean and variance from the data.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import estimators
from slipcore.samples import FrictionSamples

Make = Callable[..., FrictionSamples]
RANKS, BINS = 99, 10


def noise_of(likelihood: str, theta: np.ndarray, n: int, rng: np.random.Generator) -> np.ndarray:
    sigma, rest = theta[3], theta[4:]
    if likelihood == "student_t":
        return sigma * rng.standard_t(rest[0], n)
    normal = sigma * rng.standard_normal(n)
    if likelihood == "outlier":
        part, wide, offset = rest
        return np.where(rng.random(n) < part, offset + wide * rng.standard_normal(n), normal)
    return normal


def simulate(samples: Make, likelihood: str, theta: np.ndarray, seed: int, size: int) -> list[FrictionSamples]:
    rng = np.random.default_rng([seed, 11])
    if likelihood == "errors_in_variables":
        return [noisy_forces(samples, theta, seed, size, rng)]
    if likelihood == "hierarchical":
        return [scattered(samples, theta, 10_000 * (seed + 1) + g, size, rng) for g in range(3)]
    return [
        samples(
            size,
            seed=10_000 * (seed + 1),
            coefficients=theta[:3],
            scale=1.0,
            noise=noise_of(likelihood, theta, size, rng),
        )
    ]


def scattered(samples: Make, theta: np.ndarray, seed: int, size: int, rng: np.random.Generator) -> FrictionSamples:
    sigma, tau, omega = theta[3:]
    data = samples(size, seed=seed, coefficients=theta[:3] * (1.0 + tau * rng.standard_normal()), scale=sigma)
    place = omega * rng.standard_normal(20)
    return replace(data, friction_coefficient=data.friction_coefficient + place[data.element])


def noisy_forces(samples: Make, theta: np.ndarray, seed: int, size: int, rng: np.random.Generator) -> FrictionSamples:
    sigma, noise = theta[3:]
    force = rng.normal(0.1, 0.015, size)
    data = samples(size, seed=10_000 * (seed + 1), coefficients=theta[:3], scale=sigma, normal_force=force)
    f_n, f_t = (f + noise * rng.standard_normal(size) for f in (data.normal_force, data.tangential_force))
    return replace(data, normal_force=f_n, tangential_force=f_t, friction_coefficient=f_t / f_n)


def ranks(samples: Make, likelihood: str, fits: int, first: np.ndarray, size: int) -> np.ndarray:
    start = simulate(samples, likelihood, first, seed=0, size=2 * size)
    options = {"method": "bayes", "likelihood": likelihood, "accuracy": 0.05}
    prior = estimators.fit(start, **(options | {"accuracy": 0.02})).draws  # its error is shared by all fits
    chosen = prior[np.random.default_rng(0).choice(len(prior), fits, replace=False)]
    found = np.empty((fits, prior.shape[1]), dtype=int)
    for k, theta in enumerate(chosen):
        grasps = start + simulate(samples, likelihood, theta, seed=k + 1, size=size)
        data = grasps if likelihood == "hierarchical" else FrictionSamples.concatenate(grasps)
        draws = estimators.fit(data, seed=k, **options).draws
        every = draws[np.linspace(0, len(draws) - 1, RANKS).astype(int)]
        found[k] = np.sum(every < theta, axis=0)
    return found


def assert_uniform(found: np.ndarray) -> None:
    for column in found.T:
        counts = np.bincount(column * BINS // (RANKS + 1), minlength=BINS)
        assert stats.chisquare(counts).pvalue > 1e-3, counts


TRUTHS = {
    "gaussian": np.array([0.4, 2.0, -0.8, 0.02]),
    "hierarchical": np.array([0.4, 2.0, -0.8, 0.02, 0.07, 0.01]),
    "student_t": np.array([0.4, 2.0, -0.8, 0.02, 4.0]),
    "outlier": np.array([0.4, 2.0, -0.8, 0.02, 0.15, 0.1, -0.15]),
    "errors_in_variables": np.array([0.4, 2.0, -0.8, 0.02, 3e-3]),
}


def test_ranks_of_the_gaussian_posterior_are_uniform(samples: Make) -> None:
    assert_uniform(ranks(samples, "gaussian", 50, TRUTHS["gaussian"], size=10))


@pytest.mark.long
@pytest.mark.parametrize("likelihood", TRUTHS)
def test_ranks_of_every_sampled_posterior_are_uniform(samples: Make, likelihood: str) -> None:
    size = 150 if likelihood == "errors_in_variables" else 40  # fewer samples leave the noise of the forces unknown
    assert_uniform(ranks(samples, likelihood, 500, TRUTHS[likelihood], size))


def test_a_scatter_taken_too_small_would_be_found_out() -> None:
    """The test has teeth: draws whose spread is 0.6 of what it should be fail it."""
    exact = np.random.default_rng(0).standard_normal((500, RANKS))
    truth = np.random.default_rng(1).standard_normal((500, 1))
    assert_uniform(np.sum(exact < truth, axis=1)[:, None])
    with pytest.raises(AssertionError):
        assert_uniform(np.sum(0.6 * exact < truth, axis=1)[:, None])
