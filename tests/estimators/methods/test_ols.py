"""Least squares: the plane, its cluster-robust errors, and data that do not determine a plane."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from statsmodels.regression.linear_model import OLS, WLS

import estimators
from estimators import ScatterPrior
from estimators.defaults import LINEAR, REFERENCE
from estimators.methods import ols
from slipcore.samples import FrictionSamples

Make = Callable[..., FrictionSamples]
Cut = Callable[[FrictionSamples], list[FrictionSamples]]


def design(samples: FrictionSamples) -> np.ndarray:
    return np.column_stack([np.ones(len(samples)), samples.tangential_velocity, samples.normal_force])


def standard_errors(model: estimators.FrictionModel, name: str) -> np.ndarray:
    return np.array([model.diagnostics[f"standard_error_{name}_beta{k}"] for k in range(3)])


def test_coefficients_and_errors_are_those_of_statsmodels(samples: Make) -> None:
    weight = np.random.default_rng(1).uniform(0.5, 1.0, 300)
    data = samples(300, weight=weight)
    model = estimators.fit(data)
    effective = weight.sum() ** 2 / (weight @ weight)
    relative = weight * weight.sum() / (weight @ weight)
    reference = WLS(data.friction_coefficient, design(data), weights=relative).fit()
    # pinv of statsmodels loses some digits on unscaled columns; 1e-9 is far above that and far below any mistake
    np.testing.assert_allclose(model.coefficients, reference.params, rtol=1e-9)
    shrunk = np.sqrt((300 - 3) / (effective - 3))  # Kish's count stands for n
    np.testing.assert_allclose(model.scale, np.sqrt(reference.scale) * shrunk, rtol=1e-9)
    np.testing.assert_allclose(standard_errors(model, "classical"), reference.bse * shrunk, rtol=1e-9)
    np.testing.assert_allclose(standard_errors(model, "hc3"), reference.HC3_se, rtol=1e-8)
    clustered = reference.get_robustcov_results("cluster", groups=data.element)
    np.testing.assert_allclose(standard_errors(model, "cr1"), clustered.bse, rtol=1e-8)
    np.testing.assert_allclose(model.diagnostics["r_squared"], reference.rsquared, rtol=1e-9)


def inverse_root(matrix: np.ndarray) -> np.ndarray:
    values, vectors = np.linalg.eigh(matrix)
    return (vectors / np.sqrt(values)) @ vectors.T


def dense_cr2(x: np.ndarray, residual: np.ndarray, cluster: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """CR2 standard errors [3] and Satterthwaite's degrees of freedom [3] with every matrix of size n written out."""
    inverse = np.linalg.inv(x.T @ x)
    left = np.eye(len(x)) - x @ inverse @ x.T
    meat, columns = np.zeros((3, 3)), []
    for code in np.unique(cluster):
        rows = cluster == code
        adjusted = inverse_root(left[np.ix_(rows, rows)])
        score = x[rows].T @ adjusted @ residual[rows]
        meat += np.outer(score, score)
        columns.append(left[:, rows] @ adjusted @ x[rows] @ inverse)
    degrees = []
    for k in range(3):
        g = np.stack([column[:, k] for column in columns], axis=1)
        gamma = g.T @ g
        degrees.append(np.trace(gamma) ** 2 / np.sum(gamma**2))
    return np.sqrt(np.diag(inverse @ meat @ inverse)), np.array(degrees)


@pytest.mark.parametrize("elements", [9, 30])
def test_cluster_errors_and_their_degrees_of_freedom_are_those_of_cr2(
    samples: Make, places_as_grasps: Cut, elements: int
) -> None:
    data = samples(200, elements=elements)
    model = estimators.fit(places_as_grasps(data))
    x = design(data) * [1.0, 1e3, 10.0]  # well scaled, as the dense formula needs it
    residual = data.friction_coefficient - design(data) @ model.coefficients
    wanted, degrees = dense_cr2(x, residual, data.element)
    found = np.array([model.diagnostics[f"degrees_of_freedom_beta{k}"] for k in range(3)])
    np.testing.assert_allclose(standard_errors(model, "cluster"), wanted * [1.0, 1e3, 10.0], rtol=1e-7)
    np.testing.assert_allclose(found, degrees, rtol=1e-7)
    assert (found < elements - 1).all()
    half = stats.t(degrees).ppf(0.975) * wanted * [1.0, 1e3, 10.0]
    np.testing.assert_allclose(model.interval()[:, 1] - model.coefficients, half, rtol=1e-6)
    alone = estimators.fit(data)  # as places of one grasp
    np.testing.assert_allclose(standard_errors(alone, "cluster"), standard_errors(model, "cluster"), rtol=1e-9)
    of_others = ScatterPrior().effect_quantile(0.975) * alone.coefficients
    np.testing.assert_allclose(alone.interval()[:, 1] - alone.coefficients, np.hypot(half, of_others), rtol=1e-6)


@pytest.mark.parametrize("method", ["ols", "robust"])
def test_intervals_of_one_grasp_hold_the_law_of_all(samples: Make, truth: np.ndarray, method: str) -> None:
    """Of grasps that differ by 7 %, as the prior has it. Errors within the grasp alone hold friction in one of four."""
    fits, inside, within = 150, np.zeros(3), np.zeros(3)
    rng = np.random.default_rng(8)
    for seed in range(fits):
        own = truth * (1.0 + 0.07 * rng.standard_normal())
        model = estimators.fit(samples(200, seed=seed, coefficients=own), method=method)
        low, high = model.interval().T
        inside += (low <= truth) & (truth <= high)
        within += np.abs(model.coefficients - truth) < 1.96 * standard_errors(model, "cluster")
    assert (inside >= stats.binom(fits, 0.95).ppf(1e-3)).all()
    assert within[0] < 0.5 * fits


def test_degrees_of_freedom_fall_where_one_cluster_tells_most(samples: Make) -> None:
    even = estimators.fit([samples(60, seed=g) for g in range(10)])
    uneven = estimators.fit([samples(2000 if g == 0 else 30, seed=g) for g in range(10)])
    assert even.degrees_of_freedom > 8.5
    assert uneven.degrees_of_freedom < 3.0


@pytest.mark.parametrize("fits", [150, pytest.param(400, marks=pytest.mark.long)])
def test_intervals_cover_the_truth_and_predictions_a_new_observation(
    samples: Make, places_as_grasps: Cut, truth: np.ndarray, fits: int
) -> None:
    level = 0.9
    inside, predicted = np.zeros(3), 0
    for seed in range(fits):
        model = estimators.fit(places_as_grasps(samples(200, seed=seed, elements=40)))
        low, high = model.interval(level).T
        inside += (low <= truth) & (truth <= high)
        new = samples(1, seed=10_000 + seed)
        v, f_n = new.tangential_velocity, new.normal_force
        predicted += int(
            (model.predict(v, f_n, 0.05) <= new.friction_coefficient <= model.predict(v, f_n, 0.95)).item()
        )
    expected = stats.binom(fits, level)
    for count in (*inside, predicted):
        assert expected.ppf(1e-3) <= count <= expected.ppf(1.0 - 1e-3)


@pytest.mark.parametrize("fits", [80, pytest.param(200, marks=pytest.mark.long)])
@pytest.mark.parametrize("grasps", [2, 3, 5, 12])
def test_intervals_do_not_undercover_where_grasps_differ(
    samples: Make, truth: np.ndarray, grasps: int, fits: int
) -> None:
    inside, classical = np.zeros(3), np.zeros(3)
    rng = np.random.default_rng([grasps, 1])
    for seed in range(fits):
        parts = [samples(30, seed=seed * 100 + g, offset=0.03 * rng.standard_normal()) for g in range(grasps)]
        model = estimators.fit(parts)
        low, high = model.interval(0.9).T
        inside += (low <= truth) & (truth <= high)
        classical += np.abs(model.coefficients - truth) < 1.65 * standard_errors(model, "classical")
    assert (inside >= stats.binom(fits, 0.9).ppf(1e-3)).all()
    assert grasps < 5 or classical[0] < inside[0] - 0.15 * fits  # what independent errors would have claimed


def test_prediction_quantile_includes_scatter_and_uncertainty(samples: Make) -> None:
    model = estimators.Moments.from_samples(samples(6)).fit()
    x = np.array([1.0, 2e-3, 0.05])
    spread = np.sqrt(model.scale**2 + x @ model.covariance @ x)
    expected = x @ model.coefficients + stats.t(3).ppf(0.1) * spread
    np.testing.assert_allclose(model.predict(2e-3, 0.05, 0.1), expected, rtol=1e-12)


def test_four_samples_leave_one_degree_of_freedom(samples: Make) -> None:
    data = samples(4, elements=1)
    model = estimators.fit(data)
    residual = data.friction_coefficient - design(data) @ model.coefficients
    np.testing.assert_allclose(model.scale, np.linalg.norm(residual), rtol=1e-6)  # residual of a nearly full fit
    assert model.degrees_of_freedom == 1.0


@pytest.mark.parametrize("speed", [0.0, 2e-3, 0.1 + 0.2])
def test_constant_velocity_leaves_its_slope_open_and_prediction_valid(
    samples: Make, places_as_grasps: Cut, speed: float
) -> None:
    data = samples(300, tangential_velocity=np.full(300, speed))
    model = estimators.fit(places_as_grasps(data))
    assert not model.identifiable[1]
    assert model.identifiable[2]
    assert model.identifiable[0] == (speed == 0.0)  # away from v = 0, the unknown slope carries β₀ with it
    assert model.coefficients[1] == 0.0  # the smallest slope that fits
    np.testing.assert_allclose(model.standard_errors[1], 1.0 / REFERENCE.tangential_velocity, rtol=1e-9)
    without = OLS(data.friction_coefficient, design(data)[:, [0, 2]]).fit()
    expected = without.predict([[1.0, 0.05]])[0]
    np.testing.assert_allclose(model.predict(speed, 0.05), expected, rtol=1e-9)
    width = model.predict(speed, 0.05, 0.95) - model.predict(speed, 0.05, 0.05)
    assert width < 4.5 * model.scale  # the open slope does not reach into the domain
    assert model.predict(speed + 5e-3, 0.05, 0.05) == 0.0  # and does beyond it, where friction may be anything
    assert model.predict(speed + 5e-3, 0.05, 0.95) > 1.0


def test_a_collinear_pair_splits_the_slope_by_the_prior() -> None:
    """The closed form: of all (β₁, β₂) that fit, the least β₁² v_ref² + β₂² f_ref²."""
    from estimators.linear.least_squares import factorise, solve

    x = np.linspace(0.0, 1.0, 50)
    spans = np.array([2.0, 3.0])
    fit = solve(factorise(np.column_stack([x, 4.0 * x, 1.0 + x])), spans)
    # minimise 4 a² + 9 b² with a + 4 b = 1: (a, b) ∝ (1/4, 4/9)
    expected = np.array([1 / 4, 4 / 9]) / (1 / 4 + 16 / 9)
    np.testing.assert_allclose(fit.coefficients.astype(float), [1.0, *expected], rtol=1e-12)  # rounding
    null = np.array([4.0, -1.0])  # prior variance along it: 1 / (nᵀ diag(spans²) n)
    np.testing.assert_allclose(fit.prior_covariance[1:, 1:], np.outer(null, null) / (null**2 @ spans**2), rtol=1e-12)


def test_noise_that_grows_as_the_inverse_force_is_covered(
    samples: Make, places_as_grasps: Cut, truth: np.ndarray
) -> None:
    fits, inside, classical = 300, np.zeros(3), np.zeros(3)
    for seed in range(fits):
        rng = np.random.default_rng([seed, 1])
        f_n = rng.uniform(0.01, 0.1, 300)
        noise = 0.02 / f_n * rng.standard_normal(300)
        data = samples(300, seed=seed, normal_force=f_n, elements=60, noise=noise)
        model = estimators.fit(places_as_grasps(data))
        low, high = model.interval(0.9).T
        inside += (low <= truth) & (truth <= high)
        classical += np.abs(model.coefficients - truth) < 1.65 * standard_errors(model, "classical")
    expected = stats.binom(fits, 0.9)
    assert (inside >= expected.ppf(1e-3)).all()
    assert classical[2] < expected.ppf(1e-3)  # the classical errors do fail here


def test_narrow_range_of_velocity_is_not_identifiable_and_a_wide_one_is(samples: Make, places_as_grasps: Cut) -> None:
    rng = np.random.default_rng(0)
    sliver = estimators.fit(samples(300, tangential_velocity=rng.uniform(1e-3, 1.02e-3, 300)))
    assert not sliver.identifiable[1]
    assert estimators.fit(places_as_grasps(samples(300))).identifiable.all()
    assert estimators.fit(samples(300)).identifiable.tolist() == [False, True, True]  # others may differ from one grasp


def test_large_samples_leave_statsmodels_out(samples: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    small = estimators.fit(samples(300))
    monkeypatch.setattr(ols, "LINEAR", replace(LINEAR, statsmodels=0))
    large = estimators.fit(samples(300))
    assert "standard_error_hc3_beta0" in small.diagnostics
    assert "standard_error_hc3_beta0" not in large.diagnostics
    np.testing.assert_array_equal(large.covariance, small.covariance)


def test_a_prediction_outside_the_data_is_warned_of(samples: Make) -> None:
    model = estimators.fit(samples(300))
    assert model.extrapolation(2e-3, 0.05) is None
    assert model.extrapolation(0.0, 0.05) is None  # a grasp that holds is the limit of slow slip
    outside = model.extrapolation(1.0, 1.0)
    assert outside is not None
    assert "tangential velocity extrapolated to 1 m/s" in outside
    assert "normal force extrapolated to 1 N an element" in outside


@pytest.mark.parametrize("shared", [0.0, 0.03])
def test_a_direction_that_one_grasp_alone_tells_is_not_taken_for_certain(shared: float) -> None:
    """Velocity differs in one grasp of twelve: how far that grasp is off as a whole, its slope cannot tell."""
    truth, covered = np.array([0.5, 2.0, -0.5]), np.zeros(3)
    for seed in range(60):
        rng = np.random.default_rng(seed)
        grasps = [_grasp_at(0.01 if g == 0 else 0.001, truth, rng, shared) for g in range(12)]
        low, high = estimators.fit(grasps).interval(0.95).T
        covered += (low <= truth) & (truth <= high)
    assert (covered >= stats.binom(60, 0.95).ppf(1e-3)).all()


def _grasp_at(velocity: float, truth: np.ndarray, rng: np.random.Generator, shared: float) -> FrictionSamples:
    v, f_n = np.full(40, velocity), rng.uniform(0.02, 0.2, 40)
    mu = truth @ np.stack([np.ones(40), v, f_n]) + 0.03 * rng.standard_normal(40) + shared * rng.standard_normal()
    return FrictionSamples(mu, v, f_n, mu * f_n, np.arange(40.0), np.arange(40) % 7, np.ones(40), 1e-6)


def test_errors_from_moments_of_grasps_are_those_from_their_samples(samples: Make) -> None:
    grasps = [samples(40 + 10 * k, seed=k) for k in range(5)]
    whole = estimators.fit(grasps)
    of_moments = estimators.fit([estimators.Moments.from_samples(grasp) for grasp in grasps])
    np.testing.assert_allclose(of_moments.covariance, whole.covariance, rtol=1e-6)
    for name in ("cluster", "classical"):
        np.testing.assert_allclose(standard_errors(of_moments, name), standard_errors(whole, name), rtol=1e-6)
