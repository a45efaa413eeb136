"""One element's step: its parts by hand, as plain Python."""

import math
from inspect import unwrap

import numpy as np
import pytest

from slipcore.defaults import FilterOptions
from slipcore.detection.filter.element import (
    Increment,
    Measurements,
    PlaceEstimate,
    correct,
    expected,
    find_transitions,
    mix,
)
from slipcore.detection.filter.pose import AnchorMotion
from slipcore.detection.filter.tuning import Tuning, settings_of

TUNING = Tuning(*settings_of(FilterOptions()))._replace(onset_length=1e-4, end_length=2e-4, pressing_rate=5.0)


def transitions(moved: float, readiness: float, restick: bool = False) -> tuple[float, float]:
    """Probabilities that an element begins to slip, and that one sticks again, after so much motion, m, in 0.1 s."""
    motion = AnchorMotion(np.array([0.6 * moved]), np.array([-0.8 * moved]), np.zeros(1))
    seen = Measurements(*np.zeros((8, 1)))._replace(readiness=np.array([readiness]))
    unwrap(find_transitions)(motion, seen, Increment(0.1, 1e-12, restick, held=False), TUNING)
    return float(seen.readiness[0]), float(seen.end[0])


def test_states_change_by_the_way_and_not_by_time() -> None:
    """A way of its own length leaves 1/e; twice as ready, as much in half of it."""
    assert transitions(0.0, 1.0) == (0.0, 0.0)
    onset, end = transitions(1e-4, 1.0)
    assert (1.0 - onset, 1.0 - end) == (pytest.approx(math.exp(-1.0)), pytest.approx(math.exp(-0.5)))
    assert transitions(5e-5, 2.0)[0] == pytest.approx(onset)
    assert transitions(1e-4, 0.0)[0] == 0.0


def test_a_load_that_grows_makes_elements_stick_within_time() -> None:
    onset, end = transitions(2e-4, 1.0, restick=True)
    assert 1.0 - onset == pytest.approx(math.exp(-2.0))
    assert 1.0 - end == pytest.approx(math.exp(-1.0 - 0.5))


@pytest.mark.parametrize(
    ("p", "onset", "end", "probable"), [(0.5, 0.2, 0.4, 0.4), (0.0, 0.0, 0.7, 0.01), (1.0, 0.3, 0.0, 0.99)]
)
def test_slip_is_expected_where_it_goes_on_or_begins_and_is_never_sure(
    p: float, onset: float, end: float, probable: float
) -> None:
    assert unwrap(expected)(p, onset, end, 0.01) == pytest.approx(probable)


def test_two_estimates_are_mixed_by_their_moments() -> None:
    """Of 3/4 and 1/4: the variance of a coordinate grows by that between both, in the mean of x and y."""
    one, other = PlaceEstimate(1.0, 2.0, 0.1), PlaceEstimate(5.0, -2.0, 0.5)
    mixed = unwrap(mix)(one, other, 0.75, 0.01, 0.02)
    assert (mixed.x, mixed.y) == (2.0, 1.0)
    between = 0.75 * 0.25 * 16.0
    assert mixed.variance == pytest.approx(0.75 * 0.1 + 0.25 * 0.5 + between + 0.03)


@pytest.mark.parametrize(
    ("trust", "spread", "x", "y", "variance"), [(1.0, 0.0, 1.75, 5.0, 0.75), (0.0, 0.1, 1.0, 2.0, 3.0 + 0.1 * 17.0)]
)
def test_a_prediction_is_corrected_by_its_share_of_the_variance(
    trust: float, spread: float, x: float, y: float, variance: float
) -> None:
    """Variances of 3 and 1: three quarters of the way, and a quarter of the variance is left; or it is only wider."""
    found = unwrap(correct)(PlaceEstimate(1.0, 2.0, 3.0), 2.0, 6.0, 1.0, trust, spread)
    np.testing.assert_allclose(found, (x, y, variance))
