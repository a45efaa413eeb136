"""Sums over samples as plain Python, against numpy's and scipy's own functions."""

import math

import numpy as np
import pytest
from scipy import stats

from estimators.likelihoods import kernels
from tests.slipcore.plain_kernels import as_plain_python

BETA = np.array([[0.4, 10.0, -1.0], [0.5, 0.0, 0.5]])
rng = np.random.default_rng(0)
V, F_N, MU, WEIGHT = (rng.uniform(*ends, 5) for ends in ((0.0, 5e-3), (0.05, 0.2), (0.2, 0.6), (0.5, 1.5)))
RESIDUAL = MU - BETA[:, :1] - BETA[:, 1:2] * V - BETA[:, 2:] * F_N


@pytest.fixture(autouse=True)
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    """In blocks of two samples, so that five are three blocks."""
    as_plain_python(monkeypatch, kernels)
    monkeypatch.setattr(kernels, "BLOCK", 2)


@pytest.mark.parametrize("x", [1.0, 1.4, 2.0, 1e-300, 3e-5, 0.7, 12345.678, 1e300])
def test_a_logarithm(x: float) -> None:
    assert kernels.log(x) == pytest.approx(math.log(x), rel=1e-12, abs=1e-12)
    if 1.0 <= x <= 2.0:
        assert kernels.log_mantissa(x) == pytest.approx(math.log(x), abs=1e-13)


@pytest.mark.parametrize("x", [0.0, -1e-9, -0.2, -0.6, -1.0, -33.3, -699.0, -700.0])
def test_an_exponential(x: float) -> None:
    assert kernels.exp(x) == pytest.approx(math.exp(x), rel=1e-12)


def test_student_t_sums() -> None:
    factor = np.array([3.0, 40.0])
    expected = np.log1p(factor[:, None] * RESIDUAL**2) @ WEIGHT
    np.testing.assert_allclose(kernels.sum_log1p_square(BETA, factor, V, F_N, MU, WEIGHT), expected, rtol=1e-12)


def test_sums_of_two_components_of_which_either_may_be_the_larger() -> None:
    near, far = np.array([[1.0, 200.0], [0.5, 3000.0]]), np.array([[-1.0, 8.0, 0.1], [0.2, 2.0, -0.05]])
    a = near[:, :1] - near[:, 1:] * RESIDUAL**2
    b = far[:, :1] - far[:, 1:2] * (RESIDUAL - far[:, 2:]) ** 2
    assert (a > b).any()
    assert (a < b).any()
    found = kernels.sum_log_mixture(BETA, near, far, V, F_N, MU, WEIGHT)
    np.testing.assert_allclose(found, np.logaddexp(a, b) @ WEIGHT, rtol=1e-12)
    apart = kernels.sum_log_mixture(BETA, np.add(near, [2e3, 0.0]), far, V, F_N, MU, WEIGHT)  # by more than e⁻⁷⁰⁰
    np.testing.assert_allclose(apart, (a + 2e3) @ WEIGHT, rtol=1e-12)


def test_sums_of_errors_in_forces_have_the_moments_of_the_true_force() -> None:
    """Given the measured one it is normal; those of (β₀ + β₁ v + β₂ f) f + ε f by quadrature over it."""
    variance, moments = np.array([[0.003, 1e-4], [0.01, 4e-4]]), np.array([0.12, 2e-3])
    f_t = MU * F_N
    node, share = np.polynomial.hermite_e.hermegauss(20)
    expected = []
    for (b0, b1, b2), (scatter, noise) in zip(BETA, variance, strict=True):
        kept = 1.0 - noise / moments[1]
        force = (moments[0] + kept * (F_N - moments[0]))[:, None] + np.sqrt(kept * noise) * node
        given = (b0 + b1 * V[:, None] + b2 * force) * force
        mean = given @ share / share.sum()
        slope = b0 + b1 * V + 2.0 * b2 * (moments[0] + kept * (F_N - moments[0]))
        spread = slope**2 * kept * noise + scatter * (force**2 @ share) / share.sum() + noise
        expected.append(WEIGHT @ (stats.norm(mean, np.sqrt(spread)).logpdf(f_t) + 0.5 * np.log(2.0 * np.pi)))
    found = kernels.sum_log_normal(BETA, variance, moments, V, F_N, f_t, WEIGHT)
    np.testing.assert_allclose(found, expected, rtol=1e-9)
