"""Sampled posteriors against the exact one, and what a chain says of itself."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy import stats

import estimators
from estimators.defaults import ChainSettings
from estimators.linear.fit_data import gather
from estimators.linear.normal_inverse_gamma import NormalInverseGamma, exact_posterior
from estimators.sampling import chain as sampling
from slipcore.samples import FrictionSamples

Make = Callable[..., FrictionSamples]


def exact(data: FrictionSamples) -> NormalInverseGamma:
    return exact_posterior(gather(data))


@pytest.mark.parametrize("n", [8, 60, 3000])
def test_the_sampled_posterior_is_the_exact_one(samples: Make, n: int) -> None:
    data = samples(n, seed=n)
    model, reference = estimators.fit(data, method="bayes", likelihood="gaussian", seed=1), exact(data)
    spread = np.sqrt(np.diag(reference.covariance))
    assert np.abs((model.coefficients - reference.mean) / spread).max() < 0.04  # 5 standard errors at ESS 15,000
    np.testing.assert_allclose(np.sqrt(np.diag(model.covariance)) / spread, 1.0, atol=0.03)
    np.testing.assert_allclose(model.scale, reference.scale, rtol=0.03)
    levels = np.array([0.05, 0.95])
    for k in range(3):
        wanted = reference.mean[k] + spread[k] * stats.t(reference.degrees_of_freedom).ppf(levels)
        found = np.quantile(model.draws[:, k], levels)
        density = stats.t(reference.degrees_of_freedom).pdf(stats.t(reference.degrees_of_freedom).ppf(0.05)) / spread[k]
        allowed = 5 * np.sqrt(0.05 * 0.95 / 2000) / density  # at least 2,000 of the draws that are kept
        np.testing.assert_allclose(found, wanted, atol=allowed)


def test_intervals_cover_the_truth(samples: Make, truth: np.ndarray) -> None:
    fits, level, inside = 30, 0.9, np.zeros(3)
    for seed in range(fits):
        model = estimators.fit(samples(100, seed=seed), method="bayes", likelihood="gaussian", accuracy=0.1)
        low, high = model.interval(level).T
        inside += (low <= truth) & (truth <= high)
    expected = stats.binom(fits, level)
    assert ((expected.ppf(1e-3) <= inside) & (inside <= expected.ppf(1.0 - 1e-3))).all()


def test_a_fit_says_how_far_its_chain_can_be_trusted(samples: Make) -> None:
    model = estimators.fit(samples(500), method="bayes", likelihood="gaussian")
    told = model.diagnostics
    assert 0.8 < told["acceptance"] < 0.95
    for name in ("beta0", "beta1", "beta2", "sigma"):
        assert told[f"effective_sample_size_{name}"] >= 10_000
        assert told["steps"] >= 50 * told[f"autocorrelation_time_{name}"]
    assert told["split_rhat"] < 1.01
    assert told["stopped"] == "accuracy"
    assert 0.0 < model.cost.monte_carlo_error <= 0.02
    assert "sigma^2" in told["prior"]
    assert model.draws.shape[1] == 4
    assert 2000 <= len(model.draws) <= 4000


def test_the_same_seed_gives_the_same_draws_and_another_does_not(samples: Make) -> None:
    one, same, other = (
        estimators.fit(samples(100), method="bayes", likelihood="gaussian", seed=seed) for seed in (3, 3, 4)
    )
    np.testing.assert_array_equal(one.draws, same.draws)
    assert not np.array_equal(one.draws, other.draws)


def test_mean_friction_stays_positive_over_the_domain(samples: Make) -> None:
    """The prior's support: with truth near zero, the cut bites and no draw lies beyond it."""
    data = samples(12, coefficients=np.array([0.03, 0.0, 0.0]), scale=0.05)
    model = estimators.fit(data, method="bayes", likelihood="gaussian")
    v, f_n = model.domain.tangential_velocity, model.domain.normal_force
    corners = np.array([[1.0, a, b] for a in v for b in f_n])
    assert (model.draws[:, :3] @ corners.T > 0.0).all()
    assert (exact(data).draw(1000, np.random.default_rng(0))[:, :3] @ corners.T <= 0.0).any()


def test_friction_below_zero_is_refused(samples: Make) -> None:
    with pytest.raises(estimators.InvalidSamples, match="mean friction"):
        estimators.fit(samples(50, coefficients=np.array([-1.0, 0.0, 0.0])), method="bayes", likelihood="gaussian")


def test_a_chain_that_ran_out_of_time_is_an_error_that_carries_its_model(
    samples: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sampling, "SAMPLING", ChainSettings(block=8))
    with pytest.raises(estimators.NotConverged, match="50 times needed") as caught:
        estimators.fit(samples(100), method="bayes", likelihood="gaussian", seconds=1e-9)
    assert caught.value.model.diagnostics["stopped"] == "seconds"
    np.testing.assert_allclose(caught.value.model.coefficients[0], 0.4, atol=0.1)
