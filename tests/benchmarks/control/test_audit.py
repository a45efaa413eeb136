import numpy as np
import pytest

from benchmarks.control import elements as control_elements
from benchmarks.control.audit import ONE_FINGER, Repeat, row
from benchmarks.control.elements import ElementsState
from slipcore.contact import reduced
from slipcore.contact.effects import SensorSampling
from slipcore.contact.reduced import GRAVITY, Load, World
from slipcore.errors import InvalidInput

FORCE, FRICTION, FRAME = 5.0, 0.4, 1.0 / 60.0
HEAVY = 1.25 * FRICTION * FORCE / GRAVITY


def world_of(fingers: int = 1) -> World:
    return World(friction=np.full((fingers, 12, 12), FRICTION), sampling=SensorSampling((12, 12), 1e-3, 60.0))


def after(world: World, load: Load, frames: int, force: float = FORCE) -> ElementsState:
    state = control_elements.init(world, FORCE)
    for _ in range(frames):
        state = control_elements.step(world, state, np.array([force]), load, FRAME)
    return state


def test_an_object_at_rest_is_that_of_the_reduced_world() -> None:
    world, load = world_of(), Load(0.7 * FRICTION * FORCE / GRAVITY)
    state, same = after(world, load, 20), reduced.init(world, FORCE)
    for _ in range(20):
        same = reduced.step(world, same, FORCE, load, FRAME)
    seen, expected = control_elements.observe(world, state), reduced.observe(world, same)
    assert seen.time == pytest.approx(expected.time)
    assert seen.force is not None
    assert expected.force is not None
    assert seen.force.sum(axis=(0, 1)) == pytest.approx([0.7 * FRICTION * FORCE, 0.0, -FORCE], abs=1e-3)
    for one, other, share in ((seen.displacement, expected.displacement, 0.06), (seen.force, expected.force, 0.2)):
        assert np.linalg.norm(one - other) < share * np.linalg.norm(other)
    np.testing.assert_array_equal(seen.normal, expected.normal)
    assert state.slipped[0] < 1e-8


def test_what_friction_does_not_carry_falls_with_what_is_left_of_its_weight() -> None:
    world = world_of()
    before = after(world, Load(HEAVY), 8)
    state = before
    for _ in range(6):
        state = control_elements.step(world, state, np.array([FORCE]), Load(HEAVY), FRAME)
    assert state.contact.velocity[0] - before.contact.velocity[0] == pytest.approx(0.2 * GRAVITY * 6 * FRAME, rel=1e-3)
    assert control_elements.stick_ratio(world, state) == 0.0
    assert state.slipped[0] > 3e-3


def test_what_slides_is_caught_by_a_harder_grip() -> None:
    world = world_of()
    state = after(world, Load(HEAVY), 6)
    for _ in range(20):
        state = control_elements.step(world, state, np.array([2.0 * FORCE]), Load(HEAVY), FRAME)
    slipped = state.slipped[0]
    assert not state.contact.velocity.any()
    assert state.time == pytest.approx(26 * FRAME)
    state = control_elements.step(world, state, np.array([2.0 * FORCE]), Load(HEAVY), FRAME)
    assert state.slipped[0] == pytest.approx(slipped, abs=1e-7)
    assert control_elements.observe(world, state).force[..., 0].sum() == pytest.approx(HEAVY * GRAVITY, rel=1e-3)


def test_two_fingers_are_refused() -> None:
    with pytest.raises(InvalidInput, match="one finger"):
        control_elements.init(world_of(2), FORCE)


def test_episodes_are_alike_that_are_both_held_or_both_lost() -> None:
    held, lost = 1e-4, 9e-3

    def made(slipped: tuple[float, float, float], final: tuple[float, float, float]) -> Repeat:
        return Repeat("task", "x", 0, slipped, final, (1.0, 1.0, 1.0))

    found = [
        made((held, held, held), (2.0, 2.1, 2.0)),
        made((held, held, lost), (2.0, 2.4, 2.0)),
        made((lost, lost, lost), (2.0, 5.0, 2.0)),
        made((held, lost, held), (2.0, 2.0, 2.0)),
    ]
    alike, both_lost, close, middle, least, most = row(found, 1)
    assert (alike, both_lost, close) == ("3/4", 1, "1/2")
    assert (middle, least, most) == pytest.approx((1.125, 1.05, 1.2))
    assert row(found, 2)[:3] == ["3/4", 1, "2/2"]


def test_all_tasks_of_one_finger_are_repeated() -> None:
    assert len(ONE_FINGER) == 17
