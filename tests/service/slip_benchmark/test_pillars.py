"""Pillars against Coulomb friction under each of them."""

from dataclasses import replace

import numpy as np
import pytest

from service.slip_benchmark.pillars import (
    NORMAL_STIFFNESS,
    PITCH,
    TANGENTIAL_STIFFNESS,
    PillarGrasp,
)
from slipcore import GraspLog, GroundTruth

EVEN = PillarGrasp("even", 0.5, (0.0, 0.1, 0.3), (0.0, 1e-3, 1e-3), taller=0.0, uneven=0.0, scatter=0.0)


def simulated(grasp: PillarGrasp) -> tuple[GraspLog, GroundTruth, np.ndarray]:
    log = grasp.simulate()
    assert log.truth is not None
    assert log.force is not None
    return log, log.truth, log.force


def test_a_press_is_told_a_thousand_times_a_second_with_the_pillars_stiffness() -> None:
    log, truth, force = simulated(EVEN)
    assert (len(log), log.grid, log.element_area) == (301, (3, 3), PITCH**2)
    np.testing.assert_allclose(np.diff(log.time), 1e-3)
    np.testing.assert_allclose(log.displacement[-1, :, :, 2], -1e-3)
    np.testing.assert_allclose(force[-1, :, :, 2], -NORMAL_STIFFNESS * 1e-3)
    np.testing.assert_allclose(log.displacement[50, 1, 1, 2], -0.5e-3)
    assert not force[..., :2].any()
    assert not truth.contact[0].any()
    assert truth.contact[1:].all()
    assert not truth.slip_kinematic.any()
    np.testing.assert_array_equal(truth.stick_ratio, [np.nan, *[1.0] * 300])


def test_pillars_stand_at_their_pitch_and_the_middle_one_is_taller() -> None:
    log, _, _ = simulated(replace(EVEN, taller=2e-4))
    np.testing.assert_allclose(log.position[0, 0], [-PITCH, -PITCH, 0.0])
    np.testing.assert_allclose(log.position[2, 1], [PITCH, 0.0, 0.0])
    pressed = -log.displacement[-1, :, :, 2]
    assert pressed[1, 1] == pytest.approx(1e-3)
    assert np.delete(pressed.ravel(), 4) == pytest.approx([0.8e-3] * 8)


def test_a_tilt_presses_what_lies_on_its_side_the_more() -> None:
    pressed = -simulated(replace(EVEN, tilt=(0.02, -0.01)))[0].displacement[-1, :, :, 2]
    assert pressed[2, 1] - pressed[0, 1] == pytest.approx(2.0 * PITCH * 0.02)
    assert pressed[1, 2] - pressed[1, 0] == pytest.approx(-2.0 * PITCH * 0.01)


def test_a_pillar_bends_until_its_force_is_friction_and_then_slips() -> None:
    way = replace(EVEN, x=(0.0, 0.0, 3e-3))
    log, truth, force = simulated(way)
    most = 0.5 * NORMAL_STIFFNESS * 1e-3
    bend = most / TANGENTIAL_STIFFNESS
    moved = np.interp(log.time, way.time, way.x)
    np.testing.assert_allclose(log.displacement[..., 0], np.minimum(moved, bend)[:, None, None] + np.zeros((1, 3, 3)))
    np.testing.assert_allclose(force[-1, :, :, 0], most)
    np.testing.assert_array_equal(truth.slip_kinematic[:, 1, 1], moved > bend * (1.0 + 1e-9))
    np.testing.assert_array_equal(truth.slip_contact_factor[101:, 1, 1], moved[101:] >= 0.99 * bend)
    assert (truth.stick_ratio[-1], truth.stick_ratio[150]) == (0.0, 1.0)
    np.testing.assert_allclose(log.object_pose, np.stack([moved, 0.0 * moved, 0.0 * moved], axis=-1))


def test_what_turns_back_sticks_at_once() -> None:
    way = PillarGrasp(
        "back", 0.5, (0.0, 0.1, 0.2, 0.3), (0.0, 1e-3, 1e-3, 1e-3), x=(0.0, 0.0, 3e-3, 2.5e-3),
        taller=0.0, uneven=0.0, scatter=0.0,
    )  # fmt: skip
    _, truth, force = simulated(way)
    assert truth.slip_kinematic[200].all()
    assert not truth.slip_kinematic[201:].any()
    assert force[-1, 1, 1, 0] == pytest.approx(0.5 * NORMAL_STIFFNESS * 1e-3 - TANGENTIAL_STIFFNESS * 0.5e-3)


def test_a_turn_carries_each_pillar_about_the_middle() -> None:
    log, truth, _ = simulated(replace(EVEN, yaw=(0.0, 0.0, 0.02)))
    place = log.position[..., :2]
    turned = place @ np.array([[np.cos(0.02), np.sin(0.02)], [-np.sin(0.02), np.cos(0.02)]]) - place
    np.testing.assert_allclose(log.displacement[-1, :, :, :2], turned, atol=1e-15)
    assert not truth.slip_kinematic.any()


def test_pillars_differ_in_height_and_friction_by_the_seed() -> None:
    uneven = replace(EVEN, uneven=5e-5, scatter=0.1, x=(0.0, 0.0, 9e-3), seed=3)
    log, truth, force = simulated(uneven)
    pressed, friction = -log.displacement[-1, :, :, 2], force[-1, :, :, 0] / -force[-1, :, :, 2]
    rng = np.random.default_rng(3)
    np.testing.assert_allclose(pressed, 1e-3 + 5e-5 * rng.standard_normal((3, 3)))
    np.testing.assert_allclose(friction, 0.5 * (1.0 + 0.1 * rng.standard_normal((3, 3))))
    assert truth.friction.coefficients == (0.5, 0.0, 0.0)
    assert truth.friction.scale == pytest.approx(0.05)


def test_what_does_not_touch_bears_nothing_and_does_not_slip() -> None:
    log, truth, force = simulated(replace(EVEN, taller=2e-3, x=(0.0, 0.0, 9e-3)))
    edge = np.ones((3, 3), bool)
    edge[1, 1] = False
    for values in (truth.contact, truth.slip_kinematic, truth.slip_contact_factor, force, log.displacement):
        assert not values[:, edge].any()
    assert truth.stick_ratio[-1] == 0.0
