"""M-estimates: as good as least squares on clean data, and hardly moved by what ruins least squares."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from statsmodels.regression.linear_model import WLS
from statsmodels.robust.norms import HuberT

import estimators
from estimators.linear import m_estimate
from slipcore.samples import FrictionSamples

Make = Callable[..., FrictionSamples]
Cut = Callable[[FrictionSamples], list[FrictionSamples]]


def spoiled(samples: Make, fraction: float, n: int = 300, seed: int = 0) -> FrictionSamples:
    """False slip: friction anywhere below what a slipping element shows."""
    rng = np.random.default_rng([seed, 3])
    data = samples(n, seed=seed, elements=40)
    low = rng.uniform(0.0, 0.3, n)
    return replace(data, friction_coefficient=np.where(rng.random(n) < fraction, low, data.friction_coefficient))


@pytest.mark.parametrize("fraction", [0.1, 0.3, 0.45])
def test_false_slip_up_to_nearly_half_leaves_the_plane_in_place(samples: Make, fraction: float) -> None:
    """Over twelve records it strays no further than an oracle that knows the plane and drops all beyond 3.5 scatters.

    Outliers closer than that cannot be told from good samples; four standard errors of the mean are added.
    """
    errors, oracle = [], []
    for seed in range(12):
        data = spoiled(samples, fraction, n=2000, seed=seed)
        errors.append(off(estimators.fit(data, method="robust")))
        plane = 0.4 + 2.0 * data.tangential_velocity - 0.8 * data.normal_force
        near = (np.abs(data.friction_coefficient - plane) < 3.5 * 0.02).astype(float)
        oracle.append(off(estimators.fit(replace(data, weight=near))))
    noise = np.std(errors, axis=0) / np.sqrt(12)
    assert (np.abs(np.mean(errors, axis=0)) < np.abs(np.mean(oracle, axis=0)) + 4 * noise).all()
    assert np.abs(off(estimators.fit(data))).min() > 5 * np.abs(errors).max()  # least squares


def off(model: estimators.FrictionModel) -> np.ndarray:
    """Error of friction at two places of the data."""
    return np.asarray(model.predict([0.0, 5e-3], [0.05, 0.05]) - (0.36 + 2.0 * np.array([0.0, 5e-3])))


@pytest.mark.parametrize("fits", [100, pytest.param(300, marks=pytest.mark.long)])
def test_on_clean_data_it_costs_a_twentieth_in_variance(samples: Make, fits: int) -> None:
    deviations = np.array(
        [
            [estimators.fit(samples(100, seed=seed), method=method).predict(2e-3, 0.05) for method in ("ols", "robust")]
            for seed in range(fits)
        ]
    )
    efficiency = deviations[:, 0].var() / deviations[:, 1].var()
    assert 0.85 < efficiency < 1.02  # 95 % asymptotically; 300 fits tell it to a few percent, as both see the same data


@pytest.mark.parametrize("fits", [60, pytest.param(150, marks=pytest.mark.long)])
def test_intervals_cover_with_a_tenth_of_outliers_and_plain_ones_do_not(
    samples: Make, places_as_grasps: Cut, truth: np.ndarray, fits: int
) -> None:
    inside, plain = np.zeros(3), np.zeros(3)
    for seed in range(fits):
        data = places_as_grasps(spoiled(samples, 0.1, seed=seed))
        for method, count in (("robust", inside), ("ols", plain)):
            low, high = estimators.fit(data, method=method).interval(0.9).T
            count += (low <= truth) & (truth <= high)
    assert (inside >= stats.binom(fits, 0.9).ppf(1e-3)).all()
    assert plain[0] < 0.6 * fits


def test_huber_is_that_of_statsmodels_at_the_same_scale(samples: Make) -> None:
    data = spoiled(samples, 0.05)
    x = np.column_stack([np.ones(300), data.tangential_velocity * 1e3, data.normal_force])
    start = m_estimate.high_breakdown(x, data.friction_coefficient, np.random.default_rng(0))
    ours, _, settled = m_estimate._m_step(x, data.friction_coefficient, np.ones(300), start, m_estimate.LOSSES["huber"])
    norm = HuberT()
    wanted = start.coefficients
    for _ in range(200):  # statsmodels' weights, at the scale that ours keeps fixed
        weight = norm.weights((data.friction_coefficient - x @ wanted) / start.scale)
        wanted = WLS(data.friction_coefficient, x, weights=weight).fit().params
    assert settled
    np.testing.assert_allclose(ours.coefficients, wanted, rtol=1e-6)


@pytest.mark.parametrize("loss", ["huber", "tukey"])
def test_the_slope_of_a_loss_is_the_derivative_of_its_psi(loss: str) -> None:
    weight, slope = m_estimate.LOSSES[loss]
    u = np.linspace(-6.0, 6.0, 997)  # no point within 1e-6 of a corner
    psi = [(u + h) * weight(u + h) for h in (1e-6, -1e-6)]
    np.testing.assert_allclose(slope(u), (psi[0] - psi[1]) / 2e-6, atol=1e-5)


def test_the_scale_of_clean_residuals_is_that_of_the_noise(samples: Make, sigma: float) -> None:
    model = estimators.fit(samples(20_000), method="robust")
    np.testing.assert_allclose(model.scale, sigma, rtol=0.02)


def test_constant_velocity_is_flagged_here_too(samples: Make) -> None:
    model = estimators.fit(samples(200, tangential_velocity=np.full(200, 2e-3)), method="robust")
    assert not model.identifiable[1]
    assert abs(model.predict(2e-3, 0.05) - 0.364) < 0.01


def test_moments_cannot_be_robust_and_losses_are_named(samples: Make) -> None:
    with pytest.raises(estimators.InvalidSamples, match='which "robust" needs'):
        estimators.Moments.from_samples(samples(50)).fit("robust")
    with pytest.raises(estimators.InvalidSamples, match="loss is cauchy; allowed: huber, tukey"):
        estimators.fit(samples(50), method="robust", loss="cauchy")
