import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest

from benchmarks.control import protocols as control_protocols
from benchmarks.control.__main__ import episode
from benchmarks.control.episodes import Task, world_of
from benchmarks.control.protocols import FRICTIONS, critical_friction
from benchmarks.control.strategies import Controlled, with_model
from benchmarks.control.tasks import LIFTED, PAPER_ON_RUBBER, PROTOCOLS, RATE, SHAKEN, TAKEN, slippery
from slipcore.contact.reduced import GRAVITY

GRASP, CLOSE = PROTOCOLS


def acceleration(task: Task, time: float) -> np.ndarray:
    """Of the gripper, up and sideways, m/s²: what the object's inertia adds to its weight."""
    load = task.load(time)
    along, across, _ = load.resultant()
    return np.array([along / load.mass - GRAVITY * (1.0 - load.supports), across / load.mass])


@pytest.mark.parametrize(("task", "height"), [(GRASP, 0.3), (CLOSE, 0.2)])
def test_a_protocol_s_gripper_is_at_rest_after_its_lift(task: Task, height: float) -> None:
    """The second half of a smoothstep slows down from 1.5 heights per second to rest, over half of the height."""
    time = np.linspace(LIFTED - 0.5, LIFTED, 1001)[:-1]
    slowing = np.array([acceleration(task, each)[0] for each in time])
    assert slowing.mean() * 0.5 == pytest.approx(-1.5 * height, rel=2e-3)
    assert task.load(LIFTED + 0.1).resultant()[0] == pytest.approx(task.load(2.0).mass * GRAVITY, rel=1e-12)


def test_a_gripper_that_rises_takes_over_the_weight() -> None:
    for task in PROTOCOLS:
        assert task.load(0.5).supports == 1.0
        assert task.load(0.5 + TAKEN).supports == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(("task", "axis", "radius"), [(GRASP, 1, 0.01), (CLOSE, 0, 0.02)])
def test_a_protocol_shakes_at_2_hz(task: Task, axis: int, radius: float) -> None:
    time = np.linspace(SHAKEN, task.seconds, 2001)
    shaken = np.array([acceleration(task, each)[axis] for each in time])
    assert abs(shaken).max() == pytest.approx(radius * RATE**2, rel=1e-3)
    crossings = int((np.diff(np.sign(shaken[abs(shaken) > 1e-3])) != 0).sum())
    assert crossings == {0.01: 5, 0.02: 7}[radius]  # 1.5 s and 2 s of 2 Hz


def test_what_a_gripper_held_is_free_when_it_opens() -> None:
    task = dataclasses.replace(GRASP, seconds=0.1)
    assert episode(task, "known", 0).freed
    assert episode(dataclasses.replace(task, opens=False), "known", 0).freed  # nothing was to free it


def test_a_model_is_told_another_friction_than_the_object_has() -> None:
    task = slippery(0.2)
    controlled = with_model(1.0, task, world_of(task, 0), 0)
    assert isinstance(controlled, Controlled)
    assert controlled.state.known is not None
    low, high = controlled.state.known.bounds(5.0)
    assert (low + high) / 2.0 == pytest.approx(PAPER_ON_RUBBER, rel=1e-12)
    assert world_of(task, 0).friction.mean() < 0.3


@pytest.mark.parametrize("least", [0.05, 0.2, 0.45])
def test_the_critical_friction_is_the_least_that_is_lifted(least: float, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[float] = []

    def lifts(name: str, friction: float, seed: int) -> bool:  # noqa: ARG001
        asked.append(friction)
        return friction >= least

    monkeypatch.setattr(control_protocols, "lifts", lifts)
    assert critical_friction("known", 0) == least
    assert len(asked) <= 1 + math.ceil(math.log2(len(FRICTIONS)))


def test_what_lifts_nothing_has_no_critical_friction(monkeypatch: pytest.MonkeyPatch) -> None:
    never: Callable[..., bool] = lambda name, friction, seed: False  # noqa: ARG005, E731
    monkeypatch.setattr(control_protocols, "lifts", never)
    assert math.isnan(critical_friction("known", 0))
