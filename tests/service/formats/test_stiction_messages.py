"""Stiction's own messages: which members a frame's and the log's have, and when they are of."""

import math
from dataclasses import replace

import numpy as np
import pytest

from service.formats.ros_types import deserializer
from service.formats.stiction_messages import definition, messages, nanoseconds
from slipcore import GraspLog, InvalidInput


def test_the_log_s_message_comes_first_and_then_one_a_frame(log: GraspLog) -> None:
    told = list(messages(log))
    assert [(topic, kind) for topic, kind, *_ in told[:2]] == [
        ("/stiction/log", "stiction_msgs/msg/GraspLog"),
        ("/stiction/frame", "stiction_msgs/msg/Frame"),
    ]
    assert [moment for *_, moment, _ in told] == [0, 0, 30_000_000, 70_000_000, 100_000_000, 200_000_000]
    _, kind, text, _, content = told[0]
    whole = deserializer(kind, text, ros1=False)(content)
    assert getattr(whole, "grid").tolist() == [3, 4]  # noqa: B009 - the type is made of its definition
    assert getattr(whole, "element_area") == 1e-6  # noqa: B009
    _, kind, text, _, content = told[3]
    frame = deserializer(kind, text, ros1=False)(content)
    assert getattr(frame, "time") == 0.07  # noqa: B009
    assert np.array_equal(getattr(frame, "displacement"), log.displacement[2].reshape(-1))  # noqa: B009
    assert getattr(frame, "gripper_force") == 2.5  # noqa: B009


def test_a_message_has_the_members_that_there_are() -> None:
    present = {"time", "displacement", "element_area", "sensor", "contact"}
    whole = {"string sensor", "float64 element_area", "uint32[2] grid"}
    assert set(definition(True, present).splitlines()) == whole
    assert set(definition(False, present).splitlines()) == {"float64 time", "float64[] displacement", "bool[] contact"}


def test_times_are_nanoseconds_from_0_on(log: GraspLog) -> None:
    assert nanoseconds(0.0) == 0
    assert nanoseconds(1.0000000004) == 1_000_000_000
    assert nanoseconds(9.2e9) == 9_200_000_000_000_000_000
    told = r"; allowed: 0 to 9\.2e9 s, for a recording counts nanoseconds from 0"
    for wrong, shown in (
        (-1e-6, "-1e-06 s"),
        (2.0**63 / 1e9, "9.22337e.09 s"),
        (math.nextafter(9.3e9, 0), "9.3e.09 s"),
    ):
        with pytest.raises(InvalidInput, match=f"time is {shown}{told}"):
            nanoseconds(wrong)
    with pytest.raises(InvalidInput, match="time is -1 s"):
        list(messages(replace(log, time=log.time - 1.0)))
