"""The second moment of a contact that grows, and what is left of it at no force."""

import math
from dataclasses import replace

import numpy as np
import pytest

from slipcore.calibration.estimate import PressEstimate
from slipcore.calibration.kernel import _Growth, _left_at_no_force, _line, _moments, kernel_width, squared_width
from slipcore.calibration.press import find_press
from slipcore.frames import GraspLog
from tests.slipcore.calibration.straight_press import LOAD, places, press, shares, straight

GRID = (20, 20)
RISING = np.r_[np.zeros(12), np.linspace(0.05, 1.0, 20), np.ones(4), np.zeros(12)]


def growing(width: float, growth: float = 1.5e-6) -> GraspLog:
    """A Gaussian of variance ``width``² + ``growth``·(force/largest)^⅔ on elements of 1 mm, as a sum over each."""
    log = straight(load=RISING, share=shares(2e-3, GRID))
    field = np.zeros((len(RISING), *GRID))
    for number, load in enumerate(RISING):
        field[number] = 2.0 * load * shares(math.sqrt(width**2 + growth * load ** (2.0 / 3.0)), GRID)
    assert log.force is not None
    return replace(log, force=np.stack([0.0 * field, 0.0 * field, -field], axis=-1))


def test_a_line_through_moments_is_met_exactly() -> None:
    force = np.array([0.5, 1.0, 2.0, 4.0])
    growth = _Growth(force, 3.0 + 5.0 * (force / 4.0) ** 0.6, np.ones(4))
    line = _line(growth, 0.6, np.array([1.0, 2.0, 1.0, 0.5]))
    assert (line.left, line.slope, line.misfit) == pytest.approx((3.0, 5.0, 0.0), abs=1e-12)
    np.testing.assert_allclose(line.at(force), growth.moment, rtol=1e-12, err_msg="rounding")


def test_the_variance_of_what_is_left_is_that_of_weighted_least_squares() -> None:
    force, weight = np.array([0.5, 1.0, 2.0, 4.0]), np.array([1.0, 2.0, 1.0, 0.5])
    terms = np.stack([np.ones(4), force / 4.0], axis=1)
    expected = np.linalg.inv(terms.T @ np.diag(weight) @ terms)[0, 0]
    line = _line(_Growth(force, np.array([1.0, 0.0, 2.0, 1.0]), np.ones(4)), 1.0, weight)
    assert line.variance == pytest.approx(expected, rel=1e-12)
    residual = np.array([1.0, 0.0, 2.0, 1.0]) - line.at(force)
    assert line.misfit == pytest.approx(weight @ residual**2, rel=1e-12)


def test_moments_are_half_the_squared_arms_with_the_error_of_noise() -> None:
    arm = np.array([[[-2.0, 0.0], [2.0, 0.0], [0.0, 4.0]]])
    growth = _moments(np.array([[1.0, 1.0, 2.0]]), arm, np.array([[True, True, False]]), 0.1)
    moment = (2.0 + 2.0 + 16.0) / 4.0
    assert (growth.force[0], growth.moment[0]) == pytest.approx((4.0, moment))
    noise = 0.1 * math.sqrt(2.0 * (2.0 - moment) ** 2) / 4.0  # of what lies inside
    assert growth.error[0] == pytest.approx(math.hypot(noise, 0.02 * moment))


def test_what_is_left_takes_half_of_an_element_off() -> None:
    """An element's force may be its sum, with area/12 in the moment, or its density; half of that is the error."""
    force = np.linspace(0.2, 1.0, 12)
    exact = _Growth(force, 4.0 + 2.0 * force ** (5.0 / 8.0), np.full(12, 1e-6))
    found = _left_at_no_force(exact, 2.4)
    assert found.value == pytest.approx(4.0 - 0.1, abs=1e-5)  # the exponent in the middle of those that are tried
    assert found.error == pytest.approx(0.1, rel=1e-3)


@pytest.mark.parametrize("width", [1e-3, 1.5e-3])
def test_a_kernel_is_found_under_a_growing_contact(width: float) -> None:
    found = squared_width(find_press(growing(width)))
    assert isinstance(found, PressEstimate)
    assert abs(found.value - width**2) < 2.0 * found.error
    assert found.value == pytest.approx(width**2, rel=0.15)  # of the exponents that are possible, no one is known


@pytest.mark.parametrize(
    ("square", "error", "width"),
    [(4e-6, 0.0, (2e-3, 2e-3, 2e-3)), (4e-6, 1e-6, (2e-3, math.sqrt(4e-6 - 1.959964e-6), math.sqrt(5.959964e-6)))],
)
def test_a_width_is_the_root_of_its_square(square: float, error: float, width: tuple[float, float, float]) -> None:
    found = kernel_width([PressEstimate(square, error)])
    assert (found.value, found.low, found.high) == pytest.approx(width, rel=1e-6)
    assert (found.name, found.unit) == ("kernel_width", "m")


def test_a_square_below_none_is_no_width() -> None:
    found = kernel_width([PressEstimate(-1e-6, 1e-6)])
    assert (found.value, found.low) == (0.0, 0.0)
    assert found.high == pytest.approx(math.sqrt(0.959964e-6), rel=1e-6)
    assert not found.is_significant
    assert kernel_width(["no forces"]).not_identified == "no forces"


REFUSED = {
    "the log has no forces": find_press(replace(growing(1e-3), force=None)),
    "reaches the lattice's edge": press(share=shares(5e-3)),
    "7 frames while the load changes; 8 are needed": press(load=np.r_[np.zeros(12), np.linspace(0.2, 1.0, 7)]),
    "the least force is 40% of the greatest": press(load=np.r_[np.zeros(12), np.linspace(0.4, 1.0, 12)]),
    "does not grow with the force": press(load=LOAD),
}


@pytest.mark.parametrize("reason", REFUSED)
def test_what_hides_a_kernel_is_said(reason: str) -> None:
    assert reason in str(squared_width(REFUSED[reason]))


def test_noise_far_out_does_not_widen_a_kernel() -> None:
    log = growing(1e-3)
    assert log.force is not None
    noise = 1e-4 * np.random.default_rng(3).standard_normal(log.force.shape)
    found = squared_width(find_press(replace(log, force=log.force + noise)))
    assert isinstance(found, PressEstimate)
    assert abs(found.value - 1e-6) < 3.0 * found.error
    assert found.error < 4e-7
    assert places(GRID).shape == (*GRID, 3)
