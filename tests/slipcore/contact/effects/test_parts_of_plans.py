"""What each effect adds to the plan of a scene, and what it leaves alone, without a simulation."""

import re
from collections.abc import Callable
from dataclasses import replace
from math import inf, nan
from typing import Any

import numpy as np
import pytest

from slipcore import FrictionLaw, GraspLog
from slipcore.contact.defaults import RAMP
from slipcore.contact.effects import (
    DroppedFrames,
    FrictionPatch,
    LoadPath,
    ObjectMotion,
    PressureFriction,
    RandomFriction,
    SensorSampling,
    TangentialLoad,
)
from slipcore.contact.effects.load_path import repeated
from slipcore.contact.plan.plan import Effect, History, Plan
from slipcore.contact.scene import Scene
from slipcore.errors import InvalidInput
from slipcore.frames import GroundTruth


@pytest.fixture(scope="module")
def plan() -> Plan:
    return Scene("plain", friction=0.5).plan(seed=3)


def test_a_patch_changes_friction_up_to_its_radius_and_not_beyond(plan: Plan) -> None:
    (field,) = FrictionPatch(-0.2, (1e-3, -2e-3), 5e-3).extend(plan).problem.friction_fields
    x, y = np.array([1e-3, 4e-3, 4.001e-3, 1e-3, -5e-3]), np.array([-2e-3, 2e-3, 2.001e-3, 3.001e-3, -2e-3])
    np.testing.assert_array_equal(field(x, y), [-0.2, -0.2, 0.0, 0.0, 0.0])


def test_friction_falls_with_the_force_on_an_element(plan: Plan) -> None:
    """0.1 N on an element of 2 mm² is a pressure of 50 kPa; at −0.8 1/N it takes 0.08 off."""
    first = PressureFriction(-0.8, 2e-6).extend(plan)
    (law,) = first.problem.pressure_laws
    np.testing.assert_allclose(law(np.array([0.0, 5e4, 1e5])), [0.0, -0.08, -0.16], rtol=1e-12)
    assert first.law.coefficients == (0.5, 0.0, -0.8)
    both = PressureFriction(0.3, 2e-6).extend(first)
    assert len(both.problem.pressure_laws) == 2
    assert both.law.coefficients == pytest.approx((0.5, 0.0, -0.5), rel=1e-12)


def test_scatters_of_friction_add_as_variances_do_and_differ_from_each_other(plan: Plan) -> None:
    first = RandomFriction(0.03, 1e-3).extend(plan)
    both = RandomFriction(0.04, 1e-3).extend(first)
    assert (plan.law.scale, first.law.scale) == (0.0, 0.03)
    assert both.law.scale == pytest.approx(0.05, rel=1e-12)
    x, y = np.array([0.0, 1e-3, 5e-3]), np.array([0.0, 2e-3, -1e-3])
    one, other = (field(x, y) for field in both.problem.friction_fields)
    assert not np.allclose(other / 0.04, one / 0.03, rtol=0.1)


def test_random_friction_scales_with_its_strength_and_repeats_by_its_seed() -> None:
    x, y = np.array([0.0, 1e-3]), np.array([2e-3, 0.0])

    def at(seed: int) -> np.ndarray:
        (field,) = RandomFriction(0.03, 1e-3).extend(Scene("plain").plan(seed=seed)).problem.friction_fields
        return field(x, y)

    np.testing.assert_array_equal(at(1), at(1))
    assert not np.array_equal(at(1), at(2))


@pytest.mark.parametrize(
    ("cycles", "times", "values"),
    [
        (1, (1.0, 1.5, 3.0), (0.0, 2.0, 1.0)),
        (2, (1.0, 1.5, 3.0, 3.5, 5.0), (0.0, 2.0, 1.0, 2.0, 1.0)),
        (3, (1.0, 1.5, 3.0, 3.5, 5.0, 5.5, 7.0), (0.0, 2.0, 1.0, 2.0, 1.0, 2.0, 1.0)),
    ],
)
def test_a_path_is_repeated_by_its_period(cycles: int, times: tuple[float, ...], values: tuple[float, ...]) -> None:
    assert repeated((1.0, 1.5, 3.0), (0.0, 2.0, 1.0), cycles) == (times, values)


def test_a_path_without_times_stays_so() -> None:
    assert repeated((), (), 3) == ((), ())


def test_a_path_drives_what_it_names_and_nothing_else(plan: Plan) -> None:
    path = LoadPath((0.0, 1.0), normal_force=(0.0, 3.0), moment=(0.0, 2e-3), force_y=(0.0, -1.0))
    added = path.extend(plan).histories[len(plan.histories) :]
    assert added == (
        History("normal_force", (0.0, 1.0), (0.0, 3.0)),
        History("force_y", (0.0, 1.0), (0.0, -1.0)),
        History("moment", (0.0, 1.0), (0.0, 2e-3)),
    )


@pytest.mark.parametrize("channel", ["normal_force", "force_x", "force_y", "moment"])
def test_a_path_with_any_load_is_not_absent(channel: str) -> None:
    assert LoadPath((0.0, 1.0), **{channel: (0.0, 0.0)}).absent
    assert not LoadPath((0.0, 1.0), **{channel: (0.0, 1e-9)}).absent


def test_a_tangential_load_starts_after_the_press_and_is_held(plan: Plan) -> None:
    extended = TangentialLoad((2.0, -1.0), start=1.5, duration=0.5).extend(plan)
    along = [[extended.value(channel, t) for t in (0.0, 1.5, 1.75, 2.0, 9.0)] for channel in ("force_x", "force_y")]
    np.testing.assert_allclose(along, [[0.0, 0.0, 1.0, 2.0, 2.0], [0.0, 0.0, -0.5, -1.0, -1.0]], atol=1e-15)


def test_a_sensor_looks_where_and_when_it_says(plan: Plan) -> None:
    sampling = SensorSampling((4, 5), 1.5e-3, 50.0).extend(plan).sampling
    assert sampling is not None
    assert (sampling.points, sampling.pitch, sampling.frame_rate) == ((4, 5), 1.5e-3, 50.0)
    usual = SensorSampling().extend(plan).sampling
    assert usual is not None
    assert (usual.points, usual.pitch) == ((RAMP.points, RAMP.points), RAMP.pitch)


def log_with_slip(slips: list[int]) -> GraspLog:
    """Eight frames of 2 × 2 elements, of which the first moves in some frames."""
    rest = np.stack([*np.meshgrid(*[1e-3 * np.arange(2.0)] * 2, indexing="ij"), np.zeros((2, 2))], axis=-1)
    moved = np.zeros((8, 2, 2), bool)
    moved[slips, 0, 0] = True
    nothing, ratio = np.zeros((8, 2, 2), bool), np.ones(8)
    truth = GroundTruth(
        slip_contact_factor=nothing,
        slip_kinematic=moved,
        contact=nothing,
        stick_ratio=ratio,
        friction=FrictionLaw((0.5, 0.0, 0.0)),
    )
    return GraspLog(np.arange(8) / 50.0, rest, np.zeros((8, 2, 2, 3)), 1e-6, truth=truth)


class Chosen:
    """A generator that draws what it is told to."""

    def __init__(self, *drawn: float) -> None:
        self.drawn = np.array(drawn)

    def random(self, count: int) -> np.ndarray:
        assert count == len(self.drawn)
        return self.drawn


def test_frames_are_lost_below_the_probability_but_never_the_first_and_last() -> None:
    drawn = Chosen(0.0, 0.9, 0.29, 0.3, 0.1, 0.31, 0.2, 0.0)
    log = log_with_slip([2, 4])
    left = DroppedFrames(0.3).observe(log, drawn)
    np.testing.assert_allclose(left.time * 50.0, [0.0, 1.0, 3.0, 5.0, 7.0], rtol=1e-12)
    assert left.truth is not None
    np.testing.assert_array_equal(left.truth.slip_kinematic[:, 0, 0], [False, False, True, True, False])
    assert not left.truth.slip_kinematic[:, 1, 1].any()
    assert len(log) == 8


def test_frames_are_lost_of_a_log_whose_truth_nobody_knows() -> None:
    left = DroppedFrames(0.5).observe(replace(log_with_slip([]), truth=None), Chosen(*[0.4] * 8))
    assert (len(left), left.truth) == (2, None)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: DroppedFrames(1.0), "probability of a lost frame is 1.0; allowed: 0 to below 1"),
        (lambda: DroppedFrames(-0.1), "probability of a lost frame is -0.1"),
        (lambda: FrictionPatch(0.1, (0.0, 0.0), -1e-3), "radius of the friction patch is -0.001; allowed: above 0 m"),
        (lambda: PressureFriction(0.1, -1e-6), "element_area is -1e-06; allowed: above 0 m²"),
        (lambda: RandomFriction(nan, 1e-3), "scale of random friction is nan; allowed: at least 0"),
        (lambda: RandomFriction(0.1, -1e-3), "correlation_length is -0.001; allowed: above 0 m"),
        (lambda: SensorSampling((5, 1)), "points of the sensor is (5, 1); allowed: at least 2 each way"),
        (lambda: SensorSampling(pitch=0.0), "pitch above 0 m and frame rate above 0 1/s"),
        (
            lambda: LoadPath((0.0, 1.0)),
            "loads of LoadPath is none; allowed: one or more of normal_force, force_x, force_y, moment",
        ),
        (
            lambda: LoadPath((0.0, 1.0), force_x=(1.0,)),
            "force_x of LoadPath is 1 values; allowed: one for each time, 2, or none",
        ),
        (
            lambda: LoadPath((0.0, 1.0), force_x=(0.0, 1.0), cycles=0),
            "cycles of LoadPath is 0; allowed: a whole",
        ),
        (
            lambda: ObjectMotion((0.0,), yaw=(0.0, 1.0)),
            "yaw of ObjectMotion is 2 values; allowed: one for each",
        ),
        (
            lambda: SensorSampling((20, 20), 0.75),
            "sensor is 14.2 m across, by its points and pitch; allowed: 0.0001 to 0.5 m",
        ),
        (lambda: SensorSampling(frame_rate=0.0), "pitch above 0 m and frame rate above 0 1/s"),
    ],
)
def test_an_impossible_effect_is_refused_by_name_and_value(make: Callable[[], Effect], message: str) -> None:
    with pytest.raises(InvalidInput, match=re.escape(message)):
        make()


@pytest.mark.parametrize(
    "make",
    [
        lambda row: LoadPath(row(0.0, 1.0), normal_force=row(0.0, 3.0), cycles=2),
        lambda row: ObjectMotion(row(0.0, 1.0), y=row(0.0, 3.0), cycles=2),
    ],
)
def test_a_path_may_be_arrays(make: Callable[[Callable[..., Any]], Effect]) -> None:
    """They were allowed by their type, and ended in numpy's error."""
    plan = Scene("a").plan()
    as_tuples, as_arrays = (make(row) for row in (lambda *values: values, lambda *values: np.array(values)))
    assert not as_arrays.absent
    assert as_arrays.extend(plan).histories == as_tuples.extend(plan).histories


@pytest.mark.parametrize(
    "effect",
    [
        SensorSampling((2, 2)),
        DroppedFrames(0.0),
        DroppedFrames(1.0 - 1e-9),
        RandomFriction(0.0, 1e-9),
        FrictionPatch(0.0, (0.0, 0.0), 1e-9),
        PressureFriction(0.0, 1e-12),
    ],
    ids=repr,
)
def test_what_is_just_permitted_is_taken_and_absent_at_no_strength(effect: Effect) -> None:
    strengths = [getattr(effect, name) for name in ("probability", "scale", "change", "slope") if hasattr(effect, name)]
    assert effect.absent is (strengths == [0.0])
    assert inf not in strengths
