"""Likelihoods that read every sample: against SciPy's densities, on their own data, and on data without fault."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy import integrate, stats

import estimators
from estimators.defaults import PRIOR
from estimators.likelihoods import errors_in_variables, kernels, outlier, student_t
from estimators.likelihoods.per_sample import Rows
from estimators.sampling.laplace import refine
from slipcore.samples import FrictionSamples

Make = Callable[..., FrictionSamples]


def rows(n: int = 40, seed: int = 0) -> Rows:
    rng = np.random.default_rng(seed)
    f_n, mu = rng.uniform(0.02, 0.1, n), rng.normal(0.36, 0.05, n)
    return Rows(rng.uniform(0, 5e-3, n), f_n, mu, mu * f_n, rng.uniform(0.5, 1.0, n))


def plane(beta: np.ndarray, part: Rows) -> np.ndarray:
    return np.asarray(beta @ np.stack([np.ones(len(part.v)), part.v, part.f_n]))


BETA = np.array([[0.4, 2.0, -0.8], [0.38, 1.0, -0.5]])


def test_student_t_is_scipys() -> None:
    part, natural = rows(), np.array([[0.02, 4.0], [0.05, 30.0]])
    found = student_t.StudentT().log_likelihood(BETA, natural, part)
    wanted = [
        part.weight @ stats.t(nu, plane(beta, part), sigma).logpdf(part.friction)
        for beta, (sigma, nu) in zip(BETA, natural, strict=True)
    ]
    constant = 0.5 * np.log(np.pi) * part.weight.sum()  # left out
    np.testing.assert_allclose(found - constant, wanted, rtol=1e-12)


def test_the_prior_of_outliers_is_that_of_their_part() -> None:
    """Beta(1, c) of the part π, by whichever coordinate it is told: its density there has the factor dπ."""
    root, step = np.linspace(0.1, 0.75, 8), 1e-6

    def at(place: np.ndarray) -> np.ndarray:
        return np.column_stack([np.full_like(place, -3.0), place, np.ones_like(place), np.zeros_like(place)])

    one = outlier.Outlier()
    part = one.natural(at(root))[:, 1]
    change = (one.natural(at(root + step))[:, 1] - one.natural(at(root - step))[:, 1]) / (2.0 * step)
    density = stats.beta(1.0, PRIOR.clean).logpdf(part) + np.log(change)
    difference = one.log_prior(at(root)) - density
    np.testing.assert_allclose(difference, difference[0], rtol=0.0, atol=1e-8, err_msg="finite differences")


def test_outlier_is_the_mixture_of_two_normals() -> None:
    part, natural = rows(), np.array([[0.02, 0.1, 0.2, -0.1], [0.05, 0.4, 0.3, 0.05]])
    found = outlier.Outlier().log_likelihood(BETA, natural, part)
    wanted = []
    for beta, (sigma, pi, wide, offset) in zip(BETA, natural, strict=True):
        mean = plane(beta, part)
        near, far = stats.norm(mean, sigma).pdf(part.friction), stats.norm(mean + offset, wide).pdf(part.friction)
        wanted.append(part.weight @ np.log((1.0 - pi) * near + pi * far))
    constant = 0.5 * np.log(2.0 * np.pi) * part.weight.sum()  # left out
    np.testing.assert_allclose(found - constant, wanted, rtol=1e-12)


def test_errors_in_variables_has_the_mean_and_variance_of_the_integral_over_the_true_force() -> None:
    """One sample: f_t given the measured f_n, against quadrature over the true f_n and its noise."""
    mean, variance, noise, sigma = 0.06, 5e-4, 2e-3, 0.02
    terms = errors_in_variables.ErrorsInVariables(mean, variance, gain=10.0, noise_scale=1.0, prior="")
    measured, v, beta = 0.04, 3e-3, BETA[:1]
    kept = 1.0 - noise**2 / variance
    true = stats.norm(mean + kept * (measured - mean), np.sqrt(kept) * noise)

    def expected(f: float) -> float:
        return float(beta[0] @ [1.0, v, f])

    ends = true.ppf([1e-9, 1.0 - 1e-9])
    first = integrate.quad(lambda f: true.pdf(f) * f * expected(f), *ends)[0]
    second = integrate.quad(lambda f: true.pdf(f) * (f**2 * (expected(f) ** 2 + sigma**2) + noise**2), *ends)[0]
    points = np.linspace(0.01, 0.02, 5)
    natural = np.array([[sigma, noise]])
    found = [
        terms.log_likelihood(
            beta, natural, Rows(np.array([v]), np.array([measured]), np.ones(1), np.array([t]), np.ones(1))
        )[0]
        for t in points
    ]
    wanted = stats.norm(first, np.sqrt(second - first**2)).logpdf(points) + 0.5 * np.log(2.0 * np.pi)
    np.testing.assert_allclose(found, wanted, rtol=1e-3)  # the square of the force's error is left out of its spread


def heavy(samples: Make, n: int) -> FrictionSamples:
    return samples(n, noise=np.random.default_rng(1).standard_t(3.0, n))


def false_slip(samples: Make, n: int) -> FrictionSamples:
    rng = np.random.default_rng(2)
    data = samples(n)
    low = data.friction_coefficient - rng.uniform(0.0, 0.3, n)
    return replace(data, friction_coefficient=np.where(rng.random(n) < 0.15, low, data.friction_coefficient))


def noisy_forces(samples: Make, n: int) -> FrictionSamples:
    rng = np.random.default_rng(3)
    data = samples(n, normal_force=rng.uniform(0.05, 0.15, n))
    f_n, f_t = (f + 5e-3 * rng.standard_normal(n) for f in (data.normal_force, data.tangential_force))
    return replace(data, normal_force=f_n, tangential_force=f_t, friction_coefficient=f_t / f_n)


CASES = {
    "student_t": (heavy, {3: 0.02, 4: 3.0}),
    "outlier": (false_slip, {3: 0.02}),
    "errors_in_variables": (noisy_forces, {3: 0.02, 4: 5e-3}),
}


@pytest.mark.parametrize("likelihood", CASES)
def test_each_recovers_its_own_truth_where_least_squares_does_not(
    samples: Make, truth: np.ndarray, likelihood: str
) -> None:
    spoil, parameters = CASES[likelihood]
    data = spoil(samples, 3000)
    model = estimators.fit(data, method="bayes", likelihood=likelihood, accuracy=0.1)
    assert np.abs((model.coefficients - truth) / model.standard_errors).max() < 3.5
    for column, value in parameters.items():
        draws = model.draws[:, column]
        assert abs(draws.mean() - value) < 4.0 * draws.std()
    plain = estimators.Moments.from_samples(data).fit()
    errors = np.array([plain.diagnostics[f"standard_error_classical_beta{k}"] for k in range(3)])
    worst = np.abs((plain.coefficients - truth) / errors).max()
    assert likelihood == "student_t" or worst > 2.5
    assert likelihood != "student_t" or model.standard_errors[0] < 0.9 * errors[0]


@pytest.mark.parametrize("likelihood", CASES)
def test_each_gives_the_exact_answer_on_clean_data(samples: Make, likelihood: str) -> None:
    data = samples(600)
    model, exact = (
        estimators.fit(data, method="bayes", likelihood=likelihood),
        estimators.fit(data, method="conjugate"),
    )
    assert model.diagnostics["move"] == "independence"
    dearer = model.standard_errors / exact.standard_errors
    np.testing.assert_allclose(dearer, 1.0, rtol=0.06)  # 4 % at most on twelve such sets
    # the difference of an estimate from the best one has the difference of their variances (Hausman, 1978)
    scatter = np.sqrt(np.maximum(dearer**2 - 1.0, 0.0) + 0.05**2)  # Monte-Carlo error 0.02 each, of modes and means
    assert np.abs((model.coefficients - exact.coefficients) / (scatter * exact.standard_errors)).max() < 3.5


def test_coordinates_of_scatter_and_noise_leave_the_prior_as_it_is_stated() -> None:
    """Density of coordinates = density of (log σ, s) × Jacobian, here by central differences."""
    terms = errors_in_variables.ErrorsInVariables(0.06, 5e-4, gain=12.0, noise_scale=3e-3, prior="")
    at = np.array([[np.log(0.02), 0.3], [np.log(0.03), 1.4], [np.log(0.01), 0.01]])

    def physical(coordinates: np.ndarray) -> np.ndarray:
        sigma, noise = terms.natural(coordinates).T
        return np.column_stack([np.log(sigma), noise])

    steps = 1e-5 * np.eye(2)
    columns = [(physical(at + step) - physical(at - step)) / 2e-5 for step in steps]
    jacobian = np.abs(np.linalg.det(np.stack(columns, axis=2)))
    stated = stats.t(4.0, scale=3e-3).logpdf(terms.natural(at)[:, 1])
    constant = terms.log_prior(at) - stated - np.log(jacobian)
    np.testing.assert_allclose(constant, constant[0], atol=1e-6)  # differences are good to 1e-8 of a value


@pytest.mark.parametrize("seed", [4, 6, 7])
def test_few_samples_do_not_tell_scatter_from_noise_and_yet_converge(samples: Make, seed: int) -> None:
    """Much of the arc from σ = 0 to s = 0 is possible, and no end of it holds a walker for long."""
    rng = np.random.default_rng(seed)
    data = samples(80, seed=seed, normal_force=rng.normal(0.1, 0.015, 80))
    f_n, f_t = (f + 3e-3 * rng.standard_normal(80) for f in (data.normal_force, data.tangential_force))
    data = replace(data, normal_force=f_n, tangential_force=f_t, friction_coefficient=f_t / f_n)
    model = estimators.fit(data, method="bayes", likelihood="errors_in_variables", accuracy=0.02)
    times = [float(model.diagnostics[f"autocorrelation_time_{name}"]) for name in ("sigma", "force_noise")]
    sigma = model.draws[:, 3]
    assert sigma.std() > 0.3 * sigma.mean()
    assert model.diagnostics["move"] == "independence"
    assert max(times) < 5.0


def test_blocks_of_samples_and_other_walkers_do_not_show() -> None:
    part = rows(2 * kernels.BLOCK + 77)
    natural = np.tile([0.02, 4.0], (7, 1))
    beta = BETA[0] * (1.0 + 0.01 * np.random.default_rng(0).standard_normal((7, 3)))
    whole = student_t.StudentT().log_likelihood(beta, natural, part)
    cuts = [slice(0, 5), slice(5, kernels.BLOCK + 3), slice(kernels.BLOCK + 3, None)]
    pieces = [Rows(*(np.ascontiguousarray(column[cut]) for column in part)) for cut in cuts]
    parts = [student_t.StudentT().log_likelihood(beta, natural, piece) for piece in pieces]
    np.testing.assert_allclose(np.sum(parts, axis=0), whole, rtol=1e-12)
    np.testing.assert_allclose(student_t.StudentT().log_likelihood(beta[3:4], natural[3:4], part), whole[3:4])


def test_elementary_functions_are_right_to_a_part_in_a_trillion() -> None:
    rng = np.random.default_rng(0)
    x = np.concatenate([10.0 ** rng.uniform(-300, 300, 2000), 1.0 + 10.0 ** rng.uniform(-16, 0, 2000), [1.0, 2.0]])
    np.testing.assert_allclose([kernels.log(value) for value in x], np.log(x), rtol=1e-12, atol=1e-12)
    m = rng.uniform(1.0, 2.0, 2000)
    np.testing.assert_allclose([kernels.log_mantissa(value) for value in m], np.log(m), rtol=0.0, atol=1e-12)
    y = np.concatenate([-rng.uniform(0.0, 700.0, 2000), [0.0, kernels.LEAST]])
    np.testing.assert_allclose([kernels.exp(value) for value in y], np.exp(y), rtol=1e-12)


def test_a_sample_that_no_component_explains_still_has_a_density() -> None:
    """Far out on both sides of where exponentials underflow: the logarithm of a sum, not the sum."""
    part = Rows(np.zeros(3), np.ones(3), np.array([-1e3, 0.4, 1e6]), np.ones(3), np.ones(3))
    found = outlier.Outlier().log_likelihood(np.array([[0.4, 0.0, 0.0]]), np.array([[0.02, 0.1, 0.2, -0.1]]), part)
    residual = part.friction - 0.4
    near = np.log(0.9 / 0.02) - 0.5 * (residual / 0.02) ** 2
    far = np.log(0.1 / 0.2) - 0.5 * ((residual + 0.1) / 0.2) ** 2
    np.testing.assert_allclose(found, np.logaddexp(near, far).sum(), rtol=1e-12)


def test_outside_the_support_there_is_no_density(samples: Make) -> None:
    terms = outlier.Outlier()
    log = terms.log_prior(np.array([[0.0, -0.1, 1.8, -0.1], [0.0, 0.8, 1.8, -0.1], [0.0, 0.4, 1.8, -0.1]]))
    np.testing.assert_array_equal(np.isfinite(log), [False, False, True])
    with pytest.raises(estimators.InvalidSamples, match='which "bayes, outlier" needs'):
        estimators.Moments.from_samples(samples(50)).fit("bayes", likelihood="outlier")


def test_refinement_finds_centre_and_spread_of_a_skewed_density() -> None:
    def log_density(x: np.ndarray) -> np.ndarray:
        return np.asarray((0.5 * x - np.exp(x))[:, 0])  # log of a gamma variable of shape 1/2

    mode, root, even = refine(log_density, np.array([np.log(0.5)]), np.array([[1.4]]), np.random.default_rng(0))
    law = stats.loggamma(0.5)
    assert 0.6 < even <= 1.0
    assert abs(mode[0] - law.mean()) < 0.5 * law.std()
    np.testing.assert_allclose(np.abs(root[0, 0]), law.std(), rtol=0.35)
