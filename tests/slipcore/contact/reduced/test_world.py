import math
import pickle
from typing import Any

import numpy as np
import pytest

from slipcore import SlipDetector
from slipcore.contact import Finger, Press, Scene, reduced, simulate
from slipcore.contact.effects import SensorSampling, TangentialLoad
from slipcore.contact.reduced import GRAVITY, Load, World, WorldState
from slipcore.contact.reference import CattaneoMindlin, MindlinDeresiewicz, ReissnerSagoci
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray

FORCE, FRICTION, MASS = 10.0, 0.4, 0.3
SLIDING = FRICTION * FORCE
FRAME = 1.0 / 30.0


def world_of(fingers: int = 1, friction: float | FloatArray = FRICTION, poisson: float = 0.0, **parts: Any) -> World:
    points = parts.get("sampling", SensorSampling()).points
    field = np.broadcast_to(friction, (fingers, *points)).copy()
    return World(friction=field, finger=Finger(poisson_ratio=poisson), **parts)


def pulled(world: World, force: float, steps: int = 45, moment: float = 0.0) -> WorldState:
    """The world after ``force`` N on each finger has come onto it evenly, and a rest of a third of that."""
    state = reduced.init(world, FORCE)
    fingers = len(world.friction)
    for step in range(1, steps * 4 // 3):
        share = fingers * min(step / steps, 1.0)
        load = Load(MASS, 1.0, (share * force, 0.0), share * moment)
        state = reduced.step(world, state, FORCE, load, FRAME)
    return state


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_the_object_moves_as_cattaneo_and_mindlin_have_it(share: float) -> None:
    world = world_of()
    exact = CattaneoMindlin(world.contact(FORCE), FRICTION, share * SLIDING)
    moved = pulled(world, share * SLIDING).pose
    assert moved[0] == pytest.approx(exact.rigid_displacement, rel=0.04)  # the elements' area is 5 % off: 1/√0.95
    assert abs(moved[1:]).max() < 1e-5 * moved[0] / world.sampling.pitch


@pytest.mark.parametrize("share", [0.25, 0.5, 0.75, 0.95])
def test_the_stick_radius_is_cattaneo_s_and_mindlin_s(share: float) -> None:
    world = world_of()
    contact = world.contact(FORCE)
    exact = CattaneoMindlin(contact, FRICTION, share * SLIDING).stick_radius
    found = contact.contact_radius * math.sqrt(reduced.stick_ratio(world, pulled(world, share * SLIDING)))
    assert abs(found - exact) < 0.5 * world.sampling.pitch  # no closer than half an element can a front be told


def test_the_stick_ratio_converges_with_the_grid() -> None:
    exact = CattaneoMindlin(world_of().contact(FORCE), FRICTION, 0.5 * SLIDING)
    ratio = (exact.stick_radius / exact.contact.contact_radius) ** 2
    errors = []
    for points, pitch, sweeps in ((10, 1.2e-3, 3), (20, 0.6e-3, 6)):
        world = world_of(sampling=SensorSampling((points, points), pitch), sweeps=sweeps)
        errors.append(abs(reduced.stick_ratio(world, pulled(world, 0.5 * SLIDING)) - ratio))
    assert errors[1] < 0.7 * errors[0]
    assert errors[1] < 0.06


def test_a_twist_is_as_stiff_as_reissner_s_and_sagoci_s() -> None:
    world = world_of(gyration=3e-3)  # so that it comes to rest soon
    contact = world.contact(FORCE)
    moment = 0.02 * FRICTION * FORCE * contact.contact_radius
    state = pulled(world, 0.0, moment=moment)
    touching = int((state.force[0] != 0.0).any(axis=-1).sum())
    radius = math.sqrt(
        touching * world.element_area / math.pi
    )  # of the elements: 2.4 % off, and that cubed in stiffness
    exact = ReissnerSagoci(radius, contact.compliance.shear, moment).twist
    assert state.pose[2] == pytest.approx(exact, rel=0.08)  # its traction has no bound at the rim, which slips


def test_all_sticks_while_the_normal_force_rises_and_what_slipped_stays_where_it_is() -> None:
    world = world_of()
    state = pulled(world, 0.7 * SLIDING)
    load = Load(MASS, 1.0, (0.7 * SLIDING, 0.0))
    risen = state
    for _ in range(30):
        risen = reduced.step(world, risen, 1.5 * FORCE, load, FRAME)
    assert reduced.stick_ratio(world, state) < 0.6
    assert reduced.stick_ratio(world, risen) == 1.0
    assert risen.pose[0] == pytest.approx(state.pose[0], rel=0.02)  # Mindlin and Deresiewicz: frozen


def test_a_normal_force_that_falls_leaves_what_a_load_leaves() -> None:
    world = world_of()
    state = pulled(world, 0.4 * SLIDING)
    for step in range(60):
        command = FORCE * (1.0 - 0.4 * min(step / 45, 1.0))
        state = reduced.step(world, state, command, Load(MASS, 1.0, (0.4 * SLIDING, 0.0)), FRAME)
    contact = world.contact(0.6 * FORCE)
    exact = CattaneoMindlin(contact, FRICTION, 0.4 * SLIDING).stick_radius
    found = contact.contact_radius * math.sqrt(reduced.stick_ratio(world, state))
    assert abs(found - exact) < 0.5 * world.sampling.pitch


def test_a_load_that_goes_back_slowly_goes_back_as_mindlin_and_deresiewicz_have_it() -> None:
    """What changes by less than a step takes notice of may wait, but is not lost."""
    world = world_of()
    state, exact = pulled(world, 0.8 * SLIDING), MindlinDeresiewicz(world.contact(FORCE), FRICTION)
    exact = exact.load(FORCE, 0.8 * SLIDING)
    for step in range(1, 181):
        force = SLIDING * (0.8 - 0.6 * step / 180)
        state = reduced.step(world, state, FORCE, Load(MASS, 1.0, (force, 0.0)), FRAME)
    exact = exact.load(FORCE, 0.2 * SLIDING)
    assert state.pose[0] == pytest.approx(exact.rigid_displacement, rel=0.05)
    assert (
        exact.rigid_displacement
        > 1.5 * CattaneoMindlin(world.contact(FORCE), FRICTION, 0.2 * SLIDING).rigid_displacement
    )
    shear, pressing = np.hypot(*np.moveaxis(state.force[0], -1, 0)), -reduced.observe(world, state).force[..., 2]
    assert (shear <= FRICTION * pressing * (1.0 + 1e-12)).all()


def test_the_surface_is_pressed_in_as_hertz_has_it() -> None:
    world = world_of()
    radius = np.hypot(*np.moveaxis(world.position[..., :2], -1, 0))
    seen = reduced.observe(world, reduced.init(world, FORCE)).displacement[..., 2]
    np.testing.assert_allclose(-seen, world.contact(FORCE).normal_displacement(radius), rtol=1e-12)


def test_the_boundary_elements_see_the_same() -> None:
    sampling = SensorSampling(frame_rate=1.0 / FRAME)
    scene = Scene(
        "pulled",
        effects=(TangentialLoad((0.7 * SLIDING, 0.0), start=0.2, duration=1.5), sampling),
        finger=Finger(poisson_ratio=0.49),
        friction=FRICTION,
        press=Press(FORCE, 0.2),
        duration=2.0,
    )
    log = simulate(scene, accuracy=0.05, tier="boundary elements")
    world = world_of(poisson=0.49)
    state = pulled(world, 0.7 * SLIDING)
    seen = reduced.observe(world, state)
    assert log.truth is not None
    assert seen.force is not None
    assert log.force is not None
    assert log.normal is not None
    np.testing.assert_array_equal(seen.normal, log.normal[-1])
    moved, force = log.displacement[-1, ..., :2], log.force[-1]
    assert np.linalg.norm(seen.displacement[..., :2] - moved) < 0.02 * np.linalg.norm(moved)
    assert np.linalg.norm(seen.force - force) < 0.1 * np.linalg.norm(force)  # elements at the rim are cut by it
    assert reduced.stick_ratio(world, state) == pytest.approx(log.truth.stick_ratio[-1], abs=0.07)


@pytest.mark.parametrize("fingers", [1, 2])
def test_a_load_at_rest_is_borne_by_the_elements(fingers: int) -> None:
    world = world_of(fingers)
    state = pulled(world, 0.6 * SLIDING)
    assert state.force.sum(axis=(1, 2)) == pytest.approx(np.array([[0.6 * SLIDING, 0.0]] * fingers), abs=1e-3)
    assert abs(state.velocity).max() < 1e-5
    assert state.slipped.max() == 0.0


def test_beyond_friction_the_object_falls_with_what_is_left_of_its_weight() -> None:
    world = world_of(2)
    mass = 2.0 * SLIDING / GRAVITY * 1.25
    state = reduced.init(world, FORCE)
    for _ in range(18):
        state = reduced.step(world, state, FORCE, Load(mass), FRAME)
    before = state
    for _ in range(6):
        state = reduced.step(world, state, FORCE, Load(mass), FRAME)
    expected = (GRAVITY - 2.0 * SLIDING / mass) * 6 * FRAME
    assert state.velocity[0] - before.velocity[0] == pytest.approx(expected, rel=1e-6)
    assert reduced.stick_ratio(world, state) == 0.0
    assert (state.slipped > 1e-3).all()


def test_the_gripper_lags() -> None:
    world = world_of()
    state = reduced.step(world, reduced.init(world, 5.0), 8.0, Load(MASS, 1.0), world.gripper_lag)
    assert state.normal_force[0] == pytest.approx(8.0 - 3.0 * math.exp(-1.0), rel=1e-12)


def test_fingers_that_face_each_other_bear_a_twist_alike_and_the_slippery_one_slips_first() -> None:
    alike = pulled(world_of(2), 0.3 * SLIDING, moment=2e-3)
    np.testing.assert_allclose(
        alike.force[0, ..., 0], alike.force[1, :, ::-1, 0], rtol=0.0, atol=4e-3
    )  # three sweeps leave 3 %
    friction = np.stack([np.full((20, 20), 0.4), np.full((20, 20), 0.3)])
    state = pulled(world := world_of(2, friction), 0.7 * SLIDING)
    assert reduced.stick_ratio(world, state, 1) < reduced.stick_ratio(world, state, 0) - 0.1


def test_a_detector_reads_what_the_sensor_sees() -> None:
    world = world_of(poisson=0.49, marker_noise=1e-6, force_noise=2e-3)
    generator = np.random.default_rng(3)
    detector = SlipDetector(world.position, world.element_area)
    state, errors = reduced.init(world, FORCE), []
    for step in range(1, 61):
        load = Load(MASS, 1.0, (0.9 * SLIDING * min(step / 45, 1.0), 0.0))
        state = reduced.step(world, state, FORCE, load, FRAME)
        seen = reduced.observe(world, state, generator=generator)
        found = detector.step(seen.time, seen.displacement, seen.force)
        errors.append(found.stick_ratio - reduced.stick_ratio(world, state))
    assert np.sqrt(np.mean(np.square(errors))) < 0.12  # its error on unseen scenes is .05 to .08


def test_a_step_changes_nothing_that_it_was_given_and_a_state_can_be_kept() -> None:
    world = world_of(2)
    state = pulled(world, 0.5 * SLIDING, 5)
    kept = pickle.loads(pickle.dumps(state))
    load = Load(MASS, 0.0)
    after = reduced.step(world, state, 8.0, load, FRAME)
    again = reduced.step(world, kept, 8.0, load, FRAME)
    for one, other in zip(after[1:], again[1:], strict=True):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(state.force, kept.force)


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        ({"friction": np.full((1, 3, 3), 0.4)}, "friction"),
        ({"friction": np.full((3, 20, 20), 0.4)}, "friction"),
        ({"friction": np.full((1, 20, 20), -0.4)}, "friction"),
        ({"friction": 0.4}, "friction is 0.4; allowed: an array"),
        ({"friction": None}, "friction is None"),
        ({"pressure": [[1.0]]}, r"pressure is \[\[1.0\]\]; allowed: an array"),
        ({"gripper_lag": None}, "gripper_lag is None"),
        ({"finger": Finger(radius=math.inf)}, "finger"),
        ({"finger": Finger(thickness=5e-3)}, "finger"),
        ({"gripper_lag": 0.0}, "gripper_lag"),
        ({"marker_noise": math.nan}, "marker_noise"),
    ],
)
def test_a_world_that_cannot_be_is_refused_by_name(wrong: dict[str, Any], name: str) -> None:
    with pytest.raises(InvalidInput, match=name):
        World(**({"friction": np.full((1, 20, 20), 0.4)} | wrong))


def test_a_step_that_cannot_be_is_refused_by_name() -> None:
    world = world_of()
    state = reduced.init(world, FORCE)
    for command, mass, duration, name in (
        (-1.0, MASS, FRAME, "command"),
        (math.nan, MASS, FRAME, "command"),
        (1.0, 0.01, FRAME, "mass"),
        (1.0, MASS, 0.0, "duration"),
    ):
        with pytest.raises(InvalidInput, match=name):
            reduced.step(world, state, command, Load(mass, 1.0), duration)
    with pytest.raises(InvalidInput, match="supports"):
        Load(MASS, 1.5)


def test_a_world_is_observed_as_it_is_unless_its_sensor_has_noise() -> None:
    seen, noisy = [], []
    for seed in range(2):
        generator = np.random.default_rng(seed)
        plain, world = world_of(), world_of(marker_noise=1e-6, force_noise=2e-3)
        seen.append(reduced.observe(plain, reduced.init(plain, FORCE), generator=generator))
        noisy.append(reduced.observe(world, reduced.init(world, FORCE), generator=generator))
    for name in ("displacement", "force"):
        np.testing.assert_array_equal(getattr(seen[0], name), getattr(seen[1], name))
        assert (getattr(noisy[0], name) != getattr(noisy[1], name)).any()
