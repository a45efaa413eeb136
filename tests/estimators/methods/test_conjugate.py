"""The exact posterior against its textbook form, and what the prior has to say in it."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy import stats

import estimators
from estimators.defaults import PRIOR, REFERENCE
from estimators.linear.fit_data import gather
from estimators.linear.normal_inverse_gamma import exact_posterior
from slipcore.samples import FrictionSamples

Make = Callable[..., FrictionSamples]


def textbook(data: FrictionSamples, width: float = PRIOR.width) -> tuple[np.ndarray, np.ndarray, float]:
    """Mean [3] and precision [3, 3] of the coefficients, and the sum of squares, by the normal equations."""
    x = np.column_stack([np.ones(len(data)), data.tangential_velocity, data.normal_force])
    y = data.friction_coefficient
    spans = np.array([1.0, REFERENCE.tangential_velocity, REFERENCE.pressure * 1e-6])
    precision = np.diag((REFERENCE.scatter / width * spans) ** 2)
    prior_mean = np.array([REFERENCE.friction, 0.0, 0.0])
    updated = precision + x.T @ x
    mean = np.linalg.solve(updated, precision @ prior_mean + x.T @ y)
    square = PRIOR.degrees_of_freedom * REFERENCE.scatter**2 + y @ y + prior_mean @ precision @ prior_mean
    return mean, updated, float(square - mean @ updated @ mean)


def test_the_exact_posterior_satisfies_its_closed_form(samples: Make) -> None:
    data = samples(50)
    mean, updated, square = textbook(data)
    found = exact_posterior(gather(data))
    np.testing.assert_allclose(found.mean, mean, rtol=1e-8)  # the reference squares the condition number
    np.testing.assert_allclose(found.root @ found.root.T, np.linalg.inv(updated), rtol=1e-8)
    np.testing.assert_allclose(found.degrees_of_freedom * found.scale**2, square, rtol=1e-8)
    assert found.degrees_of_freedom == 50 + PRIOR.degrees_of_freedom


def test_the_shift_is_that_under_a_prior_twice_as_wide_in_posterior_deviations(samples: Make) -> None:
    data = samples(20)
    (mean, updated, square), (wide, _, _) = textbook(data), textbook(data, width=2.0 * PRIOR.width)
    spread = np.sqrt(square / (20 + PRIOR.degrees_of_freedom) * np.diag(np.linalg.inv(updated)))
    told = estimators.fit(data, method="conjugate").diagnostics
    shift = [told[f"prior_sensitivity_beta{k}"] for k in range(3)]
    np.testing.assert_allclose(shift, np.abs(wide - mean) / spread, rtol=1e-4)


def test_exact_draws_follow_the_exact_marginals(samples: Make) -> None:
    exact = exact_posterior(gather(samples(10)))
    draws = exact.draw(20_000, np.random.default_rng(0))
    spread = np.sqrt(np.diag(exact.covariance))
    for k in range(3):
        marginal = stats.t(exact.degrees_of_freedom, exact.mean[k], spread[k])
        assert stats.kstest(draws[:, k], marginal.cdf).pvalue > 1e-3
    centre, width = exact.log_scale()
    assert abs(np.log(draws[:, 3]).mean() - centre) < 4 * width / np.sqrt(20_000)
    np.testing.assert_allclose(np.log(draws[:, 3]).std(), width, rtol=0.03)


def test_exact_intervals_and_predictions_cover(samples: Make, truth: np.ndarray) -> None:
    fits, level, inside, predicted = 500, 0.9, np.zeros(3), 0
    for seed in range(fits):
        model = estimators.fit(samples(30, seed=seed), method="conjugate")
        low, high = model.interval(level).T
        inside += (low <= truth) & (truth <= high)
        new = samples(1, seed=10_000 + seed)
        v, f_n = new.tangential_velocity, new.normal_force
        low, high = model.predict(v, f_n, 0.05), model.predict(v, f_n, 0.95)
        predicted += int((low <= new.friction_coefficient <= high).item())
    expected = stats.binom(fits, level)
    for count in (*inside, predicted):
        assert expected.ppf(1e-3) <= count <= expected.ppf(1.0 - 1e-3)


def test_the_prior_fades_as_data_come(samples: Make) -> None:
    few, many = (estimators.fit(samples(n), method="conjugate").diagnostics for n in (5, 5000))
    for k in range(3):
        assert many[f"prior_sensitivity_beta{k}"] < 1e-3
        assert many[f"posterior_to_prior_beta{k}"] < 0.02
        assert few[f"posterior_to_prior_beta{k}"] > 10 * many[f"posterior_to_prior_beta{k}"]


def test_where_velocity_is_constant_its_slope_is_the_priors(samples: Make) -> None:
    model = estimators.fit(samples(200, tangential_velocity=np.zeros(200)), method="conjugate")
    np.testing.assert_allclose(model.diagnostics["posterior_to_prior_beta1"], 1.0, rtol=1e-6)
    assert not model.identifiable[1]
    assert model.coefficients[1] == pytest.approx(0.0, abs=1e-9)


def test_a_slope_that_the_prior_pulls_is_not_called_known(samples: Make) -> None:
    """Rock at micrometres a second: the slope is a thousand times what the prior allows, and the prior wins in part."""
    v = np.repeat([2e-7, 2e-6], 500)
    data = samples(1000, tangential_velocity=v, coefficients=np.array([0.45, 2.6e4, 0.0]), scale=1e-3)
    model = estimators.fit(data, method="conjugate")
    assert model.diagnostics["prior_sensitivity_beta1"] > 1.0
    assert not model.identifiable[1]
    np.testing.assert_allclose(estimators.fit(data).coefficients[1], 2.6e4, rtol=0.01)  # least squares has no prior


@pytest.mark.parametrize("how", [{"method": "conjugate"}, {"method": "bayes", "likelihood": "gaussian"}])
def test_who_takes_grasps_for_independent_samples_does_not_identify_friction(
    samples: Make, how: dict[str, str]
) -> None:
    grasps = [samples(60, seed=g) for g in range(6)]
    found, other = estimators.fit(grasps, **how), estimators.fit(grasps, method="ols")
    assert found.identifiable.all()
    assert (found.support, other.support) == ("not identified", "supported")
