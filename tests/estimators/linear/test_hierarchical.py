"""The hierarchical model against the dense normal density that it stands for."""

from dataclasses import replace
from itertools import product
from unittest.mock import Mock

import numpy as np
import pytest
from scipy import signal, special, stats

import estimators
from estimators.defaults import GRID, PRIOR, REFERENCE
from estimators.linear import posterior_grid as grids
from estimators.linear.fit_data import FitData, gather
from estimators.linear.hierarchical import Hierarchical, hierarchical, log_prior, log_prior_of_gains
from estimators.linear.normal_inverse_gamma import exact_posterior
from estimators.linear.normal_mixture import matched_student, mixture_quantile
from estimators.linear.posterior_grid import posterior_grid
from estimators.linear.priors import weak_spans
from estimators.linear.unknown_velocity import columns_off
from slipcore.samples import FrictionSamples

TRUTH = np.array([0.45, 8.0, -0.8])


def grasp(seed: int, tau: float = 0.06, omega: float = 0.02, sigma: float = 0.03, n: int = 60) -> FrictionSamples:
    """A grasp whose law is scaled as a whole, and whose places differ; of one moment, so that no errors may last."""
    rng = np.random.default_rng([seed, 17])
    place = rng.integers(0, 8, n)
    v, f_n = rng.uniform(1e-4, 5e-3, n), rng.uniform(0.05, 0.2, 8)[place] * rng.uniform(0.8, 1.2, n)
    law = (TRUTH @ [np.ones(n), v, f_n]) * (1.0 + tau * rng.standard_normal())
    mu = law + omega * rng.standard_normal(8)[place] + sigma * rng.standard_normal(n)
    return FrictionSamples(mu, v, f_n, mu * f_n, np.zeros(n), place, np.ones(n), 1e-6)


def dense(
    data: FitData,
    about: np.ndarray,
    offset: float,
    scales: tuple[float, ...],
    kappa: float = 0.0,
    slope: float = 0.0,
) -> tuple[float, np.ndarray, np.ndarray]:
    """Log density of μ, and mean and covariance of β, from covariance matrices of all samples.

    ``slope``: the precision, (m/s)², of what is assumed of β₁.
    """
    sigma, tau, omega = scales
    seen = data.observations
    assert seen is not None
    x = np.column_stack([np.ones(len(seen)), seen.tangential_velocity, seen.normal_force])
    place, expected = seen.place(), x @ about
    for grasp in range(int(seen.grasp.max()) + 1):
        own = seen.grasp == grasp
        if len(np.unique(place[own])) == 1:  # whose level alone its grasp scales
            expected[own] = np.average(expected[own], weights=seen.weight[own])
    noise = np.diag(sigma**2 / seen.weight)
    noise += omega**2 * (place[:, None] == place)
    for column in columns_off(float(data.mean_row()[2])):
        off = np.where(seen.velocity_is_relative, x @ column, 0.0)
        noise += offset * np.outer(off, off)
    noise += tau**2 * (seen.grasp[:, None] == seen.grasp) * np.outer(expected, expected)
    sensor = np.array(seen.sensors)[seen.grasp]
    noise += kappa**2 * (sensor[:, None] == sensor) * np.outer(expected, expected)
    rows = np.diag(np.concatenate([[1.0], weak_spans(data.domain, data.element_area)]))
    rows[0] = data.mean_row()
    weak = rows.T @ rows / PRIOR.width**2
    precision = weak + slope * np.diag([0.0, 1.0, 0.0])
    centre = np.linalg.solve(precision, weak @ np.linalg.solve(rows, [REFERENCE.friction, 0.0, 0.0]))
    marginal = stats.multivariate_normal(x @ centre, noise + x @ np.linalg.solve(precision, x.T))
    covariance = np.linalg.inv(precision + x.T @ np.linalg.solve(noise, x))
    mean = covariance @ (precision @ centre + x.T @ np.linalg.solve(noise, seen.friction))
    return float(marginal.logpdf(seen.friction)), mean, covariance


def assert_as_dense(
    model: Hierarchical, data: FitData, about: np.ndarray, points: list[tuple[float, float, float]], slope: float = 0.0
) -> None:
    """Mean and covariance at each σ, τ and ω, and how the density differs between these."""
    ours, theirs = [], []
    for sigma, tau, omega in points:
        ratios = np.log([tau**2 / sigma**2]), np.log([omega**2 / sigma**2])
        given = model.conditional(model.whole(model.products(*ratios)), np.stack([np.log([sigma]), *ratios]))
        log, mean, covariance = dense(data, about, model.offset, (sigma, tau, omega), slope=slope)
        np.testing.assert_allclose(given.mean[0], mean, rtol=1e-8, atol=1e-9)
        np.testing.assert_allclose(given.covariance[0], covariance, rtol=1e-7, atol=1e-9)
        ours.append(given.log_density[0] - log_prior(*np.log([[sigma], [tau], [omega]]))[0])
        theirs.append(log)
    np.testing.assert_allclose(np.diff(ours), np.diff(theirs), rtol=1e-8, atol=1e-7)


@pytest.mark.parametrize(("count", "unknown"), [(1, 0), (3, 0), (3, 2), (2, 2)])
def test_density_and_coefficients_are_those_of_the_dense_model(count: int, unknown: int) -> None:
    data = gather([replace(grasp(k), velocity_is_relative=np.full(60, k < unknown)) for k in range(count)])
    pooled = exact_posterior(data)
    about = np.array([0.42, 6.0, -0.5])
    spans = weak_spans(data.domain, data.element_area)
    model = hierarchical(data.grasp_statistics(), pooled, spans, data.mean_row()).centred_at(about)
    points = [(0.03, 0.05, 0.02), (0.02, 0.2, 0.001), (0.05, 0.001, 0.05), (0.03, 0.5, 0.3)]
    assert_as_dense(model, data, about, points)


@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize("spread", [0.0, 0.01])
def test_what_is_assumed_of_a_slope_is_in_density_and_coefficients_as_in_the_dense_model(
    count: int, spread: float
) -> None:
    v = 5e-3 * (1.0 + spread * np.random.default_rng(5).standard_normal(60))
    data = gather([replace(grasp(k), tangential_velocity=v) for k in range(count)])
    grid = posterior_grid(data)
    assert grid.slope is not None
    about = grid.model.pooled.root @ grid.model.direction
    points = [(0.03, 0.05, 0.02), (0.02, 0.2, 0.001), (0.05, 0.001, 0.05)]
    assert_as_dense(grid.model, data, about, points, grid.slope.precision)


def test_of_grasps_of_one_place_only_the_level_is_scaled() -> None:
    grasps = [grasp(k) for k in range(4)]
    data = gather([replace(part, element=part.element * (k % 2)) for k, part in enumerate(grasps)])
    model = hierarchical(
        data.grasp_statistics(),
        exact_posterior(data),
        weak_spans(data.domain, data.element_area),
        data.mean_row(),
    ).centred_at(TRUTH)
    assert_as_dense(model, data, TRUTH, [(0.03, 0.05, 0.02), (0.02, 0.2, 0.001), (0.03, 0.5, 0.3)])


def test_slopes_that_errors_over_time_feign_are_no_scatter_between_grasps() -> None:
    """Grasps of one place each, as of a force sensor: their scatter of 3 % is found, whatever slopes they show."""
    rng, count = np.random.default_rng(3), 400
    grasps = []
    for _ in range(12):
        drift = [signal.lfilter([0.1], [1.0, -0.995], rng.standard_normal(3000))[-count:] for _ in range(3)]
        v, f_n = np.abs(2e-3 + 5e-4 * drift[0]), 5.0 + 0.3 * drift[1]
        mu = (1.0 + 0.03 * rng.standard_normal()) * (0.5 + 4.0 * v - 0.01 * f_n) + 0.01 * drift[2]
        time, one = np.arange(count) * 0.005, np.ones(count)
        grasps.append(FrictionSamples(mu, v, f_n, mu * f_n, time, np.zeros(count, dtype=np.int64), one, 1e-4))
    model = estimators.fit(grasps, method="hierarchical")
    assert model.scales is not None
    assert 0.015 < model.scales.between_grasps.value < 0.06


@pytest.mark.parametrize("unknown", [0, 2])
def test_density_and_coefficients_of_several_sensors_are_those_of_the_dense_model(unknown: int) -> None:
    grasps = [replace(grasp(k), velocity_is_relative=np.full(60, k < unknown)) for k in range(5)]
    data = gather([replace(part, sensor="left" if k in {0, 2, 3} else "right") for k, part in enumerate(grasps)])
    about = np.array([0.42, 6.0, -0.5])
    spans = weak_spans(data.domain, data.element_area)
    model = hierarchical(data.grasp_statistics(), exact_posterior(data), spans, data.mean_row()).centred_at(about)
    points = [(0.03, 0.05, 0.02, 0.1), (0.02, 0.2, 0.001, 0.01), (0.05, 0.001, 0.05, 1.0), (0.03, 0.5, 0.3, 1e-4)]
    ours, theirs = [], []
    for sigma, tau, omega, kappa in points:
        ratios = 2.0 * np.log(np.array([[tau], [omega], [kappa]]) / sigma)
        whole = model.whole(model.products(ratios[0], ratios[1]), ratios[2])
        given = model.conditional(whole, np.stack([np.log([sigma]), *ratios]))
        log, mean, covariance = dense(data, about, model.offset, (sigma, tau, omega), kappa)
        np.testing.assert_allclose(given.mean[0], mean, rtol=1e-8)  # of what is summed in another order
        np.testing.assert_allclose(given.covariance[0], covariance, rtol=1e-7, atol=1e-12)
        prior = log_prior(*np.log([[sigma], [tau], [omega]])) + log_prior_of_gains(np.log([kappa]))
        ours.append((given.log_density - prior)[0])
        theirs.append(log)
    np.testing.assert_allclose(np.diff(ours), np.diff(theirs), rtol=1e-8, atol=1e-7)


@pytest.mark.parametrize("count", [1, 4])
def test_a_finer_grid_changes_nothing(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    data = gather([grasp(k) for k in range(count)])
    coarse = posterior_grid(data).nodes
    nodes, weights = np.polynomial.hermite_e.hermegauss(15)
    finer = replace(GRID, fine=60, depth=14.0)
    for name, value in (("GRID", finer), ("SIGMA_NODES", nodes), ("SIGMA_WEIGHTS", weights)):
        monkeypatch.setattr(grids, name, value)
    fine = posterior_grid(data).nodes
    for k in range(3):
        low, high = (
            mixture_quantile(part.weight, part.mean[:, k], np.sqrt(part.covariance[:, k, k]), [0.025, 0.5, 0.975])
            for part in (coarse, fine)
        )
        np.testing.assert_allclose(low, high, atol=0.02 * np.ptp(high))
    np.testing.assert_allclose(coarse.weight @ coarse.scatter, fine.weight @ fine.scatter, rtol=0.03)


def test_the_scales_are_found() -> None:
    scales = estimators.fit([grasp(k, n=300) for k in range(60)], method="hierarchical").scales
    assert scales is not None
    assert abs(scales.between_grasps.value - 0.06) < 3 * 0.06 / np.sqrt(2 * 60)
    assert abs(scales.between_places.value - 0.02) < 3 * 0.02 / np.sqrt(2 * 60 * 7)
    assert abs(scales.within.value - 0.03) < 3 * 0.03 / np.sqrt(2 * 60 * 290)
    assert 20.0 < scales.between_grasps.degrees_of_freedom < 120.0


def test_intervals_shrink_as_grasps_come_and_one_grasp_answers() -> None:
    widths = [
        np.ptp(estimators.fit([grasp(k) for k in range(count)], method="hierarchical").interval()[0])
        for count in (1, 3, 10, 40)
    ]
    assert np.isfinite(widths).all()
    assert (np.diff(widths) < 0.0).all()


@pytest.mark.parametrize("fits", [24, pytest.param(60, marks=pytest.mark.long)])
@pytest.mark.parametrize("scatter", [(0.06, 0.0, 0.03), (0.0, 0.03, 0.005), (0.0, 0.0, 0.03), (0.06, 0.03, 0.03)])
def test_intervals_cover_whatever_scatters(scatter: tuple[float, float, float], fits: int) -> None:
    inside = np.zeros(3)
    for seed in range(fits):
        low, high = (
            estimators.fit([grasp(1000 * seed + k, *scatter) for k in range(4)], method="hierarchical").interval().T
        )
        inside += (low <= TRUTH) & (high >= TRUTH)
    assert (inside >= stats.binom(fits, 0.95).ppf(1e-3)).all(), inside


@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_units_of_force_do_not_matter(unit: float) -> None:
    grasps = [grasp(k) for k in range(3)]
    model = estimators.fit(grasps, method="hierarchical")
    other = estimators.fit([part.at_element_area(unit * 1e-6) for part in grasps], method="hierarchical")
    factor = np.array([1.0, 1.0, 1.0 / unit])
    np.testing.assert_allclose(other.coefficients, model.coefficients * factor, rtol=1e-6)
    np.testing.assert_allclose(other.covariance, model.covariance * np.outer(factor, factor), rtol=1e-4)


def flat(part: FrictionSamples, name: str) -> FrictionSamples:
    from dataclasses import replace

    return replace(part, **{name: np.full(len(part), float(getattr(part, name).mean()))})


@pytest.mark.parametrize("name", ["tangential_velocity", "normal_force"])
def test_a_regressor_that_never_varies_is_not_identified(name: str) -> None:
    model = estimators.fit([flat(grasp(k), name) for k in range(4)], method="hierarchical")
    which = 1 if name == "tangential_velocity" else 2
    assert not model.identifiable[which]
    low, high = model.predict(2.5e-3, 0.125, 0.005), model.predict(2.5e-3, 0.125, 0.995)
    assert 0.1 < low < model.predict(2.5e-3, 0.125) < high < 0.7


def test_friction_without_any_scatter_is_found_all_the_same() -> None:
    model = estimators.fit([grasp(k, 0.0, 0.0, 0.0) for k in range(3)], method="hierarchical")
    np.testing.assert_allclose(model.coefficients, TRUTH, rtol=5e-3)
    assert model.scales is not None
    assert model.scales.within.value < 3e-3


def test_a_student_is_matched_to_its_own_mixture() -> None:
    rank = (np.arange(4000) + 0.5) / 4000
    deviation = 0.3 * np.sqrt(9.0 / stats.chi2(9).ppf(rank))
    found = matched_student(np.full(4000, 1 / 4000), np.zeros(4000), deviation)
    np.testing.assert_allclose(found, (0.3, 9.0), rtol=0.03)
    moved = matched_student(np.full(4000, 1 / 4000), np.full(4000, 0.1), deviation)
    np.testing.assert_allclose(moved, found, rtol=1e-6)


def test_the_quantile_of_a_mixture_is_where_its_distribution_says() -> None:
    weight, mean, deviation = np.array([0.2, 0.5, 0.3]), np.array([-1.0, 0.0, 2.0]), np.array([0.5, 0.1, 1.0])
    at = mixture_quantile(weight, mean, deviation, [1e-3, 0.3, 0.9])
    np.testing.assert_allclose(stats.norm(mean, deviation).cdf(at[:, None]) @ weight, [1e-3, 0.3, 0.9], atol=1e-9)


def test_a_quantile_that_newton_meets_exactly_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    ndtr, most = Mock(wraps=special.ndtr), 0
    monkeypatch.setattr(special, "ndtr", ndtr)
    for parts, spread in product((2, 3, 5, 10), np.linspace(0.02, 0.6, 30)):
        ndtr.reset_mock()
        weight, deviation = np.full(parts, 1.0 / parts), np.linspace(1.0, 1.0 + spread, parts)
        mixture_quantile(weight, np.zeros(parts), deviation, [0.975, 0.999])
        most = max(most, ndtr.call_count)
    assert most <= 7  # quadratic convergence; bisection from an exact quantile: 14


def test_a_narrow_range_of_force_far_from_zero_pulls_nothing() -> None:
    """Of forces of 5 N that vary by noise alone, the intercept at 0 N is anything, and friction at 5 N is known."""
    rng = np.random.default_rng(0)
    f_n, v = 5.0 + 2e-3 * rng.standard_normal(4000), rng.uniform(1e-4, 3e-4, 4000)
    mu = 0.43 + 0.9 * (f_n - 5.0) + 0.05 * rng.standard_normal(4000)
    one = np.ones(4000)
    record = FrictionSamples(mu, v, f_n, mu * f_n, np.arange(4000.0), np.zeros(4000, dtype=np.int64), one, 1e-6)
    model = estimators.fit(record, method="hierarchical")
    assert model.predict(2e-4, 5.0) == pytest.approx(0.43, abs=0.02)
    assert model.scales is not None
    assert model.scales.between_grasps.value < 0.15


def test_the_last_grid_has_more_nodes_for_two_scales_than_for_three() -> None:
    one = [grasp(seed) for seed in range(3)]
    several = [replace(each, sensor=f"{seed}") for seed, each in enumerate(one)]
    assert [len(axis) for axis in posterior_grid(gather(one)).axes] == [GRID.fine] * 2
    axes = posterior_grid(gather(several)).axes
    assert [len(axis) for axis in axes[:2]] == [GRID.beside_gains] * 2
    assert GRID.beside_gains < GRID.fine


def test_the_shift_by_the_prior_is_that_of_the_dense_model_whose_prior_is_twice_as_wide(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    data = gather([grasp(k, n=6) for k in range(2)])
    grid = posterior_grid(data)
    lam, rho = (
        float(axis[place])
        for axis, place in zip(
            grid.axes, np.unravel_index(grid.log_marginal.argmax(), grid.log_marginal.shape), strict=True
        )
    )
    whole = grid.model.whole(grid.model.products(np.array([lam]), np.array([rho])))
    sigma = float(np.exp(grid.model.log_sigma(whole)[0][0]))
    about = grid.model.pooled.root @ grid.model.direction
    scales = sigma, sigma * float(np.exp(0.5 * lam)), sigma * float(np.exp(0.5 * rho))
    assert grid.slope is not None  # of so few samples
    slope = grid.slope.precision
    _, narrow, covariance = dense(data, about, grid.model.offset, scales, slope=slope)
    monkeypatch.setitem(globals(), "PRIOR", replace(PRIOR, width=2.0 * PRIOR.width))
    _, wide, _ = dense(data, about, grid.model.offset, scales, slope=0.25 * slope)
    expected = np.abs(wide - narrow) / np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(grid.prior_shift(), expected, rtol=1e-5)
    assert expected.min() > 1e-5
