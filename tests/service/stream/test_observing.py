"""What a grip controller is told of a frame, of few elements by hand."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from service.stream.observing import LEAST_SPEED, WINDOW, Observer, SampledForces
from slipcore import Frame, SlipState

GRID = (1, 4)
PLACE = np.array([[[0.001 * k, 0.0, 0.0] for k in range(4)]])
FORCE = np.array([[[0.3, 0.0, -1.0], [0.0, 0.4, -2.0], [0.0, 0.0, 0.0], [5.0, 5.0, -9.0]]])
"""Of which the third, beside the contact, bears nothing, and the fourth does not touch."""
TOUCH = np.array([[True, True, False, False]])
NO = np.zeros(GRID, bool)


def state(slip: Any = NO, speed: Any = 0.0, ratio: float = 1.0) -> SlipState:
    velocity = np.zeros((*GRID, 2))
    velocity[..., 1] = speed
    return SlipState(0.0, TOUCH, np.asarray(slip), np.zeros(GRID), ratio, velocity, False)


def frame(force: Any = FORCE, normal: Any = None, time: float = 0.5) -> Frame:
    return Frame(time, np.zeros((*GRID, 3)), np.array(force), None, normal)


def test_resultants_are_those_of_what_touches() -> None:
    _, seen = Observer(PLACE).step(frame(), state(ratio=0.25))
    assert (seen.time, seen.normal, seen.stick_ratio) == (0.5, 3.0, 0.25)
    assert seen.tangential == pytest.approx(0.5)
    assert seen.slip_samples is None


def test_torque_is_about_the_centre_of_what_presses() -> None:
    """That is two thirds of the way to the second element, which alone is pulled across."""
    _, seen = Observer(PLACE).step(frame(), state())
    assert seen.torque == pytest.approx(0.4 * 0.001 / 3.0)
    _, other_way = Observer(PLACE).step(frame(FORCE * [1.0, -1.0, 1.0]), state())
    assert other_way.torque == pytest.approx(seen.torque)
    _, along_it = Observer(PLACE[..., [1, 0, 2]]).step(frame(FORCE[..., [1, 0, 2]]), state())
    assert along_it.torque == pytest.approx(seen.torque)


def test_what_pulls_presses_with_nothing_and_has_no_torque() -> None:
    _, seen = Observer(PLACE).step(frame(FORCE * [1.0, 1.0, -1.0]), state())
    assert (seen.normal, seen.torque) == (0.0, 0.0)
    assert seen.tangential == pytest.approx(0.5)


def test_forces_that_are_not_known_are_none() -> None:
    unknown = FORCE.copy()
    unknown[0, 0] = np.nan
    _, seen = Observer(PLACE).step(frame(unknown), state())
    assert (seen.normal, seen.tangential, seen.torque) == (2.0, 0.4, 0.0)


def sampled(slip: Any, speed: Any, force: Any = FORCE, frames: int = WINDOW, normal: Any = None) -> Any:
    observer = Observer(PLACE)
    for _ in range(frames):
        observer, seen = observer.step(frame(force, normal), state(slip, speed))
    return seen.slip_samples


def test_friction_is_sampled_where_elements_slip_for_as_many_frames_as_are_averaged() -> None:
    assert sampled(TOUCH, 1e-3, frames=WINDOW - 1) is None
    found = sampled(TOUCH, 1e-3)
    np.testing.assert_allclose(found.friction_coefficient, [0.3, 0.2])
    np.testing.assert_allclose(found.normal_force, [1.0, 2.0])
    assert found.moving == 1.0


def test_one_frame_without_slip_begins_the_count_anew() -> None:
    observer, told = Observer(PLACE), []
    for slip in [TOUCH] * (WINDOW - 1) + [NO] + [TOUCH] * WINDOW:
        observer, seen = observer.step(frame(), state(slip, 1e-3))
        told.append(seen.slip_samples is not None)
    assert told == [False] * (2 * WINDOW - 1) + [True]
    assert len(observer.last) == WINDOW


def test_what_is_slower_than_noise_is_not_sampled_and_tells_how_much_moves() -> None:
    found = sampled(TOUCH, [[LEAST_SPEED, 1.01 * LEAST_SPEED, 1.0, 1.0]])
    np.testing.assert_allclose(found.normal_force, [2.0])
    assert found.moving == 0.5
    none = sampled(TOUCH, LEAST_SPEED)
    assert (none.normal_force.size, none.moving) == (0, 0.0)
    assert sampled(NO, 1.0) is None


def test_the_speed_that_counts_is_the_mean_of_the_last_frames() -> None:
    observer = Observer(PLACE)
    for k in range(WINDOW + 1):
        observer, seen = observer.step(frame(), state(TOUCH, 7.0 * WINDOW * LEAST_SPEED if k == 0 else 0.0))
        assert (seen.slip_samples is not None and seen.slip_samples.moving > 0.0) == (k == WINDOW - 1)
    back_and_forth = Observer(PLACE)
    for k in range(WINDOW):
        back_and_forth, seen = back_and_forth.step(frame(), state(TOUCH, 1.0 if k % 2 else -1.0))
    assert seen.slip_samples is not None
    assert seen.slip_samples.moving == 0.0


def test_an_element_whose_velocity_is_unknown_is_not_sampled() -> None:
    np.testing.assert_allclose(sampled(TOUCH, [[np.nan, 1e-3, np.nan, np.nan]]).normal_force, [2.0])


@pytest.mark.parametrize(("pressing", "count"), [(0.2, 1), (0.2001, 2)])
def test_the_rim_presses_with_more_than_a_tenth_of_the_most(pressing: float, count: int) -> None:
    force = FORCE.copy()
    force[0, 0, 2] = -pressing
    assert len(sampled(TOUCH, 1e-3, force).normal_force) == count


def test_friction_is_of_forces_along_and_across_the_surface_s_own_normal() -> None:
    """Turned by an angle about y, a force along z alone is tangential by its sine."""
    angle = 0.3
    normal = np.broadcast_to([math.sin(angle), 0.0, math.cos(angle)], (*GRID, 3))
    down = np.broadcast_to([0.0, 0.0, -2.0], (*GRID, 3))
    found = sampled(TOUCH, 1e-3, down, normal=normal)
    np.testing.assert_allclose(found.friction_coefficient, math.tan(angle))
    np.testing.assert_allclose(found.normal_force, 2.0 * math.cos(angle))


def test_an_observer_stays_as_it_is() -> None:
    before = Observer(PLACE)
    after, _ = before.step(frame(), state())
    assert (before.last, len(after.last)) == ((), 1)


def test_what_the_rim_bears_beside_the_contact_counts_as_load_but_not_as_slip() -> None:
    """An element that the edge of the contact cuts is pressed too little to count as in contact (the third here)."""
    cut = FORCE.copy()
    cut[0, 2] = [0.1, 0.0, -0.5]
    _, seen = Observer(PLACE).step(frame(cut), state())
    assert seen.normal == pytest.approx(3.5)
    assert seen.tangential == pytest.approx(math.hypot(0.4, 0.4))
    np.testing.assert_allclose(sampled(TOUCH, 1e-3, cut).normal_force, [1.0, 2.0])
    upright = PLACE.reshape(4, 1, 3)
    turned = replace(state(), contact=TOUCH.reshape(4, 1), slip=NO.reshape(4, 1), velocity=np.zeros((4, 1, 2)))
    _, seen = Observer(upright).step(frame()._replace(force=cut.reshape(4, 1, 3)), turned)
    assert seen.normal == pytest.approx(3.5)


def test_the_rim_adds_its_mean_over_some_frames_so_that_its_noise_hardly_counts() -> None:
    observer, told = Observer(PLACE), []
    for k in range(20 * WINDOW):
        noisy = FORCE.copy()
        noisy[0, 2] = [0.0, 0.0, -0.5 + (0.1 if k % 2 else -0.1)]
        observer, seen = observer.step(frame(noisy), state())
        told.append(seen.normal)
    np.testing.assert_allclose(told[WINDOW:], 3.5, atol=0.1 / WINDOW)
    away = replace(state(), contact=NO)
    assert observer.step(frame(noisy), away)[1].normal == 0.0  # nothing touches, so that nothing is beside it


def test_friction_is_of_the_forces_that_are_to_be_sampled_and_resultants_of_the_frame_s() -> None:
    """Of the two that slip the first presses with no more than the least force for a sample, and the third, which does
    not touch, presses with most.
    """
    alike = FORCE * [1.0, 1.5, 1.0]
    alike[0, 2, 2] = -90.0
    observer = Observer(PLACE)
    for _ in range(WINDOW):
        observer, seen = observer.step(frame(), state(TOUCH, 1e-3), SampledForces(alike, 1.0))
    assert seen.slip_samples is not None
    np.testing.assert_allclose(seen.slip_samples.friction_coefficient, [0.3])
    np.testing.assert_allclose(seen.slip_samples.normal_force, [2.0])
    assert seen.tangential == pytest.approx(0.5)
