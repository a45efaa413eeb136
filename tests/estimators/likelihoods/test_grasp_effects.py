"""The random intercept: its marginal likelihood against the dense one, and intervals that cover where grasps differ."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy import stats

import estimators
from estimators.defaults import PRIOR, REFERENCE
from estimators.likelihoods.grasp_effects import grasp_effects
from estimators.linear.fit_data import gather
from estimators.linear.priors import log_half_student
from slipcore.samples import FrictionSamples

Make = Callable[..., FrictionSamples]


def grasps(samples: Make, count: int, n: int = 30, tau: float = 0.03, seed: int = 0) -> list[FrictionSamples]:
    offsets = tau * np.random.default_rng([seed, 7]).standard_normal(count)
    return [samples(n, seed=1000 * seed + g, offset=offset) for g, offset in enumerate(offsets)]


def dense_log_density(data: list[FrictionSamples], sigma: float, tau: float) -> float:
    """log p(y, log σ, log τ) with every covariance written out."""
    joined = FrictionSamples.concatenate(data)
    group = np.repeat(np.arange(len(data)), [len(part) for part in data])
    x = np.column_stack([np.ones(len(joined)), joined.tangential_velocity, joined.normal_force])
    width = PRIOR.width / np.array([1.0, REFERENCE.tangential_velocity, REFERENCE.pressure * 1e-6]) / REFERENCE.scatter
    covariance = sigma**2 * (np.eye(len(joined)) + x @ np.diag(width**2) @ x.T)
    covariance += tau**2 * (group[:, None] == group)
    mean = np.full(len(joined), REFERENCE.friction)
    log = stats.multivariate_normal(mean, covariance).logpdf(joined.friction_coefficient)
    nu = PRIOR.degrees_of_freedom
    log += stats.invgamma(nu / 2, scale=nu / 2 * REFERENCE.scatter**2).logpdf(sigma**2) + np.log(2 * sigma**2)
    log += stats.t(PRIOR.effect_degrees_of_freedom, scale=REFERENCE.scatter).logpdf(tau) + np.log(tau)
    return float(log)


def test_log_density_is_the_dense_one_up_to_a_constant(samples: Make) -> None:
    data = grasps(samples, 4, n=12)
    posterior = grasp_effects(gather(data))
    points = np.array([[0.02, 0.03], [0.03, 0.001], [0.015, 0.2], [0.05, 0.05]])
    found = posterior.log_density(*points.T)
    wanted = np.array([dense_log_density(data, *point) for point in points])
    np.testing.assert_allclose(found - found[0], wanted - wanted[0], rtol=1e-7, atol=1e-6)  # sums of about 100


def test_beta_given_the_scatters_is_generalised_least_squares(samples: Make) -> None:
    data = grasps(samples, 6, n=50)
    joined = FrictionSamples.concatenate(data)
    posterior = grasp_effects(gather(data))
    sigma, tau = 0.02, 0.03
    gamma = posterior._given(np.array([(tau / sigma) ** 2])).gamma[0]
    group = np.repeat(np.arange(6), 50)
    x = np.column_stack([np.ones(300), joined.tangential_velocity, joined.normal_force])
    inverse = np.linalg.inv(sigma**2 * np.eye(300) + tau**2 * (group[:, None] == group))
    wanted = np.linalg.solve(x.T @ inverse @ x, x.T @ inverse @ joined.friction_coefficient)
    spread = np.sqrt(np.diag(np.linalg.inv(x.T @ inverse @ x)))
    assert (
        np.abs((posterior.pooled.mean + posterior.pooled.root @ gamma - wanted) / spread).max() < 0.02
    )  # the weak prior's pull


def test_whitening_keeps_the_density(samples: Make) -> None:
    """Sampled in whitened coordinates or on a plain grid of (log σ, log τ): the same means."""
    data = grasps(samples, 5)
    posterior = grasp_effects(gather(data))
    model = estimators.fit(data, method="bayes", accuracy=0.02)
    log_sigma, log_tau = np.linspace(-4.4, -3.3, 120), np.linspace(-8.0, 1.0, 400)
    mesh = np.stack(np.meshgrid(log_sigma, log_tau, indexing="ij")).reshape(2, -1)
    log = posterior.log_density(*np.exp(mesh))
    weight = np.exp(log - log.max())
    for k, draws in enumerate(np.log(model.draws[:, 3:].T)):
        mean = np.average(mesh[k], weights=weight)
        spread = np.sqrt(np.average((mesh[k] - mean) ** 2, weights=weight))
        assert abs(draws.mean() - mean) < 0.08 * spread  # 4,000 kept draws: 5 standard errors
        np.testing.assert_allclose(draws.std(), spread, rtol=0.08)


def test_no_effect_of_grasps_is_found_as_such_and_sampled_well(samples: Make) -> None:
    model = estimators.fit(grasps(samples, 20, n=50, tau=0.0), method="bayes")
    assert model.diagnostics["move"] == "independence"
    assert model.diagnostics["acceptance"] > 0.8
    assert np.quantile(model.draws[:, 4], 0.95) < 0.3 * 0.02


def test_log_half_student_is_the_t_density() -> None:
    points = np.array([0.0, 0.01, 0.05, 0.3])
    wanted = stats.t(PRIOR.effect_degrees_of_freedom, scale=0.05).logpdf(points)
    found = log_half_student(points, 0.05)
    np.testing.assert_allclose(found - found[0], wanted - wanted[0], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("count", [3, 12])
def test_intervals_cover_where_grasps_differ_and_iid_ones_do_not(samples: Make, truth: np.ndarray, count: int) -> None:
    fits, level = 30, 0.9
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
    assert (inside[1:] <= expected.ppf(1.0 - 1e-3)).all()
    assert predicted >= expected.ppf(1e-3)
    assert naive[0] < expected.ppf(1e-2)


def test_it_is_the_default_where_samples_come_in_clusters(samples: Make) -> None:
    told = estimators.fit(grasps(samples, 5), method="bayes").diagnostics
    assert (told["likelihood"], told["cluster_kind"], told["clusters"]) == ("grasp_effects", "grasp", 5.0)
    assert "tau" in told["prior"]
    assert estimators.fit(samples(200), method="bayes").diagnostics["cluster_kind"] == "element"
    moments = estimators.Moments.from_samples(samples(200))
    assert moments.fit("bayes").diagnostics["likelihood"] == "gaussian"


def test_two_grasps_leave_the_scatter_between_them_to_the_prior(samples: Make) -> None:
    model = estimators.fit(grasps(samples, 2, n=500), method="bayes")
    tau = model.draws[:, 4]
    assert np.quantile(tau, 0.95) > 5 * np.quantile(tau, 0.05)
    assert (
        model.standard_errors[0] > 4 * estimators.fit(grasps(samples, 2, n=500), method="conjugate").standard_errors[0]
    )


def test_an_unknown_likelihood_is_refused(samples: Make) -> None:
    with pytest.raises(
        estimators.InvalidSamples, match="likelihood is cauchy; allowed: gaussian, grasp_effects, student_t"
    ):
        estimators.fit(samples(50), method="bayes", likelihood="cauchy")
