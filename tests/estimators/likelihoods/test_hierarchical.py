"""The scales sampled by emcee against the same posterior on a grid, and against data whose scales are known."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy import stats

import estimators
from estimators.defaults import PRIOR
from estimators.likelihoods.hierarchical import hierarchical
from estimators.linear.fit_data import gather
from estimators.linear.normal_mixture import mixture_quantile
from estimators.linear.priors import log_half_student
from slipcore.samples import FrictionSamples

Make = Callable[..., FrictionSamples]


def grasps(samples: Make, count: int, n: int = 30, tau: float = 0.08, seed: int = 0) -> list[FrictionSamples]:
    """Grasps that scale the law as a whole."""
    factors = 1.0 + tau * np.random.default_rng([seed, 7]).standard_normal(count)
    truth = np.array([0.4, 2.0, -0.8])
    return [samples(n, seed=1000 * seed + g, coefficients=truth * factor) for g, factor in enumerate(factors)]


@pytest.mark.parametrize("count", [1, 4, 20])
def test_the_sampled_posterior_is_the_one_on_the_grid(samples: Make, count: int) -> None:
    data = gather(grasps(samples, count, n=60))
    nodes = hierarchical(data).grid.nodes
    model = estimators.fit(grasps(samples, count, n=60), method="bayes", accuracy=0.02, seed=1)
    exact = estimators.fit(grasps(samples, count, n=60), method="hierarchical")
    assert model.draws is not None
    for k, column in enumerate(np.log(model.draws[:, 3:].T)):
        wanted = np.log(nodes.scatter[:, k])
        mean = nodes.weight @ wanted
        spread = np.sqrt(nodes.weight @ (wanted - mean) ** 2)
        assert abs(column.mean() - mean) < 0.1 * spread  # 4,000 draws of a chain: five standard errors
        np.testing.assert_allclose(column.std(), spread, rtol=0.1)
    assert (np.abs(model.coefficients - exact.coefficients) < 0.02 * exact.standard_errors).all()
    np.testing.assert_allclose(model.standard_errors, exact.standard_errors, rtol=0.05)
    for k in range(3):
        low, high = mixture_quantile(nodes.weight, nodes.mean[:, k], np.sqrt(nodes.covariance[:, k, k]), [0.025, 0.975])
        np.testing.assert_allclose(model.interval()[k], [low, high], atol=0.1 * (high - low))


def test_sums_between_nodes_are_those_of_the_grasps_themselves(samples: Make) -> None:
    posterior = hierarchical(gather(grasps(samples, 5)))
    grid, rng = posterior.grid, np.random.default_rng(0)
    log_lambda, log_rho = (rng.uniform(axis[0], axis[-1], 40) for axis in grid.axes)
    found = posterior.products(log_lambda, log_rho)
    exact = [grid.model.products(log_lambda[[k]], log_rho[[k]]) for k in range(40)]
    away = found.log_determinant - np.array([sums.log_determinant[0] for sums in exact])
    assert np.sqrt(np.mean(away**2)) < 0.02  # of the log density, the half of it
    np.testing.assert_allclose(found.square, [sums.square[0] for sums in exact], rtol=2e-3, atol=1e-3)


def test_no_effect_of_grasps_is_found_as_such_and_sampled_well(samples: Make) -> None:
    model = estimators.fit(grasps(samples, 20, n=50, tau=0.0), method="bayes")
    assert model.diagnostics["move"] == "independence"
    assert model.diagnostics["acceptance"] > 0.7
    assert model.draws is not None
    assert np.quantile(model.draws[:, 4], 0.95) < 0.03  # of a friction of 0.37; σ is 0.02


def test_log_half_student_is_the_t_density() -> None:
    points = np.array([0.0, 0.01, 0.05, 0.3])
    for degrees in (PRIOR.effect_degrees_of_freedom, 7.0):
        wanted = stats.t(degrees, scale=0.05).logpdf(points)
        found = log_half_student(points, 0.05, degrees)
        np.testing.assert_allclose(found - found[0], wanted - wanted[0], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("fits", [12, pytest.param(30, marks=pytest.mark.long)])
@pytest.mark.parametrize("count", [3, 12])
def test_intervals_cover_where_grasps_differ_and_iid_ones_do_not(
    samples: Make, truth: np.ndarray, count: int, fits: int
) -> None:
    level = 0.9
    inside, naive, predicted = np.zeros(3), np.zeros(3), 0
    for seed in range(fits):
        data = grasps(samples, count + 1, seed=seed)
        model = estimators.fit(data[:-1], method="bayes", accuracy=0.1, seed=seed)
        low, high = model.interval(level).T
        inside += (low <= truth) & (truth <= high)
        low, high = estimators.fit(data[:-1], method="conjugate").interval(level).T
        naive += (low <= truth) & (truth <= high)
        new = data[-1]
        v, f_n = new.tangential_velocity[0], new.normal_force[0]
        low, high = model.predict(v, f_n, 0.05), model.predict(v, f_n, 0.95)
        predicted += int(low <= new.friction_coefficient[0] <= high)
    expected = stats.binom(fits, level)
    assert (inside >= expected.ppf(1e-3)).all()
    assert predicted >= expected.ppf(1e-3)
    assert naive[0] < expected.ppf(1e-2)


def test_it_is_the_default_where_samples_come_in_clusters(samples: Make) -> None:
    told = estimators.fit(grasps(samples, 5), method="bayes").diagnostics
    assert (told["likelihood"], told["cluster_kind"], told["clusters"]) == ("hierarchical", "grasp", 5.0)
    assert "tau" in told["prior"]
    assert estimators.fit(samples(200), method="bayes").diagnostics["cluster_kind"] == "element"
    known = estimators.Moments.from_samples(samples(200))
    assert known.fit("bayes").diagnostics["likelihood"] == "hierarchical"
    unknown = estimators.Moments.from_samples(samples(200), places=False)
    assert unknown.fit("bayes").diagnostics["likelihood"] == "gaussian"


def test_two_grasps_leave_the_scatter_between_them_to_the_prior(samples: Make) -> None:
    model = estimators.fit(grasps(samples, 2, n=500), method="bayes")
    assert model.draws is not None
    tau = model.draws[:, 4]
    assert np.quantile(tau, 0.95) > 4 * np.quantile(tau, 0.05)
    assert (
        model.standard_errors[0] > 4 * estimators.fit(grasps(samples, 2, n=500), method="conjugate").standard_errors[0]
    )


def test_the_former_name_is_understood_and_an_unknown_one_refused(samples: Make) -> None:
    with pytest.warns(DeprecationWarning, match="hierarchical"):
        former = estimators.fit(grasps(samples, 3), method="bayes", likelihood="grasp_effects")
    assert former.diagnostics["likelihood"] == "hierarchical"
    with pytest.raises(
        estimators.InvalidSamples, match="likelihood is cauchy; allowed: gaussian, hierarchical, student_t"
    ):
        estimators.fit(samples(50), method="bayes", likelihood="cauchy")
