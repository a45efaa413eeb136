"""Recognising an object's material among known ones, in the controller."""

import dataclasses
import math
import time
from collections.abc import Callable

import numpy as np
import pytest

from estimators.defaults import RECOGNITION, REFERENCE
from stiction_client import (
    Contact,
    ControllerState,
    ControlSettings,
    FrictionModel,
    GraspController,
    InvalidArgument,
    Observation,
    SlipSamples,
)
from stiction_client.controller import recognition
from stiction_client.controller.recognition import GripRecognition
from tests.clients.point_contact import FRAME, PointContact, ramp, run

Make = Callable[..., FrictionModel]

SETTINGS = ControlSettings(contact=Contact.round(6e-5, at_force=5.0), least_force=0.5, most_force=40.0)
LIFT = ramp((1.5, 0.5, 0.3))


@pytest.fixture
def materials(make_model: Make) -> dict[str, FrictionModel]:
    """Of 0.3, 0.45 and 0.7, each known to 1 %, of which grasps scatter by 0.02."""
    covariance = np.diag([1e-5, 0.0, 0.0])
    known = {"steel": 0.3, "paper": 0.45, "rubber": 0.7}
    scatters = {"covariance": covariance, "scale": 0.02, "degrees_of_freedom": 50.0}
    return {name: make_model(coefficients=(friction, 0.0, 0.0), **scatters) for name, friction in known.items()}


@pytest.mark.parametrize(("name", "friction"), [("steel", 0.3), ("paper", 0.45), ("rubber", 0.7)])
@pytest.mark.parametrize("seed", range(3))
def test_a_known_material_is_recognised_within_a_second(
    name: str, friction: float, seed: int, materials: dict[str, FrictionModel]
) -> None:
    plant = PointContact(LIFT, friction=friction, seed=seed)
    episode = run(plant, GraspController.init(SETTINGS, materials=materials))
    told = [command.material for command in episode.commands]
    assert set(told) == {None, name}
    assert episode.time[told.index(name)] < 0.5 + 1.0  # the load comes at 0.5 s
    assert episode.commands[-1].probability > 0.9
    assert episode.modes() == ["feel", "hold"]
    assert plant.slipped < 1e-5
    assert 1.0 < episode.normal[-1] / episode.least < 1.25


@pytest.mark.parametrize("friction", [0.2, 0.37, 0.57, 0.95])
@pytest.mark.parametrize("seed", range(3))
def test_a_stranger_stays_unknown_and_is_learnt(
    friction: float, seed: int, materials: dict[str, FrictionModel]
) -> None:
    plant = PointContact(LIFT, friction=friction, seed=seed)
    episode = run(plant, GraspController.init(SETTINGS, materials=materials))
    assert {command.material for command in episode.commands} == {None}
    assert plant.slipped < 1e-3
    assert 1.0 < episode.normal[-1] / episode.least < 1.25


@pytest.mark.parametrize("seed", range(3))
def test_what_was_taken_for_another_is_held_and_not_guessed_again(
    seed: int, materials: dict[str, FrictionModel]
) -> None:
    """Samples told of 0.45 at first, and it has 0.35."""
    state = GraspController.init(SETTINGS, materials={"paper": materials["paper"]})
    for frame in range(1, 20):
        told = SlipSamples(np.full(10, 0.45), np.full(10, 0.05))
        state, command = GraspController.step(state, Observation(frame * FRAME, 0.5, 0.15, 0.0, 0.5, told))
    assert command.material == "paper"
    later = ramp((0.15, -1.0, 0.1), (1.35, 0.5, 0.3))
    plant = PointContact(later, friction=0.35, seed=seed)
    episode = run(plant, dataclasses.replace(state, time=-math.inf))
    assert plant.slipped < 1e-3
    materials_told = [each.material for each in episode.commands]
    discarded = materials_told.index(None)
    assert set(materials_told[:discarded]) == {"paper"}
    assert set(materials_told[discarded:]) == {None}
    assert episode.commands[discarded].mode == "alarm"
    assert 1.0 < episode.normal[-1] / episode.least < 1.3


def test_probabilities_are_bayes_s(materials: dict[str, FrictionModel]) -> None:
    """Of 300,000 grasps of the three and of strangers, those whose samples tell the same."""
    among = GripRecognition.among(materials, SETTINGS)
    assert among is not None
    told = dataclasses.replace(among, mean=0.4, count=20, frames=5)
    generator = np.random.default_rng(0)
    kinds = generator.choice(4, 300_000, p=[0.95 / 3] * 3 + [0.05])
    means = np.array([0.3, 0.45, 0.7, recognition.UNKNOWN_FRICTION])[kinds]
    scatter = np.array([math.hypot(0.02, math.sqrt(1e-5))] * 3 + [recognition.UNKNOWN_LEVEL])[kinds]
    grasps = means + scatter * generator.standard_normal(kinds.size)
    error = math.hypot(SETTINGS.learned_error, SETTINGS.sample_error / math.sqrt(20.0)) * 0.4
    alike = kinds[abs(grasps + error * generator.standard_normal(kinds.size) - 0.4) < 5e-3]
    shares = np.bincount(alike, minlength=4) / alike.size
    found = told.probabilities(2.0, SETTINGS)
    np.testing.assert_allclose(found, shares, atol=4.0 * 0.5 / math.sqrt(alike.size))  # four standard errors


def test_what_is_believed_of_strangers_is_the_estimators() -> None:
    assert RECOGNITION.unknown == recognition.UNKNOWN_SHARE
    assert (REFERENCE.friction, RECOGNITION.level) == (recognition.UNKNOWN_FRICTION, recognition.UNKNOWN_LEVEL)


def test_a_material_named_unknown_is_refused_and_none_is_as_without(materials: dict[str, FrictionModel]) -> None:
    with pytest.raises(InvalidArgument, match="materials"):
        GraspController.init(SETTINGS, materials={"unknown": materials["paper"]})
    assert GraspController.init(SETTINGS, materials={}).recognition is None
    given = GraspController.init(SETTINGS, materials["steel"], materials)
    assert (given.recognition, given.mode) == (None, "hold")


def test_samples_of_long_ago_are_forgotten(materials: dict[str, FrictionModel]) -> None:
    among = GripRecognition.among(materials, SETTINGS)
    assert among is not None
    for second, friction in ((0.0, 0.3), (0.5, 0.4), (1.6, 0.7)):
        among = among.step(second, True, friction, 4, SETTINGS)
    assert (among.loaded, among.sampled, among.mean, among.count, among.frames) == (0.0, 1.6, 0.7, 4, 1)


def test_a_ring_is_sampled_though_the_stick_ratio_after_a_rise_of_the_force_says_otherwise(
    materials: dict[str, FrictionModel],
) -> None:
    """A stick ratio of 0.8 under 0.4 of 2 N would be a friction of 0.7, if the force had not risen under the load."""
    state = GraspController.init(SETTINGS, materials=materials)
    for frame in range(1, 10):
        told = SlipSamples(np.full(4, 0.3), np.full(4, 0.03))  # of the 0.18 N that the ring bears
        state, command = GraspController.step(state, Observation(frame * FRAME, 2.0, 0.4, 0.0, 0.8, told))
    assert command.material == "steel"


def test_a_few_elements_of_the_ring_that_the_stick_ratio_contradicts_are_no_samples(
    materials: dict[str, FrictionModel],
) -> None:
    state = GraspController.init(SETTINGS, materials=materials)
    for frame in range(1, 10):
        told = SlipSamples(np.full(1, 0.3), np.full(1, 0.03))
        state, command = GraspController.step(state, Observation(frame * FRAME, 2.0, 0.4, 0.0, 0.8, told))
    assert command.material is None
    assert state.recognition is not None
    assert state.recognition.frames == 0


def test_the_force_is_held_still_while_a_load_grows_and_then_pressed_for_the_load_to_come(
    materials: dict[str, FrictionModel],
) -> None:
    state = GraspController.init(SETTINGS, materials=materials)
    force, load = [0.5], [0.0]
    for frame in range(1, 55):
        load.append(0.02 * frame)  # 1.2 N/s
        state, command = GraspController.step(state, Observation(frame * FRAME, force[-1], load[-1], 0.0, 1.0))
        force.append(command.normal_force)
    rises = np.flatnonzero(np.diff(force) > 0.0)
    assert rises.size < 8  # in steps of 2.5 N a frame, by the rate at which forces may rise
    held = np.diff(np.concatenate([[0], rises, [54]])).max()
    assert held > 20
    assert state.recognition is not None
    most = state.recognition.borne(1.0, SETTINGS)
    assert most > 0.3  # more than the most slippery of the materials bears
    assert all(tangential <= most * normal for tangential, normal in zip(load[1:], force[1:], strict=True))


def test_a_step_among_a_hundred_materials_costs_hardly_more_than_one_with_a_model(make_model: Make) -> None:
    """Where a step with a model takes 62 µs: up to 100 µs are asked. They lie so close that none is recognised."""
    many = {str(k): make_model(coefficients=(0.3 + 4e-3 * k, 0.0, 0.0)) for k in range(100)}
    states = [GraspController.init(SETTINGS, materials=many), GraspController.init(SETTINGS, many["50"])]
    told = SlipSamples(np.full(3, 0.5), np.full(3, 0.05))
    for frame in range(1, 6):
        seen = Observation(frame * FRAME, 0.5, 0.05, 0.0, 0.8, told)
        states = [GraspController.step(state, seen)[0] for state in states]
    assert states[0].recognition is not None
    seen = dataclasses.replace(seen, time=0.1)
    among, known = (min(_seconds(state, seen) for _ in range(50)) for state in states)
    assert among < 3.0 * known


def _seconds(state: ControllerState, seen: Observation) -> float:
    began = time.process_time()
    GraspController.step(state, seen)
    return time.process_time() - began
