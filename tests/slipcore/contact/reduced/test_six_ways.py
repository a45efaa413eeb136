"""An object that moves and turns in all six ways between two fingers, and contacts under a measured pressure."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from slipcore.contact import Finger, reduced
from slipcore.contact.effects import SensorSampling
from slipcore.contact.reduced import Load, World, WorldState
from slipcore.contact.reduced.kernel import pressures
from slipcore.errors import InvalidInput

FORCE, FRICTION, MASS, FRAME = 10.0, 0.4, 0.3, 1.0 / 60.0
WIDTH = 0.04


def between(**parts: Any) -> World:
    """Two fingers with an object of 4 cm between them."""
    given = {"friction": np.full((2, 20, 20), FRICTION), "finger": Finger(poisson_ratio=0.49), "width": WIDTH}
    return World(**(given | parts))


def at_rest(world: World, load: Load, frames: int = 90) -> WorldState:
    """The world after the load has come onto it within half of the frames."""
    state = reduced.init(world, FORCE)
    for frame in range(1, frames + 1):
        share = min(2.0 * frame / frames, 1.0)
        part = Load(
            load.mass,
            load.supports,
            (share * load.force[0], share * load.force[1]),
            share * load.moment,
            share * load.across,
            (share * load.tilting[0], share * load.tilting[1]),
        )
        state = reduced.step(world, state, FORCE, part, FRAME)
    return state


def test_what_acts_along_the_surface_moves_it_as_without_a_width() -> None:
    load = Load(MASS, 1.0, (2.0, -1.0), 2e-3)
    free, guided = (at_rest(between(width=width), load) for width in (WIDTH, None))
    np.testing.assert_allclose(free.pose[:3], guided.pose[:3], rtol=1e-4)  # sweeps do not go alike over both fingers
    np.testing.assert_allclose(free.pose[3:], 0.0, atol=1e-4 * free.pose[2])
    assert not guided.pose[3:].any()


def test_a_force_across_presses_one_finger_and_relieves_the_other() -> None:
    """By what Hertz's stiffness 2aE* makes of the way: half of it each."""
    world = between()
    contact = world.contact(FORCE)
    state = at_rest(world, Load(MASS, 1.0, across=0.6))
    expected = 0.3 / (2.0 * contact.contact_radius * contact.compliance.contact_modulus)
    assert state.pose[3] == pytest.approx(expected, rel=1e-3)
    borne = [-reduced.observe(world, state, finger).force[..., 2].sum() for finger in range(2)]  # type: ignore[index]
    np.testing.assert_allclose(borne, [FORCE - 0.3, FORCE + 0.3], rtol=1e-3)


@pytest.mark.parametrize("about", [0, 1])
def test_a_tilt_is_as_stiff_as_shear_at_half_the_width_and_a_ball_that_rolls(about: int) -> None:
    world, moment = between(), 2e-3
    sheared = at_rest(world, Load(MASS, 1.0, (0.4, 0.0) if about == 1 else (0.0, 0.4))).pose[1 - about]
    half, ball = 0.5 * WIDTH, world.finger.radius
    stiffness = 0.4 / sheared * half**2 + 2.0 * FORCE * (half + ball)
    tilting = (moment, 0.0) if about == 0 else (0.0, moment)
    state = at_rest(world, Load(MASS, 1.0, tilting=tilting), 240)
    assert state.pose[4 + about] == pytest.approx(moment / stiffness, rel=0.05)  # of shear, what slips at the rim
    assert abs(np.delete(state.pose, [4 + about])).max() < 1e-6


def test_the_contact_rolls_on_the_ball_as_the_object_tilts() -> None:
    world = between()
    state = at_rest(world, Load(MASS, 1.0, tilting=(0.02, -0.03)), 240)
    for finger, side in enumerate((1.0, -1.0)):
        force = reduced.observe(world, state, finger).force
        assert force is not None
        middle = np.tensordot(force[..., 2], world.position[..., :2], 2) / force[..., 2].sum()
        moved = world.finger.radius * np.array([side * state.pose[5], -state.pose[4]])
        np.testing.assert_allclose(middle, moved, atol=0.02 * world.sampling.pitch)
        assert abs(moved).min() > 0.05 * world.sampling.pitch


def test_fingers_bear_what_acts_on_an_object_at_rest() -> None:
    """Forces and moments about its centre, from what both sensors see."""
    world = between(friction=np.stack([np.full((20, 20), 0.4), np.full((20, 20), 0.3)]))
    load = Load(0.2, 0.0, (0.3, -0.8), 3e-3, 0.5, (0.004, -0.006))
    state = at_rest(world, load, 240)
    total = np.zeros(6)
    for finger, side in enumerate((1.0, -1.0)):
        turned = np.array([1.0, side, side])
        seen = reduced.observe(world, state, finger).force
        assert seen is not None
        roll, pitch, _ = turned * [state.pose[4], state.pose[5], 0.0]
        place = world.position - [0.0, 0.0, 0.5 * WIDTH]
        on_object = -np.concatenate([seen[..., :2], np.zeros((20, 20, 1))], axis=-1)
        on_object += -seen[..., 2:] * [pitch, -roll, 1.0]  # pressure acts along the tilted surface's normal
        moment = np.cross(place, on_object).sum(axis=(0, 1))
        total += np.concatenate([turned * on_object.sum(axis=(0, 1)), turned * moment])
    asked = load.in_six()[[0, 1, 3, 4, 5, 2]]
    np.testing.assert_allclose(total[:3], -asked[:3], atol=2e-3)
    np.testing.assert_allclose(total[3:], -asked[3:], atol=2e-4)


def test_an_object_that_no_finger_holds_falls_and_turns() -> None:
    world = between()
    state = reduced.init(world, 1e-15)
    load = Load(MASS, 0.0, across=0.1, tilting=(1e-4, 0.0))
    for _ in range(6):
        state = reduced.step(world, state, 0.0, load, FRAME)
    inertia = MASS * world.gyration**2
    gained = 0.1 * (5.0 + 0.5 * (1.0 + 1.0 / 17.0)) / 6.0  # the load comes within the first frame
    expected = np.array([reduced.GRAVITY, 0.0, 0.0, 0.1 / MASS, 1e-4 / inertia, 0.0]) * gained
    np.testing.assert_allclose(state.velocity, expected, rtol=1e-3, atol=1e-6)


def test_hertz_s_own_pressure_as_a_measured_one_is_borne_alike() -> None:
    plain = between(width=None, friction=np.full((1, 20, 20), FRICTION))
    pressure = pressures(reduced.init(plain, FORCE).pad, FORCE).reshape(20, 20)
    measured = dataclasses.replace(plain, pressure=3.0 * pressure)
    load = Load(MASS, 1.0, (2.5, 0.5), 2e-3)
    one, other = at_rest(plain, load), at_rest(measured, load)
    np.testing.assert_allclose(other.pose, one.pose, rtol=1e-3)  # rounding decides which bristles wait
    assert np.linalg.norm(other.force - one.force) < 1e-3 * np.linalg.norm(one.force)
    assert reduced.stick_ratio(measured, other) == pytest.approx(reduced.stick_ratio(plain, one), abs=0.01)
    seen, exact = (reduced.observe(*each).displacement[..., 2] for each in ((measured, other), (plain, one)))
    assert np.linalg.norm(seen - exact) < 0.02 * np.linalg.norm(exact)  # its pressure is even over an element


def flat_pad() -> World:
    """A flat finger under an even pressure on a disk of 5 mm."""
    sampling = SensorSampling((20, 20), 0.6e-3)
    world = World(friction=np.full((1, 20, 20), FRICTION), sampling=sampling)
    disk = np.hypot(*np.moveaxis(world.position[..., :2], -1, 0)) < 5e-3
    return dataclasses.replace(world, pressure=disk.astype(float), finger=Finger(radius=math.inf))


def test_a_flat_contact_has_the_same_area_under_any_force_and_slips_beyond_friction() -> None:
    world = flat_pad()
    state = reduced.init(world, FORCE)
    area = []
    for frame in range(1, 61):
        load = Load(MASS, 1.0, (1.2 * FRICTION * FORCE * min(frame / 40, 1.0), 0.0))
        state = reduced.step(world, state, FORCE, load, FRAME)
        area.append(int((reduced.observe(world, state).force[..., 2] < 0.0).sum()))  # type: ignore[index]
    assert set(area) == {int(world.pressure.sum())}  # type: ignore[union-attr]
    assert state.force[0].sum(axis=(0, 1))[0] == pytest.approx(FRICTION * FORCE, rel=1e-9)
    assert reduced.stick_ratio(world, state) == 0.0


def test_a_flat_contact_bears_the_twist_of_its_measured_pressure() -> None:
    """μ Σ p r at most, as of a contact of the client that is told by the same map."""
    world = flat_pad()
    radius = np.hypot(*np.moveaxis(world.position[..., :2], -1, 0))
    most = FRICTION * FORCE * float((world.pressure * radius).sum() / world.pressure.sum())  # type: ignore[operator, union-attr]
    state = reduced.init(world, FORCE)
    for frame in range(1, 61):
        load = Load(MASS, 1.0, (0.0, 0.0), 1.3 * most * min(frame / 40, 1.0))
        state = reduced.step(world, state, FORCE, load, FRAME)
    x, y = np.moveaxis(world.position[..., :2], -1, 0)
    borne = float((x * state.force[0, ..., 1] - y * state.force[0, ..., 0]).sum())
    assert borne == pytest.approx(most, rel=0.01)


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        ({"width": 0.0}, "width"),
        ({"width": math.nan}, "width"),
        ({"width": WIDTH, "friction": np.full((1, 20, 20), 0.4)}, "width"),
        ({"width": WIDTH, "pressure": np.ones((20, 20))}, "width"),
        ({"width": None, "pressure": np.ones((3, 3))}, "pressure"),
        ({"width": None, "pressure": np.zeros((20, 20))}, "pressure"),
        ({"width": None, "pressure": -np.ones((20, 20))}, "pressure"),
        ({"width": None, "pressure": np.full((20, 20), math.nan)}, "pressure"),
        ({"width": None, "finger": Finger(radius=math.inf)}, "finger"),
        ({"width": None, "finger": Finger(radius=math.inf, thickness=1e-3), "pressure": np.ones((20, 20))}, "finger"),
    ],
)
def test_a_world_that_cannot_be_is_refused(wrong: dict[str, Any], name: str) -> None:
    with pytest.raises(InvalidInput, match=name):
        between(**wrong)


def test_a_mass_that_the_contact_tilts_too_fast_is_refused() -> None:
    reduced.step(between(width=None), reduced.init(between(width=None), FORCE), FORCE, Load(0.06, 1.0), FRAME)
    with pytest.raises(InvalidInput, match="mass"):
        reduced.step(between(width=0.3), reduced.init(between(width=0.3), FORCE), FORCE, Load(0.06, 1.0), FRAME)
    for name, load in (("across", {"across": math.inf}), ("tilting", {"tilting": (0.0, math.nan)})):
        with pytest.raises(InvalidInput, match=name):
            Load(MASS, **load)  # type: ignore[arg-type]
