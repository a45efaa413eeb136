import dataclasses
import math
import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slipcore.contact.reference import CattaneoMindlin, HertzContact, half_space
from stiction_client import (
    Contact,
    ControllerState,
    ControlSettings,
    FrictionModel,
    GraspController,
    InvalidArgument,
    Observation,
    Scale,
    Scales,
    SlipSamples,
    required_normal_force,
)
from stiction_client.controller import controller, gains
from stiction_client.controller.friction import KnownFriction, LearnedFriction, utilisation
from stiction_client.controller.load import LoadEstimate, size_of
from stiction_client.defaults import BORNE, NORMAL_DEVIATIONS
from tests.clients.point_contact import FRAME, Episode, PointContact, ramp, run

Make = Callable[..., FrictionModel]

SETTINGS = ControlSettings(contact=Contact.round(6e-5, at_force=5.0), least_force=0.5, most_force=40.0)
LIFT = ramp((1.5, 0.5, 0.3))
SEEDS = range(4)


@pytest.mark.parametrize("normal", [0.0, 1.0, 5.0])
@pytest.mark.parametrize("torque", [0.0, 0.01, 1.0])
def test_a_torque_counts_by_its_arm_and_not_without_contact(normal: float, torque: float) -> None:
    arm = float(SETTINGS.contact.arm(normal))
    expected = math.hypot(1.5, torque / arm) if normal else 1.5
    assert size_of(Observation(0.0, normal, 1.5, torque), SETTINGS) == pytest.approx(expected, rel=1e-12)


def test_a_contact_without_arm_bears_no_torque() -> None:
    flat = dataclasses.replace(SETTINGS, contact=Contact(6e-5))
    assert size_of(Observation(0.0, 5.0, 1.5, 0.0), flat) == 1.5
    with pytest.raises(InvalidArgument, match="torque"):
        size_of(Observation(0.0, 5.0, 1.5, 0.01), flat)


def model_of(make: Make, friction: float, slope: float = 0.0) -> FrictionModel:
    """A model that knows its friction to 1 % and scatters by 0.02."""
    covariance = np.diag([1e-5, 0.0, 0.0])
    return make(coefficients=(friction, 0.0, slope), covariance=covariance, scale=0.02, degrees_of_freedom=50.0)


def fell_or_rose_too_fast(episode: Episode) -> bool:
    force = np.array([command.normal_force for command in episode.commands])
    elapsed = np.minimum(np.diff(episode.time), SETTINGS.dropout_time)
    rise, fall = SETTINGS.rise_rate * elapsed, SETTINGS.fall_rate * elapsed * force[:-1]
    change = np.diff(force)
    return bool((change > rise + 1e-9).any() or (change < -fall - 1e-9).any())


@pytest.mark.parametrize("seed", SEEDS)
def test_an_unknown_object_is_held_and_then_gripped_by_what_was_learnt(seed: int) -> None:
    episode = run(PointContact(LIFT, seed=seed), GraspController.init(SETTINGS))
    assert episode.plant.slipped < 1e-5
    assert episode.modes() == ["feel", "hold"]
    assert 1.0 < episode.normal[-1] / episode.least < 1.25
    assert max(episode.normal) < 1.1 * 1.5 / SETTINGS.unknown_friction


@pytest.mark.parametrize("missed", [0.5, 0.8])
@pytest.mark.parametrize("seed", SEEDS)
def test_a_detector_that_misses_slip_does_not_lose_what_is_unknown(seed: int, missed: float) -> None:
    """Its stick ratio never gets as low as the force would fall for; the elements that it does see tell friction."""
    episode = run(PointContact(LIFT, seed=seed, missed=missed), GraspController.init(SETTINGS))
    assert episode.plant.slipped < 1e-3
    assert 1.0 < episode.normal[-1] / episode.least < 1.3


@pytest.mark.parametrize("seed", SEEDS)
def test_what_sticks_and_is_sampled_as_slip_does_not_press_ever_harder(seed: int) -> None:
    """Such elements show less friction the harder the contact is pressed."""
    plant = PointContact(LIFT, sampled_share=0.7, sampled_below=1.1, seed=seed)
    episode = run(plant, GraspController.init(SETTINGS))
    assert episode.plant.slipped == 0.0
    assert max(episode.normal) < 1.4 * 1.5 / SETTINGS.unknown_friction  # the lead for a load that comes fast


@pytest.mark.parametrize("seed", SEEDS)
def test_a_known_object_that_tells_no_samples_is_held_with_the_planner_s_force(seed: int, make_model: Make) -> None:
    model = model_of(make_model, 0.45)
    episode = run(PointContact(LIFT, sampled_below=0.0, seed=seed), GraspController.init(SETTINGS, model))
    asked = required_normal_force(model, 1.5, contacts=SETTINGS.contact).normal_force
    assert set(episode.modes()) == {"hold", "learn"}
    assert episode.plant.slipped == 0.0
    assert episode.normal[-1] == pytest.approx(asked, rel=0.02)  # 10 mN of noise of the load of 1.5 N


@pytest.mark.parametrize("moving", [1.0, 0.1])
def test_what_rests_and_is_told_to_slip_does_not_stop_the_force_from_falling(moving: float) -> None:
    """It bears what the contact bears; of a ring that slips, most moves."""
    state, normal = GraspController.init(SETTINGS), 5.0
    for frame in range(1, 200):
        few = SlipSamples(np.array([1.0 / normal]), np.array([0.05]), moving)
        state, command = GraspController.step(state, Observation(frame * FRAME, normal, 1.0, 0.0, 0.8, few))
        normal = command.normal_force
    assert normal > 4.5 if moving == 1.0 else normal < 1.5
    assert (state.learned.sampled == ()) == (moving < 1.0)


NONE_MOVES = SlipSamples(np.zeros(0), np.zeros(0), 0.0)


def relaxed(state: ControllerState, samples: SlipSamples | None, before: float = 1.0) -> float:
    """The force on 1 N at rest, from 5 N on, of which most is told to slip; ``before``: the stick ratio as it grew."""
    normal = 5.0
    for frame in range(1, 300):
        load, ratio = (0.1 * frame, before) if frame <= 10 else (1.0, 1.0 if frame < 30 else 0.3)
        seen = Observation(frame * FRAME, normal, load, 0.0, ratio, samples if ratio == 0.3 else None)
        state, command = GraspController.step(state, seen)
        normal = command.normal_force
    return normal


def test_slip_that_is_told_and_does_not_move_does_not_stop_the_force_from_falling() -> None:
    """A ring that slips moves as the force falls."""
    assert relaxed(GraspController.init(SETTINGS), NONE_MOVES) < 1.5
    assert relaxed(GraspController.init(SETTINGS), None) > 4.0


def test_friction_that_was_shown_before_the_load_rested_stops_it() -> None:
    assert relaxed(GraspController.init(SETTINGS), NONE_MOVES, before=0.3) > 4.0


def test_told_slip_is_not_doubted_where_something_is_known_or_after_an_alarm(make_model: Make) -> None:
    model = model_of(make_model, 0.25)
    unsure = GraspController.init(SETTINGS)
    assert unsure.doubts
    assert not GraspController.init(SETTINGS, model).doubts
    assert not GraspController.init(SETTINGS, materials={"rubber": model}).doubts
    alarmed, _ = GraspController.step(dataclasses.replace(unsure, mode="alarm"), Observation(FRAME, 1.0, 0.1, 0.0, 1.0))
    assert not alarmed.doubts
    assert relaxed(dataclasses.replace(unsure, doubts=False), NONE_MOVES) > 4.0


def test_a_load_that_comes_back_is_gripped_for_the_friction_that_bore_one_before() -> None:
    """And not as if nothing were known of it; what slips meanwhile would show."""
    plant = PointContact(ramp((1.5, 0.5, 0.3), (1.0, 3.0, 0.15)), sampled_below=0.0)
    episode = run(plant, GraspController.init(SETTINGS))
    borne = 1.5 / min(force for force, time in zip(episode.normal, episode.time, strict=True) if 1.0 < time < 3.0)
    assert borne > 1.5 * SETTINGS.unknown_friction
    assert plant.slipped < 1e-5
    fast = 1.25  # by how much the lead of 2.5 N that come so fast is more
    assert max(episode.normal) < 1.15 * fast * 2.5 / (BORNE * borne) < fast * 2.5 / SETTINGS.unknown_friction


def test_what_was_learnt_is_renewed_by_later_samples() -> None:
    state = GraspController.init(SETTINGS)
    for frame in range(1, 80):
        told = SlipSamples(np.full(10, 0.45 if frame < 40 else 0.43), np.full(10, 0.05))
        state, _ = GraspController.step(state, Observation(frame * FRAME, 5.0, 1.5, 0.0, 0.5, told))
        if frame == 39:
            before = state.known
    assert before is not None
    assert state.known is not None
    assert state.known.bounds(5.0)[0] == pytest.approx(before.bounds(5.0)[0] * 0.43 / 0.45, rel=1e-6)


@pytest.mark.parametrize("seed", SEEDS)
def test_samples_of_a_grasp_sharpen_what_a_model_knows_of_it(seed: int, make_model: Make) -> None:
    """As if the grasp's friction were known nearly as well as after learning it, however the grasp differs."""
    model = dataclasses.replace(model_of(make_model, 0.45), scale=0.04)
    for friction in (0.42, 0.45, 0.48):
        episode = run(PointContact(LIFT, friction=friction, seed=seed), GraspController.init(SETTINGS, model))
        assert episode.modes() == ["hold"]
        assert episode.plant.slipped == 0.0
        assert 1.0 < episode.normal[-1] / episode.least < 1.2


def test_the_sharpened_quantile_is_the_posterior_s(make_model: Make) -> None:
    """Of 100,000 contacts and their samples, those whose samples tell the same."""
    known = KnownFriction.of_model(model_of(make_model, 0.45), SETTINGS)
    low, high = known.bounds(3.0)
    mean, scatter = 0.5 * (low + high), 0.5 * (high - low) / known.deviations
    learned = LearnedFriction((0.43,) * 3, (10,) * 3)
    generator = np.random.default_rng(0)
    contacts = mean + scatter * generator.standard_normal(100_000)
    told = contacts + learned.error(SETTINGS) * 0.43 * generator.standard_normal(100_000)
    alike = contacts[abs(told - 0.43) < 2e-3]
    quantile = low * known.sharpen(learned, 3.0, SETTINGS).sharpened
    assert quantile == pytest.approx(alike.mean() - known.deviations * alike.std(), rel=0.01)


def test_what_disagrees_is_few_or_has_nothing_to_add_sharpens_nothing(make_model: Make) -> None:
    known = KnownFriction.of_model(model_of(make_model, 0.45), SETTINGS)
    for learned in (LearnedFriction((0.43,) * 2, (10,) * 2), LearnedFriction((0.3, 0.43, 0.6), (10,) * 3)):
        assert known.sharpen(learned, 3.0, SETTINGS) is known
    agreed = LearnedFriction((0.43,) * 3, (10,) * 3)
    assert known.sharpen(agreed, 0.0, SETTINGS) is known
    in_this_grasp = KnownFriction.learned(0.4, 0.45, SETTINGS.contact)
    assert in_this_grasp.sharpen(agreed, 3.0, SETTINGS) is in_this_grasp
    certain = KnownFriction.learned(0.45, 0.45, SETTINGS.contact)
    certain = dataclasses.replace(certain, of_others=True)
    assert certain.sharpen(agreed, 3.0, SETTINGS) is certain


def test_fewer_samples_do_not_replace_those_that_a_quantile_is_sharpened_by(make_model: Make) -> None:
    """Nor do single elements at rest, whose force over pressure is little: they would make it ask for ever more."""
    known = KnownFriction.of_model(model_of(make_model, 0.45), SETTINGS)
    many = known.sharpen(LearnedFriction((0.45,) * 8, (8,) * 8), 3.0, SETTINGS)
    assert many.sharpen(LearnedFriction((0.40,) * 8, (1,) * 8), 3.0, SETTINGS) is many
    more = many.sharpen(LearnedFriction((0.44,) * 8, (9,) * 8), 3.0, SETTINGS)
    assert more.sharpened < many.sharpened


@pytest.mark.parametrize("stick_ratio", [0.25, math.nan])
def test_a_load_of_all_that_the_contact_bears_is_answered_as_slip(stick_ratio: float, make_model: Make) -> None:
    """What a sliding contact bears is its friction, not the load, and a detector may still see some of it stick."""
    state = GraspController.init(SETTINGS, model_of(make_model, 0.45))
    reasons = []
    for frame in range(1, 4):
        state, command = GraspController.step(state, Observation(frame * FRAME, 2.0, 0.90, 0.0, stick_ratio))
        reasons.append(command.reason)
    assert reasons[0] != "slip"
    assert reasons[1:] == ["slip", "slip"]
    assert command.normal_force == pytest.approx(2.0 * (1.0 + SETTINGS.reflex_gain))


def test_slip_disproves_samples_that_told_of_more_friction(make_model: Make) -> None:
    state = GraspController.init(SETTINGS, model_of(make_model, 0.45))
    slipping = SlipSamples(np.full(10, 0.48), np.full(10, 0.05))
    for frame in range(1, 60):
        state, _ = GraspController.step(state, Observation(frame * FRAME, 5.0, 2.0, 0.0, 0.3, slipping))
    assert state.known is not None
    assert state.known.sharpened > 1.0
    for frame in range(60, 62):  # of 0.48, the load would leave a sixth of the contact to spare
        state, _ = GraspController.step(state, Observation(frame * FRAME, 5.0, 2.0, 0.0, 0.0))
    assert state.known is not None
    assert state.known.sharpened == 1.0
    assert state.learned.values == ()


@pytest.mark.parametrize("rate", [0.4, 0.8])
def test_the_lead_follows_loads_that_grow_slowly(rate: float) -> None:
    """Slower than the noise of the load lets tell within two frames."""
    load, generator = LoadEstimate(), np.random.default_rng(0)
    leads = []
    for frame in range(180):
        size = 0.5 + rate * frame * FRAME
        load = load.step(
            Observation(frame * FRAME, 5.0, size + 0.02 * generator.standard_normal(), 0.0), FRAME, SETTINGS
        )
        leads.append(load.lead(SETTINGS) - size)
    dead = SETTINGS.trend_floor * SETTINGS.lead_time
    assert np.mean(leads[60:]) == pytest.approx(rate * SETTINGS.lead_time - dead, abs=0.01)


@pytest.mark.parametrize(("error", "modes"), [(-0.4, ["hold"]), (0.4, ["hold", "alarm"])])
@pytest.mark.parametrize("seed", SEEDS)
def test_a_wrong_model_is_discarded_and_the_object_held(
    seed: int, error: float, modes: list[str], make_model: Make
) -> None:
    """One of too little friction gives way to what was learnt, without an alarm."""
    state = GraspController.init(SETTINGS, model_of(make_model, 0.45 * (1.0 + error)))
    episode = run(PointContact(LIFT, seed=seed), state)
    assert episode.modes()[:2] == modes
    assert episode.modes()[-1] == "hold"
    assert episode.plant.slipped < 1e-3
    assert 1.0 < episode.normal[-1] / episode.least < 1.25


def test_a_wrong_model_is_discarded_by_the_stick_ratio_alone(make_model: Make) -> None:
    state = GraspController.init(SETTINGS, model_of(make_model, 0.63))
    modes = []
    for frame in range(1, 5):
        state, command = GraspController.step(state, Observation(frame * FRAME, 5.0, 2.2, 0.0, 0.05))
        modes.append(command.mode)
    assert modes == ["hold", "hold", "hold", "alarm"]


def test_while_a_load_grows_the_stick_ratio_counts_beside_a_wrong_model(make_model: Make) -> None:
    """Without any samples, and with four tenths too much friction, the object does not slip at all."""
    state = GraspController.init(SETTINGS, model_of(make_model, 0.63))
    episode = run(PointContact(LIFT, sampled_below=0.0), state)
    assert {command.reason for command in episode.commands} >= {"stick ratio, growing load", "friction model"}
    assert episode.plant.slipped < 1e-6
    assert episode.normal[-1] > episode.least


@pytest.mark.parametrize(("sampled", "factor"), [(None, 0.2), (0.42, 0.42 * (1.0 - NORMAL_DEVIATIONS * 0.03035))])
def test_what_sticks_and_is_taken_for_slip_asks_for_no_more_than_samples_show(
    sampled: float | None, factor: float, make_model: Make
) -> None:
    """A stick ratio of 0.2 under a tenth of the normal force shows a friction of 0.11."""
    state = GraspController.init(SETTINGS, model_of(make_model, 0.45))
    told = None if sampled is None else SlipSamples(np.full(100, sampled), np.full(100, 0.05))
    state, _ = GraspController.step(state, Observation(0.0, 0.5, 0.1, 0.0, 1.0))
    for frame in range(1, 10):
        load = 0.1 + 0.05 * frame
        state, command = GraspController.step(state, Observation(frame * FRAME, 5.0, load, 0.0, 0.2, told))
    asked = load * state.load.growth(SETTINGS) / (factor * utilisation(SETTINGS.feel_stick_ratio))
    assert command.reason == "stick ratio, growing load"
    assert command.normal_force == pytest.approx(asked, rel=1e-3)


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("seed", SEEDS)
def test_a_load_that_rises_within_150_ms_is_held(seed: int, known: bool, make_model: Make) -> None:
    plant = PointContact(ramp((1.5, 0.5, 0.3), (1.0, 3.0, 0.15)), seed=seed)
    episode = run(plant, GraspController.init(SETTINGS, model_of(make_model, 0.45) if known else None))
    assert plant.slipped < 3e-3
    assert 1.0 < episode.normal[-1] / episode.least < 1.25


def test_a_force_falls_after_its_load(make_model: Make) -> None:
    plant = PointContact(ramp((1.5, 0.5, 0.3), (-1.0, 2.0, 0.3)))
    episode = run(plant, GraspController.init(SETTINGS, model_of(make_model, 0.45)), seconds=8.0)
    assert 1.0 < episode.normal[-1] / episode.least < 1.3  # 0.5 N with 10 mN of noise


@pytest.mark.parametrize("seed", SEEDS)
def test_without_a_stick_ratio_an_unknown_object_is_gripped_for_little_friction(seed: int) -> None:
    plant = PointContact(LIFT, told=lambda time: not 0.6 < time < 3.0, seed=seed)
    episode = run(plant, GraspController.init(SETTINGS), seconds=8.0)
    blind = [command for command in episode.commands if command.reason == "no stick ratio"]
    assert {command.mode for command in blind} == {"alarm"}
    before = np.searchsorted(episode.time, 3.0) - 1
    assert episode.normal[before] >= 0.98 * 1.5 / SETTINGS.unknown_friction
    assert plant.slipped < 1e-5
    assert episode.normal[-1] / episode.least < 1.25


def test_a_gap_of_frames_under_a_steady_load_changes_nothing(make_model: Make) -> None:
    state = GraspController.init(SETTINGS, model_of(make_model, 0.45))
    episode = run(PointContact(LIFT), state, seen=lambda time: not 3.0 < time < 3.5)
    after = int(np.searchsorted(episode.time, 3.25))
    assert abs(episode.commands[after].normal_force / episode.commands[after - 1].normal_force - 1.0) < 0.05
    assert episode.plant.slipped == 0.0


def test_over_a_gap_the_force_falls_no_further_than_within_a_dropout(make_model: Make) -> None:
    state = GraspController.init(SETTINGS, model_of(make_model, 0.45))
    for frame in range(1, 60):
        state, command = GraspController.step(state, Observation(frame * FRAME, 5.0, 2.0, 0.0, 0.5))
    _, after = GraspController.step(state, Observation(60.0, 5.0, 0.1, 0.0, 0.9))
    least = command.normal_force * (1.0 - SETTINGS.fall_rate * SETTINGS.dropout_time)
    assert after.normal_force == pytest.approx(least, rel=1e-12)


def test_the_force_relaxes_until_enough_slips_to_be_sampled() -> None:
    plant = PointContact(LIFT, sampled_below=0.45)
    episode = run(plant, GraspController.init(SETTINGS), seconds=8.0)
    assert episode.modes()[:3] == ["feel", "learn", "hold"]
    learning = [force for force, told in zip(episode.normal, episode.commands, strict=True) if told.mode == "learn"]
    assert learning[-1] < 0.9 * learning[0]
    assert plant.slipped < 1e-5
    assert 1.0 < episode.normal[-1] / episode.least < 1.25


@pytest.mark.parametrize("friction", [None, 0.63])
def test_no_command_jumps_at_a_change_of_mode(friction: float | None, make_model: Make) -> None:
    plant = PointContact(ramp((1.5, 0.5, 0.3), (1.0, 2.0, 0.15), (-1.5, 3.0, 0.02)), sampled_below=0.5)
    model = None if friction is None else model_of(make_model, friction)
    episode = run(plant, GraspController.init(SETTINGS, model))
    assert len(set(episode.modes())) > 1
    assert not fell_or_rose_too_fast(episode)


def test_what_no_gripper_bears_is_asked_for_up_to_its_limit(make_model: Make) -> None:
    settings = dataclasses.replace(SETTINGS, most_force=3.0)
    episode = run(PointContact(LIFT), GraspController.init(settings, model_of(make_model, 0.45)), seconds=2.0)
    assert max(command.normal_force for command in episode.commands) == 3.0
    assert episode.commands[-1].reason.endswith("more than most_force")


@pytest.mark.parametrize("slope", [0.0, -0.3])
def test_torque_is_borne_as_the_planner_has_it(slope: float, make_model: Make) -> None:
    model = model_of(make_model, 0.45, slope)
    state = GraspController.init(SETTINGS, model)
    for frame in range(1, 200):
        state, command = GraspController.step(state, Observation(frame * FRAME, 5.0, 1.2, 1e-3, 0.4))
    asked = required_normal_force(model, 1.2, contacts=SETTINGS.contact, torque=1e-3)
    assert command.normal_force == pytest.approx(asked.normal_force, rel=1e-9)


@pytest.mark.parametrize("flat", [True, False])
def test_friction_under_a_force_is_what_the_planner_goes_by_under_it(flat: bool, make_model: Make) -> None:
    """Elements of a round contact bear the cube root of its force, those of a flat one a fixed share."""
    contact, model = Contact.flat(6e-5) if flat else SETTINGS.contact, model_of(make_model, 0.45, -0.8)
    known = KnownFriction.of_model(model, dataclasses.replace(SETTINGS, contact=contact))
    for load in (0.3, 1.0, 2.0):
        grip = required_normal_force(
            model, load, contacts=contact, slip_probability=SETTINGS.slip_probability, of="element"
        )
        assert known.bounds(grip.normal_force)[0] == pytest.approx(grip.friction_coefficient, rel=1e-9)


@pytest.mark.parametrize("flat", [True, False])
def test_a_contact_s_scatter_averages_over_its_elements(flat: bool, make_model: Make) -> None:
    scales = Scales(Scale(0.02, 20.0), Scale(0.03, 50.0), Scale(0.05, 500.0))
    model = dataclasses.replace(model_of(make_model, 0.45), scales=scales)
    contact = Contact.flat(6e-5) if flat else SETTINGS.contact
    state = GraspController.init(dataclasses.replace(SETTINGS, contact=contact), model)
    for frame in range(1, 200):
        state, command = GraspController.step(state, Observation(frame * FRAME, 4.0, 1.2, 0.0, 0.4))
    of_contact, of_element = (
        required_normal_force(model, 1.2, contacts=contact, of=kind).normal_force for kind in ("contact", "element")
    )
    if flat:
        assert command.normal_force == pytest.approx(of_contact, rel=1e-9)
    else:  # counted under the least force, there are fewer of them
        assert of_contact < command.normal_force < 0.5 * (of_contact + of_element)


def test_a_step_changes_nothing_that_it_was_given() -> None:
    plant = PointContact(LIFT)
    state = GraspController.init(SETTINGS)
    for frame in range(1, 60):
        plant.advance(frame * FRAME, 4.0)
        seen = plant.observe(frame * FRAME)
        after, command = GraspController.step(state, seen)
        assert GraspController.step(state, seen)[1] == command
        state = after


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        ({"time": math.nan}, "time"),
        ({"time": 1.0}, "time"),
        ({"time": 0.5}, "time"),
        ({"time": math.inf}, "time"),
        ({"normal": -0.1}, "normal"),
        ({"normal": math.nan}, "normal"),
        ({"tangential": -1.0}, "tangential"),
        ({"tangential": math.inf}, "tangential"),
        ({"torque": math.nan}, "torque"),
        ({"stick_ratio": 1.1}, "stick_ratio"),
        ({"stick_ratio": -0.1}, "stick_ratio"),
        ({"time": "1.1"}, "time"),
        ({"normal": None}, "normal"),
        ({"tangential": True}, "tangential"),
        ({"torque": np.zeros(2)}, "torque"),
        ({"slip_samples": [(0.5, 1.0)]}, "slip_samples"),
        ({"slip_samples": SlipSamples([0.5], np.ones(1))}, "slip_samples.friction_coefficient"),  # type: ignore[arg-type]
        ({"slip_samples": SlipSamples(np.ones(2), np.ones(3))}, "slip_samples.normal_force"),
        ({"slip_samples": SlipSamples(np.array([math.nan]), np.ones(1))}, "slip_samples.friction_coefficient"),
        ({"slip_samples": SlipSamples(np.ones(1), np.array([-1.0]))}, "slip_samples.normal_force"),
    ],
)
def test_an_observation_that_cannot_be_is_refused_by_name(wrong: dict[str, Any], name: str) -> None:
    state, _ = GraspController.step(GraspController.init(SETTINGS), Observation(1.0, 1.0, 0.1, 0.0, 0.9))
    with pytest.raises(InvalidArgument) as refusal:
        GraspController.step(state, dataclasses.replace(Observation(1.1, 1.0, 0.1, 0.0, 0.9), **wrong))
    assert refusal.value.name == name
    GraspController.step(state, Observation(1.1, 1.0, 0.1, 0.0, 0.9))


def test_what_is_no_observation_at_all_is_refused() -> None:
    with pytest.raises(InvalidArgument, match="observation is None; allowed: an object of Observation"):
        GraspController.step(GraspController.init(SETTINGS), None)  # type: ignore[arg-type]
    with pytest.raises(InvalidArgument, match="state is None; allowed: an object of ControllerState"):
        GraspController.step(None, Observation(1.1, 1.0, 0.1, 0.0, 0.9))  # type: ignore[arg-type]


def test_the_contact_of_a_controller_is_one() -> None:
    with pytest.raises(InvalidArgument, match=r"^contact is Contact\(area=array.*; allowed: one contact, of one area"):
        dataclasses.replace(SETTINGS, contact=Contact.flat(np.array([6e-5, 1e-5])))


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        (("settings.toml",), "settings"),
        ((SETTINGS, "wood"), "model"),
        ((SETTINGS, None, ["wood"]), "materials"),
        ((SETTINGS, None, {"wood": 0.5}), "materials['wood']"),
    ],
)
def test_what_are_no_settings_and_no_models_are_refused_by_name(wrong: tuple[Any, ...], name: str) -> None:
    with pytest.raises(InvalidArgument) as refusal:
        GraspController.init(*wrong)
    assert refusal.value.name == name


def test_torque_on_a_contact_without_an_arm_is_refused() -> None:
    state = GraspController.init(dataclasses.replace(SETTINGS, contact=Contact(6e-5)))
    with pytest.raises(InvalidArgument, match="torque"):
        GraspController.step(state, Observation(1.0, 1.0, 0.1, 1e-3, 0.9))


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        ({"rise_rate": math.nan}, "rise_rate"),
        ({"lead_time": -1.0}, "lead_time"),
        ({"most_force": 0.5}, "least_force"),
        ({"learn_stick_ratio": 0.6}, "learn_stick_ratio"),
        ({"fall_rate": np.ones(2)}, "fall_rate"),
        ({"learn_frames": 2.5}, "learn_frames"),
        ({"reflex_frames": 0}, "reflex_frames"),
        ({"contact": 6e-5}, "contact"),
    ],
)
def test_a_setting_outside_of_its_range_is_refused_by_name(wrong: dict[str, Any], name: str) -> None:
    with pytest.raises(InvalidArgument) as refusal:
        dataclasses.replace(SETTINGS, **wrong)
    assert refusal.value.name == name


def test_frames_are_counted_in_whole_numbers_however_they_are_given() -> None:
    settings = dataclasses.replace(SETTINGS, learn_frames=8.0, reflex_frames=np.int64(3))  # type: ignore[arg-type]
    assert [(type(each), each) for each in (settings.learn_frames, settings.reflex_frames)] == [(int, 8), (int, 3)]


def test_a_setting_without_effect_is_taken_with_a_warning() -> None:
    with pytest.warns(DeprecationWarning, match="contradiction_share has no effect any more"):
        assert dataclasses.replace(SETTINGS, contradiction_share=0.1).contradiction_share == 0.1


def test_utilisation_is_cattaneo_s_and_mindlin_s() -> None:
    contact = HertzContact(0.015, 10.0, half_space(1e6, 0.0))
    for share in (0.1, 0.5, 0.9):
        stick = CattaneoMindlin(contact, 0.4, share * 4.0).stick_radius / contact.contact_radius
        assert utilisation(stick**2) == pytest.approx(share, rel=1e-12)


def test_friction_is_learnt_once_the_latest_frames_agree() -> None:
    learned = LearnedFriction()
    for value in [0.2, 0.6, 0.3, *[0.40, 0.41] * 4]:
        assert learned.known(SETTINGS) is None
        learned = learned.with_frame(value, 5, True, SETTINGS)
    known = learned.known(SETTINGS)
    assert known is not None
    low, high = known.bounds(5.0)
    assert (low + high) / 2.0 == pytest.approx(0.405, rel=1e-12)
    error = math.hypot(SETTINGS.learned_error, SETTINGS.sample_error / math.sqrt(40.0))
    assert low == pytest.approx(0.405 * (1.0 - 3.0902 * error), rel=1e-12)


def test_a_frame_teaches_by_the_number_of_its_elements() -> None:
    learned = LearnedFriction()
    for value, count in [(0.4, 12), (0.8, 1)]:
        learned = learned.with_frame(value, count, True, SETTINGS)
    assert learned.mean == pytest.approx((12 * 0.4 + 0.8) / 13, rel=1e-12)
    assert learned.error(SETTINGS) < LearnedFriction((0.4,), (1,)).error(SETTINGS)


@pytest.mark.parametrize(("count", "refuted"), [(1, False), (12, True)])
def test_samples_refute_a_model_as_soon_as_they_are_enough(count: int, refuted: bool, make_model: Make) -> None:
    """Of a fifth less friction than promised two frames with an element each tell too little, with twelve enough."""
    state = GraspController.init(SETTINGS, model_of(make_model, 0.45))
    for frame in range(1, 3):
        seen = SlipSamples(np.full(count, 0.36), np.full(count, 0.05))
        state, command = GraspController.step(state, Observation(frame * FRAME, 2.0, 0.5, 0.0, 0.5, seen))
    assert (state.known is None, command.mode == "alarm") == (refuted, refuted)


@pytest.mark.parametrize(("count", "refuted"), [(1, False), (12, True)])
def test_a_frame_is_evidence_by_the_number_of_its_elements(count: int, refuted: bool, make_model: Make) -> None:
    """Three frames of one element each refute no model."""
    state = GraspController.init(SETTINGS, model_of(make_model, 0.45))
    seen = SlipSamples(np.full(count, 0.34), np.full(count, 0.05))
    modes = []
    for frame in range(1, 4):
        state, command = GraspController.step(state, Observation(frame * FRAME, 2.0, 0.5, 0.0, 0.5, seen))
        modes.append(command.mode)
    assert ("alarm" in modes) is refuted


def test_elements_that_rest_do_not_refute_what_was_learnt() -> None:
    state = GraspController.init(SETTINGS)
    for frame in range(1, 60):
        seen = SlipSamples(np.full(10, 0.45), np.full(10, 0.05))
        state, _ = GraspController.step(state, Observation(frame * FRAME, 2.0, 0.5, 0.0, 0.5, seen))
    assert state.known is not None
    for frame in range(60, 70):
        rest = SlipSamples(np.full(20, 0.3), np.full(20, 0.05), moving=0.1)
        state, command = GraspController.step(state, Observation(frame * FRAME, 2.0, 0.5, 0.0, 0.5, rest))
        assert command.mode == "hold"


def test_more_friction_than_promised_counts_once_it_is_learnt_and_raises_no_alarm(make_model: Make) -> None:
    state = GraspController.init(SETTINGS, model_of(make_model, 0.45))
    seen = SlipSamples(np.full(12, 0.7), np.full(12, 0.05))
    for frame in range(1, SETTINGS.learn_frames + 1):
        assert state.known is not None
        assert state.known.of_others
        state, command = GraspController.step(state, Observation(frame * FRAME, 2.0, 0.5, 0.0, 0.5, seen))
        assert command.mode == "hold"
    assert state.known is not None
    assert not state.known.of_others
    assert state.known.expected(2.0) == pytest.approx(0.7, rel=1e-12)


@pytest.mark.parametrize(("load", "refuted"), [(0.3, False), (0.5, True)])
def test_samples_that_differ_are_waited_for_while_the_load_is_far_from_what_they_bear(
    load: float, refuted: bool, make_model: Make
) -> None:
    """Of 0.28 with an error of 0.012 the contact bears 0.49 N under 2 N, and 0.39 N while a third of it sticks."""
    state = GraspController.init(SETTINGS, model_of(make_model, 0.45))
    for frame in range(1, 7):
        seen = SlipSamples(np.full(25, 0.28 + 0.04 * (-1) ** frame), np.full(25, 0.05))
        state, command = GraspController.step(state, Observation(frame * FRAME, 2.0, load, 0.0, 0.5, seen))
    assert (command.mode == "alarm") is refuted


@pytest.mark.parametrize(
    ("moving", "count", "refuted"), [(0.6, 20, True), (0.1, 20, False), (0.6, 6, True), (0.6, 5, False)]
)
def test_what_moves_and_is_more_than_the_rim_refutes_a_model_whatever_the_stick_ratio_says(
    moving: float, count: int, refuted: bool, make_model: Make
) -> None:
    """A stick ratio of 0.6 under 1.4 N says that the contact bears 2.6 N, a friction of 0.52, and that the ring that
    slips is pressed with 1.26 N; a fifth of it is 0.25 N.
    """
    state = GraspController.init(SETTINGS, model_of(make_model, 0.45))
    for frame in range(1, 9):
        seen = SlipSamples(np.full(count, 0.3), np.full(count, 0.05 if count == 20 else 0.0445), moving)
        state, command = GraspController.step(state, Observation(frame * FRAME, 5.0, 1.4, 0.0, 0.6, seen))
        if command.mode == "alarm":
            break
    assert (command.mode == "alarm") is refuted


@pytest.mark.parametrize("probability", [1e-6, 1e-3, 0.5])
def test_a_model_s_scatter_is_read_off_its_quantile(probability: float, make_model: Make) -> None:
    settings = dataclasses.replace(SETTINGS, slip_probability=probability)
    known = KnownFriction.of_model(model_of(make_model, 0.45), settings)
    for friction, refuted in [(0.42, False), (0.3, True)]:
        learned = LearnedFriction((friction,), (100,))
        assert known.refuted(learned, LoadEstimate(1.4), 5.0, settings) is refuted


def test_samples_of_less_friction_than_is_borne_refute_nothing(make_model: Make) -> None:
    known = KnownFriction.of_model(model_of(make_model, 0.45), SETTINGS)
    learned = LearnedFriction((0.3,), (100,))
    assert known.refuted(learned, LoadEstimate(1.4), 5.0, SETTINGS)
    assert not known.refuted(learned, LoadEstimate(0.42 * 5.0), 5.0, SETTINGS)


def test_samples_that_the_stick_ratio_contradicts_teach_nothing() -> None:
    state = GraspController.init(SETTINGS)
    stuck = SlipSamples(np.full(5, 0.2), np.full(5, 0.05))
    for frame in range(1, 60):  # of 0.2, the load would leave nothing that sticks
        state, _ = GraspController.step(state, Observation(frame * FRAME, 5.0, 1.0, 0.0, 0.5, stuck))
    assert state.learned.values == ()


def test_every_setting_is_documented_with_its_default() -> None:
    page = (Path(__file__).parents[2] / "docs" / "control.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `(\w+)` \| ([^|]+) \|", page, re.MULTILINE))
    defaults = {entry.name: entry.default for entry in dataclasses.fields(ControlSettings)}
    for name, gain in gains().items():
        default = defaults[name]
        assert rows[name].strip() == ("needed" if default is dataclasses.MISSING else f"{default:g}"), name
        assert gain.reason


def test_the_first_touch_lasts_until_a_load_rests(make_model: Make) -> None:
    """And no command jumps when it ends."""
    settings = dataclasses.replace(SETTINGS, touch_force=2.0)
    plant = PointContact(ramp((0.4, 0.5, 0.3)))
    episode = run(plant, GraspController.init(settings, model_of(make_model, 0.45)), seconds=8.0)
    asked = np.array([command.normal_force for command in episode.commands])
    touch = int(np.argmax(asked < 2.0))
    assert 0.8 < episode.time[touch] < 1.5
    assert asked[:touch] == pytest.approx(2.0, rel=0.01)  # the load's growth hardly asks for more
    assert not fell_or_rose_too_fast(episode)
    assert 1.0 < episode.normal[-1] / episode.least < 1.3
    assert GraspController.init(dataclasses.replace(settings, touch_force=0.1)).normal_force == SETTINGS.least_force
    with pytest.raises(InvalidArgument, match="touch_force"):
        dataclasses.replace(settings, touch_force=50.0)


def test_samples_ask_for_a_force_only_while_it_is_lowered_and_once_there_are_enough() -> None:
    few = LearnedFriction(sampled=(0.5,) * (SETTINGS.learn_frames - 1))
    enough = LearnedFriction(sampled=(0.5,) * SETTINGS.learn_frames)
    asked = {}
    for mode in ("feel", "learn"):
        for learned in (few, enough):
            start = dataclasses.replace(GraspController.init(SETTINGS), mode=mode, learned=learned)
            demands = controller._demands(start, Observation(0.0, 5.0, 2.0))
            asked[mode, learned] = [each.reason for each in demands]
            assert all(math.isfinite(each.force) for each in demands)
    assert [key for key, reasons in asked.items() if "samples of slip" in reasons] == [("learn", enough)]


@pytest.mark.parametrize("mode", ["feel", "learn"])
@pytest.mark.parametrize("waits", [False, True])
def test_the_materials_ask_for_a_force_only_while_one_is_to_be_recognised(mode: str, waits: bool) -> None:
    among: Any = SimpleNamespace(waits=lambda *_: waits, borne=lambda *_: 0.9)
    state = dataclasses.replace(GraspController.init(SETTINGS), mode=mode, recognition=among)
    reasons = [each.reason for each in controller._demands(state, Observation(0.0, 5.0, 2.0))]
    is_waited_for = waits and mode == "feel"
    assert reasons.count("to be recognised") == (2 if is_waited_for else 0)
    assert ("no stick ratio" in reasons or "friction unknown" in reasons) is (mode == "feel" and not waits)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_model_s_grip_is_relaxed_to_what_the_grasp_has(seed: int, make_model: Make) -> None:
    """A grasp of more friction than most, of which nothing slips under the force that a model asks for."""
    model = model_of(make_model, 0.45)
    episode = run(
        PointContact(LIFT, friction=0.5, sampled_below=0.36, seed=seed), GraspController.init(SETTINGS, model)
    )
    assert "learn" in episode.modes()
    assert episode.plant.slipped == 0.0
    asked = required_normal_force(model, 1.5, contacts=SETTINGS.contact).normal_force
    assert episode.normal[-1] < 1.17 * episode.least < 0.95 * asked


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("seed", SEEDS)
def test_what_slides_unseen_as_its_grip_is_relaxed_is_held_by_the_friction_that_it_shows(
    seed: int, known: bool, make_model: Make
) -> None:
    """Of a detector that misses all slip."""
    state = GraspController.init(SETTINGS, model_of(make_model, 0.45) if known else None)
    episode = run(PointContact(LIFT, missed=1.0, sampled_below=0.0, seed=seed), state)
    assert 0.0 < episode.plant.slipped < 5e-3
    assert 1.0 < episode.normal[-1] / episode.least < 1.25


def test_a_slide_is_pressed_as_slip_is_in_the_frame_that_shows_it() -> None:
    """The friction that it shows asks for a tenth more, under which what moves already slides on."""
    state, normal, mode = GraspController.init(SETTINGS), 5.0, "feel"
    for frame in range(1, 300):
        load = min(1.5, 0.45 * normal)
        state, command = GraspController.step(state, Observation(frame * FRAME, normal, load, 0.0, 1.0))
        if mode == "learn" and command.mode == "hold":
            break
        normal, mode = command.normal_force, command.mode
    assert command.reason == "slip"
    assert command.normal_force == pytest.approx((1.0 + SETTINGS.reflex_gain) * normal)
    assert state.known is not None
    assert state.known.expected(5.0) == pytest.approx(0.45)


@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_a_grip_is_relaxed_no_further_than_what_discarded_a_model_bears(friction: float) -> None:
    """The detector sees nothing slip: 1.5 N under a force that falls by half a second."""
    state, normal = dataclasses.replace(GraspController.init(SETTINGS), refuted=friction), 8.0
    for frame in range(1, 300):
        state, command = GraspController.step(state, Observation(frame * FRAME, normal, 1.5, 0.0, 1.0))
        normal = command.normal_force
    assert command.mode == "learn"
    bears = friction * utilisation(SETTINGS.reflex_stick_ratio)
    assert normal == pytest.approx(1.5 / bears if friction else 8.0 * (1.0 - FRAME / 2.0) ** 287, rel=0.02)


@pytest.mark.parametrize("relaxed", [True, False])
@pytest.mark.parametrize("load", [0.5, 0.7])
def test_what_discards_a_model_leaves_the_friction_that_it_shows(load: float, relaxed: bool, make_model: Make) -> None:
    """That of the samples, 0.34, or of the load that was borne, less its noise; nothing before the load rests."""
    state, frame = GraspController.init(SETTINGS, model_of(make_model, 0.45)), 0
    seen = SlipSamples(np.full(12, 0.34), np.full(12, 0.05))
    while state.known is not None:
        frame += 1
        state = dataclasses.replace(state, mode="learn") if relaxed else state
        state, command = GraspController.step(state, Observation(frame * FRAME, 2.0, load, 0.0, 0.3, seen))
    assert command.mode == "alarm"
    assert state.refuted == pytest.approx(max(0.34, state.sticking.bore) if relaxed else 0.0, rel=1e-12)
    assert state.sticking.bore == pytest.approx(load / 2.0, rel=0.05)


@pytest.mark.parametrize(("mode", "counts"), [("hold", True), ("learn", False)])
def test_elements_at_rest_are_no_warning_while_a_grip_is_relaxed(mode: Any, counts: bool, make_model: Make) -> None:
    state = dataclasses.replace(GraspController.init(SETTINGS, model_of(make_model, 0.45)), mode=mode)
    resting = SlipSamples(np.array([0.4]), np.array([0.05]), 0.0)
    assert controller._counts(state, resting, agrees=True) == counts


def test_slip_ends_relaxing_and_is_answered_by_more_than_the_model_asks_for(make_model: Make) -> None:
    state, normal = GraspController.init(SETTINGS, model_of(make_model, 0.45)), 4.0
    for frame in range(1, 60):
        ratio = 1.0 if frame < 50 else 0.0
        state, command = GraspController.step(state, Observation(frame * FRAME, normal, 1.5, 0.0, ratio))
        normal = 3.0 if frame >= 40 else normal
        if frame == 45:
            assert command.mode == "learn"
    assert command.mode == "hold"
    assert command.reason == "slip"
    assert command.normal_force == pytest.approx((1.0 + SETTINGS.reflex_gain) * normal, rel=1e-6)
    assert state.known is not None
    assert state.known.learnt


def test_a_load_that_is_taken_away_shows_no_less_friction_than_was_borne_before(make_model: Make) -> None:
    """Taken for sliding or not: a load that comes back meets no grip for next to no friction."""
    state, normal = GraspController.init(SETTINGS, model_of(make_model, 0.45)), 4.0
    for frame in range(1, 120):
        load = 1.5 if frame < 60 else max(1.5 - 0.1 * (frame - 60), 0.3)
        state, command = GraspController.step(state, Observation(frame * FRAME, normal, load, 0.0, 0.5))
        normal = command.normal_force
    assert state.known is not None
    assert state.known.expected(5.0) > 1.5 / 4.0


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize(("pressed", "first"), [(8.0, 8.0), (0.2, 0.5), (50.0, 40.0)])
def test_a_controller_takes_over_a_grip_as_hard_as_it_is(
    pressed: float, first: float, known: bool, make_model: Make
) -> None:
    """It does not let go of what is held, to grip it anew."""
    state = GraspController.init(SETTINGS, model_of(make_model, 0.45) if known else None)
    _, command = GraspController.step(state, Observation(0.0, pressed, 0.05, 0.0, 1.0))
    assert command.normal_force == first
