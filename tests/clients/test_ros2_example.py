"""The example's mathematics, and its node on stand-ins for ROS."""

import math
import runpy
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from stiction_client import FrictionModel, GraspController, InvalidArgument, Observation

FOLDER = Path(__file__).parents[2] / "examples" / "ros2"
PARAMETERS = {"contact_area": 6e-5, "round_at": 5.0, "least_force": 0.5, "most_force": 30.0, "learn_frames": 6.0}
EXAMPLE = SimpleNamespace(**runpy.run_path(str(FOLDER / "grip.py")))
STILL = (0.0, 0.0, 0.0)


def grip() -> Any:
    return EXAMPLE.Grip(EXAMPLE.settings_of(PARAMETERS))


def test_parameters_become_settings() -> None:
    settings = EXAMPLE.settings_of(PARAMETERS)
    assert (settings.least_force, settings.most_force, settings.learn_frames) == (0.5, 30.0, 6)
    assert settings.contact.reference_force == 5.0
    assert EXAMPLE.settings_of(PARAMETERS | {"round_at": 0.0}).contact.reference_force is None
    with pytest.raises(InvalidArgument, match="least_force is 40"):
        EXAMPLE.settings_of(PARAMETERS | {"least_force": 40.0})


def test_a_stamp_is_told_in_seconds() -> None:
    assert EXAMPLE.seconds(1_800_000_000, 250_000_000) == 1_800_000_000.25


def test_wrenches_are_resultants_of_the_controller_s() -> None:
    node, state = grip(), GraspController.init(EXAMPLE.settings_of(PARAMETERS))
    for count in range(1, 30):
        time, load = count / 60.0, 0.02 * count
        node.on_stick_ratio(time, 0.8)
        command = node.on_wrench(time, (-3.0 * load, 4.0 * load, -2.0), (5.0, 5.0, -1e-3))
        state, expected = GraspController.step(state, Observation(time, 2.0, 5.0 * load, 1e-3, 0.8))
        assert command.normal_force == pytest.approx(expected.normal_force, rel=1e-12)
        assert (command.mode, command.reason) == (expected.mode, expected.reason)


def test_a_finger_that_is_pulled_presses_with_nothing() -> None:
    assert grip().on_wrench(1.0, (0.0, 0.0, 0.3), STILL).normal_force == 0.5


@pytest.mark.parametrize("wrench", [(0.99, (0.0, 0.0, -1.0)), (1.0, (0.0, 0.0, -1.0)), (1.1, (math.nan, 0.0, -1.0))])
def test_what_comes_late_or_is_no_number_commands_nothing(wrench: tuple[float, tuple[float, float, float]]) -> None:
    node = grip()
    assert node.on_wrench(1.0, (0.0, 0.0, -1.0), STILL) is not None
    assert node.on_wrench(*wrench, STILL) is None
    assert node.on_wrench(1.2, (0.0, 0.0, -1.0), STILL) is not None


def test_a_clock_set_back_begins_a_new_grasp() -> None:
    node = grip()
    for count in range(1, 60):
        last = node.on_wrench(100.0 + count / 60.0, (3.0, 0.0, -2.0), STILL)
    assert last.normal_force > 5.0
    assert node.on_wrench(0.5, (0.0, 0.0, -1.0), STILL).normal_force == 1.0  # what it presses with, and no less


def test_an_old_stick_ratio_says_nothing() -> None:
    """Under load the controller then has neither a model nor a stick ratio, and says so."""
    fresh, stale = grip(), grip()
    for count in range(1, 40):
        fresh.on_stick_ratio(count / 60.0, 0.9)
        stale.on_stick_ratio(1 / 60.0, 0.9)  # the same message, over and over
        answers = [node.on_wrench(count / 60.0, (1.0, 0.0, -6.0), STILL) for node in (fresh, stale)]
    assert [answer.mode == "alarm" for answer in answers] == [False, True]


def test_samples_of_slip_are_read_off_their_message() -> None:
    told = EXAMPLE.samples_of([0.5, 0.3, 0.05, 0.4, 0.06])
    assert told.friction_coefficient.tolist() == [0.3, 0.4]
    assert told.normal_force.tolist() == [0.05, 0.06]
    assert told.moving == 0.5
    still = EXAMPLE.samples_of([0.0])
    assert (still.friction_coefficient.size, still.moving) == (0, 0.0)
    for none in ([], [1.0], [0.0, 0.3, 0.05], [1.0, 0.3], [1.0, math.nan, 0.05], [1.0, 0.3, -0.05], [1.1, 0.3, 0.05]):
        assert EXAMPLE.samples_of(none) is None


def test_the_node_recognises_a_material_by_samples_and_takes_each_message_once(
    make_model: Callable[..., FrictionModel],
) -> None:
    flat = make_model(coefficients=(0.45, 0.0, 0.0), covariance=np.diag([1e-5, 0.0, 0.0]), scale=0.02)
    once, often = (EXAMPLE.Grip(EXAMPLE.settings_of(PARAMETERS), None, {"paper": flat}) for _ in range(2))
    for count in range(1, 20):
        for node, heard in ((once, count == 1), (often, True)):
            node.on_stick_ratio(count / 60.0, 0.7)
            if heard:
                node.on_slip_samples(count / 60.0, [1.0, *[0.45, 0.05] * 8])
        answers = [node.on_wrench(count / 60.0, (0.1, 0.0, -0.5), STILL) for node in (once, often)]
    assert [answer.material for answer in answers] == [None, "paper"]


class StandInNode:
    """As much of rclpy's as the node uses."""

    def __init__(self, name: str, **_: bool) -> None:
        self.name, self.published, self.logged = name, [], []  # type: ignore[var-annotated]
        self.subscribed: dict[str, Any] = {}

    def get_parameters_by_prefix(self, _: str) -> dict[str, SimpleNamespace]:
        return {name: SimpleNamespace(value=value) for name, value in PARAMETERS.items()}

    def create_publisher(self, _: type, topic: str, __: int) -> SimpleNamespace:
        return SimpleNamespace(publish=lambda message: self.published.append((topic, message.data)))

    def create_subscription(self, _: type, topic: str, call: Any, __: int) -> None:
        self.subscribed[topic] = call

    def get_clock(self) -> SimpleNamespace:
        stamp = SimpleNamespace(sec=7, nanosec=0)
        return SimpleNamespace(now=lambda: SimpleNamespace(to_msg=lambda: stamp))

    def get_logger(self) -> SimpleNamespace:
        return SimpleNamespace(info=self.logged.append)


def module(name: str, **names: Any) -> ModuleType:
    made = ModuleType(name)
    vars(made).update(names)
    return made


def test_the_node_publishes_a_force_for_each_wrench(monkeypatch: pytest.MonkeyPatch) -> None:
    class Number(SimpleNamespace):
        pass

    for each in (
        module("rclpy"),
        module("rclpy.node", Node=StandInNode),
        module("geometry_msgs"),
        module("geometry_msgs.msg", WrenchStamped=SimpleNamespace),
        module("std_msgs"),
        module("std_msgs.msg", Float64=Number, Float64MultiArray=Number),
    ):
        monkeypatch.setitem(sys.modules, each.__name__, each)
    monkeypatch.setattr(sys, "path", [*sys.path])
    node = runpy.run_path(str(FOLDER / "node.py"))["GripNode"]()
    vector = SimpleNamespace(x=0.0, y=1.0, z=-6.0)
    node.subscribed["~/stick_ratio"](Number(data=0.9))
    node.subscribed["~/slip_samples"](Number(data=[1.0, 0.3, 0.05]))
    for count in range(3):
        header = SimpleNamespace(stamp=SimpleNamespace(sec=7, nanosec=20_000_000 * count))
        wrench = SimpleNamespace(force=vector, torque=SimpleNamespace(x=0.0, y=0.0, z=0.0))
        node.subscribed["~/wrench"](SimpleNamespace(header=header, wrench=wrench))
    assert [topic for topic, _ in node.published] == ["~/grip_force"] * 3
    assert 0.5 <= node.published[-1][1] <= 30.0
    assert len(node.logged) >= 1
    monkeypatch.delitem(sys.modules, "grip", raising=False)
