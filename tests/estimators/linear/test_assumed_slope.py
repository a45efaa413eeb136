"""What is assumed of the slope with velocity where samples do not show it."""

from dataclasses import replace

import numpy as np
import pytest

from estimators.defaults import PRIOR, REFERENCE
from estimators.linear.assumed_slope import assumed_slope, change_from_rest
from estimators.linear.fit_data import FitData, gather
from slipcore.samples import FrictionSamples

OF_SLOPE = np.diag([0.0, 1.0, 0.0])
"""A covariance of β₁ alone."""


def data(speed: float) -> FitData:
    """Of friction 0.5."""
    one = np.ones(50)
    mu = 0.5 + 0.01 * np.linspace(-1.0, 1.0, 50)
    return gather(FrictionSamples(mu, speed * one, 0.1 * one, 0.1 * mu, np.arange(50.0), np.arange(50), one, 1e-6))


def test_friction_changes_from_rest_by_a_tenth_at_the_reference_speed_and_above_it_by_its_logarithm() -> None:
    fast = REFERENCE.tangential_velocity
    assert change_from_rest(fast) == pytest.approx(0.1)
    assert change_from_rest(0.8 * fast) == pytest.approx(0.08)
    assert change_from_rest(1e-9) == change_from_rest(0.0) == PRIOR.least_velocity_effect
    assert change_from_rest(np.e**2 * fast) == pytest.approx(0.3)
    steps = [(change_from_rest((1.0 + h) * fast) - change_from_rest(fast)) / h for h in (-1e-6, 1e-6)]
    assert steps == pytest.approx([0.1, 0.1], rel=1e-5)  # one slope on either side


def test_what_is_assumed_of_a_slope_gives_way_to_what_data_say_of_it() -> None:
    """All of the prior beside data that know little, none where they know enough, and never more than that together:
    friction at rest to within a tenth (95 %), or half of the prior's variance where that is less.
    """
    for speed, change, enough in (
        (5e-3, 0.1, 0.1 / 1.96),
        (2e-2, 0.1 + 0.1 * np.log(4.0), 0.1 / 1.96),
        (1e-3, 0.05, 0.05 / 2**0.5),
    ):
        told, unit = data(speed), (0.5 / speed) ** 2
        rest = np.outer([-speed, 1.0, 0.0], [-speed, 1.0, 0.0])  # of β, by which friction at this speed stays
        for known in (1e3, 3.0 * change, 1.1 * change, 1.01 * enough):
            slope = assumed_slope(told, 0.0, known**2 * unit * rest)
            assert slope is not None
            both = 1.0 / np.sqrt(slope.precision * unit + known**-2)
            assert both == pytest.approx(max(enough, 1.0 / np.hypot(1.0 / known, 1.0 / change)), rel=1e-4)
            assert (slope.speed, slope.slowest, slope.change) == (speed, speed, pytest.approx(change))
        for known in (0.99 * enough, 1e-6 * enough, 0.0):
            assert assumed_slope(told, 0.0, known**2 * unit * rest) is None


def test_nothing_is_assumed_of_slip_at_rest_nor_without_friction() -> None:
    assert assumed_slope(data(0.0), 0.0, 1e9 * OF_SLOPE) is None
    smooth = replace(data(5e-3), factor=replace(data(5e-3).factor, mean=np.array([5e-3, 0.1, 0.0])))
    assert assumed_slope(smooth, 0.0, 0.0 * OF_SLOPE) is None


def test_a_slope_that_the_samples_show_is_not_pulled_to_nothing() -> None:
    """Beyond three deviations of both they contradict what would be assumed; of 0.5 by a tenth and by as much."""
    told, speed, deviation = data(5e-3), 5e-3, 0.05 / 5e-3
    rest = deviation**2 * np.outer([-speed, 1.0, 0.0], [-speed, 1.0, 0.0])
    for many, assumed in ((2.9, True), (-2.9, True), (3.1, False), (-3.1, False)):
        slope = many * np.hypot(deviation, deviation)
        found = assumed_slope(told, slope, rest)
        assert (found is not None) is assumed


def test_what_scales_the_whole_law_is_no_doubt_of_how_it_changes() -> None:
    """Of one grasp, whose factor nobody knows, friction at rest is known as a part of that where it slid."""
    law, told = np.array([0.2, 60.0, 0.0]), data(5e-3)
    scaled = 0.2**2 * np.outer(law, law)
    assert assumed_slope(told, 60.0, scaled) is None
    assert assumed_slope(told, 60.0, scaled + 20.0**2 * np.outer([-5e-3, 1.0, 0.0], [-5e-3, 1.0, 0.0])) is not None
