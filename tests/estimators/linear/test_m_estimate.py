"""Losses of M-estimates in closed form, and what a start and a scale do with outliers."""

import numpy as np
import pytest
from scipy import integrate, stats

from estimators.defaults import ROBUST
from estimators.linear.m_estimate import (
    LOSSES,
    Loss,
    Plane,
    _concentrate,
    _least_scale,
    _least_squares,
    high_breakdown,
    normal_square,
    rescaled,
)


def test_weights_at_the_tuning_constants() -> None:
    huber, tukey = LOSSES["huber"].weight, LOSSES["tukey"].weight
    at = np.array([0.0, -1.345, 2.69, -5.38])
    np.testing.assert_allclose(huber(at), [1.0, 1.0, 0.5, 0.25], rtol=1e-12)
    np.testing.assert_allclose(tukey(4.685 * np.array([0.0, 0.5, -0.5, 1.0, 7.0])), [1.0, 0.5625, 0.5625, 0.0, 0.0])


@pytest.mark.parametrize("name", LOSSES)
def test_the_slope_is_the_derivative_of_what_weights_make_of_a_residual(name: str) -> None:
    loss, step = LOSSES[name], 1e-6
    u = np.array([-6.0, -3.0, -1.0, 0.0, 0.5, 2.0, 4.0, 9.0])
    psi = [(u + side) * loss.weight(u + side) for side in (-step, step)]
    np.testing.assert_allclose(loss.slope(u), (psi[1] - psi[0]) / (2.0 * step), rtol=0, atol=1e-6)


@pytest.mark.parametrize("name", LOSSES)
def test_each_loss_is_as_efficient_as_it_says_at_normal_errors(name: str) -> None:
    """95 % of least squares: (E ψ')² over E ψ²."""
    loss = LOSSES[name]

    def mean(of: object) -> float:
        return float(integrate.quad(lambda u: of(u) * stats.norm.pdf(u), -10.0, 10.0, limit=400)[0])  # type: ignore[operator]

    efficiency = mean(loss.slope) ** 2 / mean(lambda u: (u * loss.weight(np.asarray(u))) ** 2)
    assert efficiency == pytest.approx(0.95, abs=1e-3)


def test_the_mean_square_under_equal_weights_is_that_of_the_normal() -> None:
    assert normal_square(Loss(np.ones_like, np.zeros_like)) == pytest.approx(1.0, rel=1e-9)
    inside = Loss(lambda u: (np.abs(u) < 1.0).astype(float), np.zeros_like)
    truncated = 1.0 - 2.0 * stats.norm.pdf(1.0) / (2.0 * stats.norm.cdf(1.0) - 1.0)
    assert normal_square(inside) == pytest.approx(truncated, rel=5e-3)  # of 4001 nodes


def test_a_scale_below_the_last_digits_is_rounding() -> None:
    assert _least_scale(np.array([0.0, 2.0, -4.0, 6.0])) == pytest.approx(4.0 * ROBUST.least_scale)
    assert _least_scale(np.zeros(5)) == np.finfo(float).tiny


def test_least_squares_by_a_triangle_are_those_of_the_normal_equations() -> None:
    rng = np.random.default_rng(0)
    design, response = rng.standard_normal((30, 3)), rng.standard_normal(30)
    expected = np.linalg.solve(design.T @ design, design.T @ response)
    np.testing.assert_allclose(_least_squares(design, response), expected, rtol=1e-10)


def contaminated(share: float, count: int = 400) -> tuple[np.ndarray, np.ndarray]:
    """A line with normal errors of 0.1, and a share of samples that lie 5 above it."""
    rng = np.random.default_rng(1)
    design = np.column_stack([np.ones(count), rng.uniform(-1.0, 1.0, count)])
    response = design @ [0.5, 2.0] + 0.1 * rng.standard_normal(count)
    response[: int(share * count)] += 5.0
    return design, response


@pytest.mark.parametrize("share", [0.0, 0.3, 0.45])
def test_a_start_lies_on_the_better_half_and_its_scale_is_freed_of_the_rest(share: float) -> None:
    design, response = contaminated(share)
    start = high_breakdown(design, response, np.random.default_rng(2))
    np.testing.assert_allclose(start.coefficients, [0.5, 2.0], rtol=0, atol=0.06)
    assert 0.1 * 0.85 < start.scale < 0.1 * 2.8
    found = rescaled(design, response, start)
    np.testing.assert_allclose(found.coefficients, [0.5, 2.0], rtol=0, atol=0.03)
    assert found.scale == pytest.approx(0.1, rel=0.15)


def test_a_scale_shrinks_to_a_quarter_of_the_start_and_no_further() -> None:
    design, response = contaminated(0.0)
    found = rescaled(design, response, Plane(np.array([0.5, 2.0]), 0.8))
    assert found.scale == pytest.approx(0.2, rel=1e-12)


def test_concentration_refits_the_half_that_lies_closest() -> None:
    """Seven samples of a mean, of which four are 1 and three far off: half is (7 + 1 + 1) // 2."""
    response = np.array([1.0, 1.0, 1.0, 1.0, 9.0, 10.0, 11.0])
    found = _concentrate(np.ones((7, 1)), response, np.array([3.0]))
    assert found.coefficients == pytest.approx([1.0])
    assert found.scale == 0.0
    other = _concentrate(np.ones((5, 1)), np.array([0.0, 1.0, 2.0, 50.0, 60.0]), np.array([1.0]))
    assert other.coefficients == pytest.approx([1.0])
    assert other.scale == pytest.approx(1.0 / stats.norm.ppf(0.75))
