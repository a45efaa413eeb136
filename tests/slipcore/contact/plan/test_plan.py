"""Loads over time, by hand, and what a scene may be made of."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from slipcore.contact.plan.description import Finger, Press, SceneDescription
from slipcore.contact.plan.plan import Channel, History, Plan, ramp
from slipcore.errors import InvalidInput


def plan(*histories: History, duration: float = 2.0) -> Plan:
    unused = cast("Any", SimpleNamespace())
    return Plan(unused, duration, histories, unused, young_modulus=1e6, poisson_ratio=0.45, seed=0)


def test_a_history_is_linear_between_its_times_and_constant_outside() -> None:
    history = History("force_x", (1.0, 2.0, 4.0), (0.0, 3.0, -1.0))
    assert [history.at(time) for time in (0.0, 1.5, 2.0, 3.0, 9.0)] == [0.0, 1.5, 3.0, 1.0, -1.0]


def test_a_ramp_rises_from_its_start_within_its_duration() -> None:
    made = ramp("moment", 0.6, 1.0, 0.5)
    assert (made.time, made.value) == ((1.0, 1.5), (0.0, 0.6))
    with pytest.raises(InvalidInput, match=r"duration of moment is 0\.0; allowed: above 0 s"):
        ramp("moment", 0.6, 1.0, 0.0)


@pytest.mark.parametrize(
    ("channel", "time", "value", "message"),
    [
        ("force_z", (0.0,), (1.0,), "channel"),
        ("force_x", (), (), "0 times"),
        ("force_x", (0.0, 1.0), (1.0,), "2 times"),
        ("force_x", (0.0, np.inf), (1.0, 1.0), "not finite"),
        ("force_x", (0.0, 1.0), (np.nan, 1.0), "not finite"),
        ("force_x", (1.0, 1.0), (0.0, 1.0), "strictly increasing"),
    ],
)
def test_a_history_that_cannot_be_is_refused(channel: Channel, time: Any, value: Any, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        History(channel, time, value)


def test_histories_of_a_channel_add_up() -> None:
    made = plan(ramp("force_x", 1.0, 0.0, 1.0), ramp("force_x", -0.5, 1.0, 1.0), ramp("force_y", 7.0, 0.0, 1.0))
    assert made.value("force_x", 0.5) == 0.5
    assert made.value("force_x", 2.0) == 0.5
    assert made.value("yaw", 1.0) == 0.0
    assert made.drives("force_y")
    assert not made.drives("yaw")


def test_corners_are_where_loads_bend_before_the_end() -> None:
    made = plan(ramp("force_x", 1.0, 0.0, 1.0), ramp("force_y", 1.0, 0.5, 1.5), ramp("yaw", 1.0, 1.0, 2.0))
    np.testing.assert_array_equal(made.corners(), [0.5, 1.0])


def test_the_largest_normal_force_may_stand_within_or_at_the_end() -> None:
    peak = History("normal_force", (0.0, 1.0, 2.0), (0.0, 5.0, 3.0))
    assert plan(peak).largest_force() == 5.0
    assert plan(peak, duration=0.5).largest_force() == 2.5


def test_a_load_is_that_at_the_steps_end_and_a_motion_that_within_it() -> None:
    made = plan(
        ramp("normal_force", 4.0, 0.0, 1.0),
        ramp("force_y", 2.0, 0.0, 2.0),
        ramp("moment", 0.5, 0.0, 2.0),
        ramp("motion_x", 1e-3, 0.0, 2.0),
    )
    load = made.load(0.5, 1.5)
    assert (load.normal_force, load.duration) == (4.0, 1.0)
    np.testing.assert_allclose(load.tangential, [0.0, 1.5, 0.375])
    np.testing.assert_allclose(load.motion, [0.5e-3, 0.0, 0.0])
    assert load.given == (False, True, True)
    assert plan(ramp("normal_force", -4.0, 0.0, 1.0)).load(0.0, 1.0).normal_force == 0.0


@pytest.mark.parametrize(("load", "motion"), [("force_x", "motion_x"), ("force_y", "motion_y"), ("moment", "yaw")])
def test_a_direction_is_driven_by_a_load_or_a_motion(load: Channel, motion: Channel) -> None:
    driven = ramp(load, 1.0, 0.0, 1.0), ramp(motion, 1e-3, 0.0, 1.0)
    for history in driven:
        assert plan(history).check().histories == (history,)
    with pytest.raises(InvalidInput, match=f"{load} and {motion}"):
        plan(*driven).check()


def test_a_finger_is_a_paraboloid_of_its_radius() -> None:
    height = Finger(radius=0.02).height()
    assert height(np.array(3e-3), np.array(4e-3)) == pytest.approx(25e-6 / 0.04)
    assert Finger(radius=np.inf).height()(np.array(3e-3), np.array(4e-3)) == 0.0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Finger(radius=0.0), "radius of the finger is 0.0"),
        (lambda: Finger(thickness=np.nan), "thickness of the finger is nan"),
        (lambda: Press(force=-1e-9), "press.force"),
        (lambda: Press(force=np.inf), "press.force"),
        (lambda: SceneDescription("a", duration=0.0), "duration is 0.0"),
        (lambda: SceneDescription("a", duration=np.inf), "duration is inf"),
    ],
)
def test_a_scene_that_cannot_be_is_refused(make: Any, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        make()


def test_a_scene_presses_from_the_begin_within_the_duration_of_its_press() -> None:
    made = SceneDescription("a", press=Press(force=0.0)).plan()
    assert made.value("normal_force", made.duration) == 0.0
    made = SceneDescription("a", press=Press(3.0, 0.5), friction=0.7, duration=2.0).plan(seed=4)
    assert [made.value("normal_force", time) for time in (0.0, 0.25, 0.5, 2.0)] == [0.0, 1.5, 3.0, 3.0]
    assert made.law.coefficients == (0.7, 0.0, 0.0)
    assert made.seed == 4
