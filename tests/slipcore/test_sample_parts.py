"""What a friction sample is made of, by hand; see test_samples for whole logs."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from slipcore import GraspLog, SampleOptions
from slipcore.samples import (
    _central_velocity,
    _fast_enough,
    _ForceNoise,
    _interior,
    _of_neighbouring_frames,
    _one_frame_earlier,
    _pressed_enough,
    _ratio,
    _root_mean_square,
    _velocity_noise,
)

TIME = np.array([0.0, 1.0, 3.0, 4.0])


def test_a_field_one_frame_earlier_is_nothing_in_the_first() -> None:
    assert _one_frame_earlier(np.array([5.0, 6.0, 7.0])).tolist() == [0.0, 5.0, 6.0]
    assert _one_frame_earlier(np.array([True, False])).tolist() == [False, True]


def test_velocity_goes_from_the_frame_before_to_the_next() -> None:
    """A frame's is that since the one before: 4 over one second and 1 over two are 2 over three."""
    velocity = np.array([9.0, 4.0, 1.0, 7.0])[:, None, None, None]
    found = _central_velocity(TIME, velocity)[:, 0, 0, 0]
    assert np.isnan(found[[0, 3]]).all()
    np.testing.assert_allclose(found[1:3], [2.0, 3.0])


def test_between_the_neighbouring_frames_a_field_is_linear_in_time() -> None:
    found = _of_neighbouring_frames(TIME, np.array([3.0, 50.0, 9.0, 11.0])[:, None, None])[:, 0, 0]
    assert np.isnan(found[[0, 3]]).all()
    np.testing.assert_allclose(found[1:3], [5.0, 50.0 / 3.0 + 22.0 / 3.0])


def test_the_interior_has_its_four_neighbours_and_the_lattice_has_no_rim() -> None:
    region = np.ones((1, 4, 4), bool)
    region[0, 1, 2] = False
    outside = {(1, 2), (0, 2), (2, 2), (1, 1), (1, 3)}
    assert {tuple(each) for each in np.argwhere(~_interior(region)[0])} == outside


def test_noise_of_a_velocity_is_that_of_two_places_over_two_intervals() -> None:
    log = GraspLog(TIME, np.zeros((1, 1, 3)), np.zeros((4, 1, 1, 3)), 1e-6)
    history = SimpleNamespace(noise=3e-6, findings=())
    found = _velocity_noise(log, cast("Any", history))
    np.testing.assert_allclose(found, np.sqrt(2.0) * 3e-6 * np.array([0.0, 1.0 / 3.0, 1.0 / 3.0, 0.0]))
    history.noise = np.nan
    assert not _velocity_noise(log, cast("Any", history)).any()


def test_a_speed_is_fast_enough_above_the_least_and_above_noise() -> None:
    options = SampleOptions(least_velocity=1e-4, velocity_to_noise=5.0)
    speed = np.array([0.9e-4, 1.1e-4, 1.1e-4, 6e-4])[:, None, None]
    found = _fast_enough(speed, np.array([0.0, 0.0, 1e-4, 1e-4]), options)
    assert found.ravel().tolist() == [False, True, False, True]


def test_a_mean_square_counts_each_value_as_often_as_it_is_said() -> None:
    assert _root_mean_square([3.0, 1.0], [1.0, 3.0]) == pytest.approx(np.sqrt(3.0))
    assert _root_mean_square([3.0], [0.0]) == 0.0


def test_a_ratio_is_freed_of_what_noise_adds_to_magnitude_and_quotient() -> None:
    """5² − 3² is 4²; and one over 8 is too large by (2/8)²."""
    found = _ratio(np.array([5.0, 1.0]), np.array([8.0, 8.0]), _ForceNoise(2.0, 3.0))
    np.testing.assert_allclose(found, [4.0 / 8.0 * (1.0 - 1.0 / 16.0), 0.0])


@pytest.mark.parametrize(
    ("steady", "pressing", "enough"),
    [(1.1, 1.0, True), (0.9, 1.0, False), (1.1, 0.54, False), (1.1, 0.56, True), (-1.0, 1.0, False)],
)
def test_an_element_presses_enough_by_its_neighbouring_frames_and_not_far_less_itself(
    steady: float, pressing: float, enough: bool
) -> None:
    """A fifth of the largest, 5 N, or five times the noise of 0.1 N."""
    options = SampleOptions(force_to_noise=5.0, least_force_share=0.2)
    field = np.array([[[5.0, pressing]]])
    assert _pressed_enough(np.array([[[5.0, steady]]]), field, 0.1, options)[0, 0, 1] == enough
    assert not _pressed_enough(np.array([[[5.0, 1.4]]]), np.array([[[5.0, 1.4]]]), 0.3, options)[0, 0, 1]
