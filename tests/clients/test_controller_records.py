"""What a grip controller is given: refused by name where it cannot be."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from stiction_client import InvalidArgument
from stiction_client.controller.records import Command, Observation, SlipSamples, checked

SEEN = Observation(1.0, 2.0, 0.5, 0.01, 0.75, SlipSamples(np.array([0.4, 0.5]), np.array([0.1, 0.3]), 0.5))


def test_a_frame_is_taken_up_to_the_ends_of_each_range() -> None:
    checked(SEEN, 0.999)
    checked(SEEN, -math.inf)
    for changes in (
        {"normal": 0.0, "tangential": 0.0, "torque": 0.0},
        {"stick_ratio": 0.0},
        {"stick_ratio": 1.0},
        {"stick_ratio": math.nan},
        {"slip_samples": None},
        {"slip_samples": SlipSamples(np.zeros(1), np.zeros(1), 0.0)},
        {"slip_samples": SlipSamples(np.zeros(0), np.zeros(0), 1.0)},
    ):
        checked(replace(SEEN, **changes), 0.0)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"time": 0.5}, r"time is 0\.5; allowed: later than 0\.5 s, and within 1e\+12 s of 0"),
        ({"time": math.inf}, "time is inf"),
        ({"time": math.nan}, "time is nan"),
        ({"normal": -1e-9}, r"normal is -1e-09; allowed: a magnitude of 0 to 1e\+09; without one, leave the frame"),
        ({"tangential": math.nan}, "tangential is nan"),
        ({"torque": math.inf}, "torque is inf"),
        ({"stick_ratio": 1.01}, r"stick_ratio is 1\.01; allowed: 0 to 1, or NaN where none is known"),
        ({"stick_ratio": -0.01}, "stick_ratio is"),
        ({"stick_ratio": 10**400}, "stick_ratio is 1000"),
        ({"time": 10**400}, "time is 1000"),
        ({"tangential": 1e300}, r"tangential is 1e\+300"),
        ({"torque": 10**400}, "torque is 1000"),
    ],
)
def test_a_number_that_cannot_be_is_named(changes: dict[str, Any], told: str) -> None:
    with pytest.raises(InvalidArgument, match=told):
        checked(replace(SEEN, **changes), 0.5)


def test_numbers_of_other_kinds_become_floats() -> None:
    """A time in single precision would be told to a second only after half a year."""
    seen = checked(Observation(np.float32(1.0), 2, np.float64(0.5), np.int64(0), 1, SEEN.slip_samples), 0.0)  # type: ignore[arg-type]
    assert seen == Observation(1.0, 2.0, 0.5, 0.0, 1.0, SEEN.slip_samples)
    assert {type(each) for each in (seen.time, seen.normal, seen.tangential, seen.torque, seen.stick_ratio)} == {float}
    assert checked(SEEN, 0.0) is SEEN


@pytest.mark.parametrize(
    ("samples", "told"),
    [
        (SlipSamples(np.zeros(2), np.zeros(2), 1.01), r"slip_samples\.moving is 1\.01; allowed: 0 to 1"),
        (SlipSamples(np.zeros(2), np.zeros(2), -0.01), r"slip_samples\.moving is"),
        (SlipSamples(np.zeros(2), np.zeros(3)), r"slip_samples\.normal_force is of shape \[3\]; allowed: two arrays"),
        (SlipSamples(np.zeros((1, 2)), np.zeros((1, 2))), r"slip_samples\.friction_coefficient is of shape \[1, 2\]"),
        (SlipSamples(np.array([0.4, -0.1]), np.zeros(2)), r"slip_samples\.friction_coefficient is \[0\.4, -0\.1\]"),
        (
            SlipSamples(np.zeros(2), np.array([0.1, np.inf])),
            r"slip_samples\.normal_force is \[0\.1, inf\]; allowed: numbers of 0 to 1e\+09",
        ),
        (SlipSamples(np.array([np.nan, 0.1]), np.zeros(2)), r"slip_samples\.friction_coefficient is"),
    ],
)
def test_samples_that_cannot_be_are_named(samples: SlipSamples, told: str) -> None:
    with pytest.raises(InvalidArgument, match=told):
        checked(replace(SEEN, slip_samples=samples), 0.0)


def test_friction_of_a_contact_weighs_its_elements_by_force() -> None:
    assert SEEN.slip_samples is not None
    assert SEEN.slip_samples.contact_friction() == pytest.approx((0.04 + 0.15) / 0.4)
    assert math.isnan(SlipSamples(np.array([0.4]), np.zeros(1)).contact_friction())


def test_what_is_not_said_is_not_known() -> None:
    plain = Observation(0.0, 1.0, 0.5)
    assert (plain.torque, math.isnan(plain.stick_ratio), plain.slip_samples) == (0.0, True, None)
    assert SlipSamples(np.zeros(1), np.zeros(1)).moving == 1.0
    command = Command(1.0, "hold", "known")
    assert (command.material, command.probability) == (None, 0.0)
