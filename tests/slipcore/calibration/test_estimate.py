"""Values of several presses, joined."""

import math

import numpy as np
import pytest

from slipcore.calibration.estimate import Estimate, PressEstimate, error_of_mean, joined, unknown

NORMAL = 1.959964


def test_one_press_is_taken_as_it_is() -> None:
    found = joined("gain", "-", ["no force", PressEstimate(1.5, 0.2)])
    assert (found.value, found.low, found.high) == pytest.approx((1.5, 1.5 - NORMAL * 0.2, 1.5 + NORMAL * 0.2))
    assert (found.name, found.unit, found.not_identified) == ("gain", "-", None)


def test_presses_that_agree_count_by_the_square_of_their_errors() -> None:
    """Weights 1/0.1² and 1/0.2²; what lies between them is less than their errors."""
    found = joined("x", "m", [PressEstimate(1.0, 0.1), PressEstimate(1.1, 0.2)])
    assert found.value == pytest.approx((100.0 + 25.0 * 1.1) / 125.0)
    assert found.high - found.value == pytest.approx(NORMAL / math.sqrt(125.0), rel=1e-6)


def test_presses_that_disagree_have_an_effect_of_their_own() -> None:
    """DerSimonian and Laird: Q = 112.5 of 100, 25 and 25; τ² = (Q − 2)/(150 − 11250/150)."""
    values = [(0.0, 0.1), (1.0, 0.2), (2.0, 0.2)]
    weights = [100.0, 25.0, 25.0]
    mean = sum(w * v for w, (v, _) in zip(weights, values, strict=True)) / 150.0
    excess = sum(w * (v - mean) ** 2 for w, (v, _) in zip(weights, values, strict=True)) - 2.0
    between = excess / (150.0 - 11250.0 / 150.0)
    weights = [1.0 / (e**2 + between) for _, e in values]
    found = joined("x", "m", [PressEstimate(*each) for each in values])
    assert found.value == pytest.approx(sum(w * v for w, (v, _) in zip(weights, values, strict=True)) / sum(weights))
    assert found.high - found.value == pytest.approx(4.302653 / math.sqrt(sum(weights)), rel=1e-6)  # t of two
    assert found.value - found.low == pytest.approx(found.high - found.value)


def test_where_no_press_tells_the_first_says_why() -> None:
    found = joined("x", "m", ["first", "second"])
    assert found.not_identified == "first"
    assert not found.is_identified
    assert not unknown("x", "m", "first").is_significant


@pytest.mark.parametrize(
    ("low", "high", "is_significant"), [(0.1, 0.3, True), (-0.3, -0.1, True), (0.0, 0.2, False), (-0.2, 0.0, False)]
)
def test_zero_within_the_interval_is_no_difference(low: float, high: float, is_significant: bool) -> None:
    assert Estimate("x", "m", 0.5 * (low + high), low, high).is_significant is is_significant


@pytest.mark.parametrize(
    ("residual", "error"),
    [
        ([0.0, 0.0, 0.0], 0.0),
        ([1.0, -1.0, 1.0, -1.0], math.sqrt(4.0 / 3.0 / 4.0)),  # what alternates lasts no longer
        ([0.5], 0.5 * math.sqrt(0.5)),
        ([2.0, 2.0, -2.0, -2.0], math.sqrt(16.0 / 3.0 * (1.0 + 3.0 / 16.0) / (1.0 - 3.0 / 16.0) / 4.0)),
    ],
)
def test_the_error_of_a_mean_is_that_of_a_series_with_memory(residual: list[float], error: float) -> None:
    assert error_of_mean(np.array(residual)) == pytest.approx(error, rel=1e-12)


def test_presses_without_noise_are_joined_as_those_with_next_to_none() -> None:
    """The square of an error of 0, as a weight, overflowed."""
    results = [PressEstimate(1.0, 0.0), PressEstimate(1.1, 0.0)]
    exact = joined("gain", "-", results)
    nearly = joined("gain", "-", [PressEstimate(each.value, 1e-9) for each in results])
    assert exact.value == pytest.approx(1.05, rel=1e-12, abs=0.0)
    np.testing.assert_allclose([exact.low, exact.high], [nearly.low, nearly.high], rtol=1e-9, atol=0)


def test_what_is_the_sensors_does_not_average_out_over_presses() -> None:
    one, many = (joined("gain", "-", [PressEstimate(1.0, 0.1, 0.3)] * count) for count in (1, 100))
    assert one.high - 1.0 == pytest.approx(NORMAL * np.hypot(0.1, 0.3), rel=1e-6)
    assert many.high - 1.0 == pytest.approx(NORMAL * np.hypot(0.01, 0.3), rel=1e-6)
