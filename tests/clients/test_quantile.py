"""The hyperbola that bounds friction from below, by hand."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from stiction_client.errors import InvalidArgument
from stiction_client.quantile import FrictionQuantile, _factor, _joined
from tests.service.report.test_material import MODEL

CURVE = FrictionQuantile(0.9, -0.1, 0.3, 0.2, 0.1, low=1.0, high=3.0, below=0.4, above=0.2)
"""At 2 N its parts are 0.3 and 0.4."""


@pytest.mark.parametrize(
    ("force", "value", "slope"),
    [
        (2.0, 0.7 - 0.5, -0.1 - 0.1 * 0.4 / 0.5),
        (0.0, 0.9 - math.sqrt(0.29), -0.1 - (0.1 * 0.2 - 0.4 * 0.4) / math.sqrt(0.29)),
        (5.0, 0.4 - math.sqrt(0.74), -0.1 - (0.1 * 0.7 + 0.2 * 0.4) / math.sqrt(0.74)),
        (1.0, 0.8 - math.sqrt(0.18), -0.1 - 0.1 * 0.3 / math.sqrt(0.18)),
        (3.0, 0.6 - math.sqrt(0.34), -0.1 - 0.1 * 0.5 / math.sqrt(0.34)),
    ],
)
def test_outside_the_data_one_more_square_is_below_the_root(force: float, value: float, slope: float) -> None:
    assert CURVE(force) == (pytest.approx(value), pytest.approx(slope))
    many = CURVE(np.array([force, 2.0]))
    np.testing.assert_allclose(many[0], [value, 0.2])
    np.testing.assert_allclose(many[1], [slope, -0.18])


@pytest.mark.parametrize(
    ("force", "bend"),
    [(2.0, -0.0009 / 0.125), (0.0, -(0.0153 + 0.0144) / 0.29**1.5), (5.0, -(0.0045 + 0.01) / 0.74**1.5)],
)
def test_it_bends_downwards_as_its_slope_says(force: float, bend: float) -> None:
    assert CURVE.second_derivative(force) == pytest.approx(bend)
    step = 1e-5
    numeric = (CURVE(force + step)[1] - CURVE(force - step)[1]) / (2.0 * step)
    assert bend == pytest.approx(numeric, rel=1e-6)


def test_where_nothing_is_uncertain_it_is_a_straight_line() -> None:
    line = FrictionQuantile(0.5, 0.1, 0.0, 0.0, 0.0)
    assert line(2.0) == (pytest.approx(0.7), pytest.approx(0.1))
    assert line.second_derivative(2.0) == 0.0
    assert line.asymptote == (0.5, 0.1)


def test_the_mean_keeps_level_and_slope_alone() -> None:
    mean = CURVE.expected()
    for force in (0.0, 2.0, 5.0):
        assert mean(force) == (pytest.approx(0.9 - 0.1 * force), pytest.approx(-0.1))


def test_the_asymptote_is_met_from_below_where_the_force_is_great() -> None:
    height, slope = CURVE.asymptote
    growth = math.sqrt(0.05)
    assert (height, slope) == (pytest.approx(0.9 + 0.1 / growth), pytest.approx(-0.1 - growth))
    forces = np.geomspace(1e-3, 1e6, 60)
    gap = height + slope * forces - CURVE(forces)[0]
    assert (gap >= -1e-9).all()
    assert gap[-1] < 1e-5 < gap[0]


def test_a_spread_that_does_not_grow_lowers_the_asymptote_by_all_of_it() -> None:
    assert FrictionQuantile(0.9, -0.1, 0.3, 0.4, 0.0).asymptote == (pytest.approx(0.4), -0.1)


@pytest.mark.parametrize(
    "curve",
    [
        FrictionQuantile(0.3, 0.2, 0.9, -0.2, 0.3, low=1.0, high=2.0, below=0.1, above=0.5),
        FrictionQuantile(0.9, -0.1, 0.3, -0.4, 0.2, low=3.0, high=5.0, below=0.4, above=0.2),
        FrictionQuantile(0.3, 0.2, 0.1, 0.0, 0.1, low=1.0, high=2.0, above=0.5),
    ],
    ids=["above the data", "below the data", "which without their end has no peak"],
)
def test_most_friction_is_where_the_slope_is_0_outside_the_data_too(curve: FrictionQuantile) -> None:
    peak = curve.peak()
    assert not curve.low <= peak <= curve.high
    assert curve(peak)[1] == pytest.approx(0.0, abs=1e-12)
    assert curve(peak)[0] > max(curve(0.9 * peak)[0], curve(1.1 * peak)[0])


@pytest.mark.parametrize(("slope", "peak"), [(0.2, math.inf), (0.1, math.inf), (0.0, 0.0), (-0.2, 0.0)])
def test_a_sure_law_has_its_most_friction_at_an_end(slope: float, peak: float) -> None:
    assert FrictionQuantile(0.5, slope, 0.1, 0.0, min(0.1, abs(slope))).peak() == peak


@pytest.mark.parametrize(
    ("s", "k", "g", "constant", "slope"),
    [(0.3, 0.2, 0.1, -0.6, 0.2), (0.3, -0.2, 0.1, 0.6, 0.0), (0.0, 0.5, 0.0, 1.2, 0.0), (0.1, 0.5, 0.0, 0.2, -0.3)],
)
def test_two_squares_that_are_linear_in_the_force_are_one_and_a_rest(
    s: float, k: float, g: float, constant: float, slope: float
) -> None:
    rest, at_0, growth = _joined(s, k, g, constant, slope)
    for force in (0.0, 0.7, 40.0):
        both = s**2 + (k + g * force) ** 2 + (constant + slope * force) ** 2
        assert rest**2 + (at_0 + growth * force) ** 2 == pytest.approx(both)
    for each, alone in zip(_joined(np.full(2, s), k, g, constant, slope), (rest, at_0, growth), strict=True):
        np.testing.assert_allclose(each, alone)


def test_a_covariance_is_taken_apart_by_its_last_coefficient_first() -> None:
    root = np.array([[0.3, 0.4, 0.0], [-0.2, 0.1, 0.5], [0.7, 0.0, 0.0]])
    growth, along, apart = _factor((root @ root.T).tolist())
    assert growth == pytest.approx(0.7)
    assert along == (pytest.approx(0.3), pytest.approx(-0.2))
    assert apart == (pytest.approx(0.4), pytest.approx(0.1), pytest.approx(0.5))


def test_coefficients_that_are_functions_of_one_have_no_part_of_their_own() -> None:
    assert _factor(np.outer([1.0, 2.0, 3.0], [1.0, 2.0, 3.0]).tolist()) == (3.0, (1.0, 2.0), (0.0, 0.0, 0.0))
    assert _factor(np.zeros((3, 3)).tolist()) == (0.0, (0.0, 0.0), (0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    "changes", [{"coefficients": np.array([0.4, np.inf, 0.0])}, {"covariance": np.full((3, 3), np.nan)}]
)
def test_a_model_that_is_not_finite_has_no_quantile(changes: dict[str, Any]) -> None:
    with pytest.raises(InvalidArgument, match="model is not finite at this slip probability; allowed: finite coef"):
        FrictionQuantile.of(replace(MODEL, **changes), 0.0, 0.05)


@pytest.mark.parametrize("probability", [0.01, 0.3])
@pytest.mark.parametrize("force", [0.005, 0.02, 0.07, 0.12, 0.4])
@pytest.mark.parametrize("velocity", [0.0, 5e-4, 3e-3])
def test_it_is_the_quantile_that_the_model_tells(velocity: float, force: float, probability: float) -> None:
    curve = FrictionQuantile.of(MODEL, velocity, probability)
    told = float(MODEL.predict(velocity, force, quantile=probability))
    assert max(float(curve(force)[0]), 0.0) == pytest.approx(told, rel=1e-9)
    assert (curve.low, curve.high) == (0.02, 0.12)
