"""Whether forces without normals turn with the surface, on a pit whose pressure and friction are made by hand."""

from dataclasses import replace

import numpy as np
import pytest

from slipcore import GraspLog, SlipDetector, collect_samples, detect_slip
from slipcore.detection.shared.lasting_noise import TURNING
from slipcore.frames import unit
from slipcore.surface.log_normals import normals_at_rest, normals_of, normals_of_shape, with_normals
from slipcore.surface.turning import SUMS
from tests.slipcore.conftest import grid

REST, SHAPE = 0.0, 1.0
FRICTION = 0.5
PLACE = grid(15, 15)
ACROSS = 4e-3, 15e-3
"""Radii of the contact and of the ball, m."""


def pit(depth: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Displacement [n, m, 3] m under a ball, and Hertz's forces [n, m] N, by a share of ``depth``."""
    contact, ball = ACROSS
    square = (PLACE**2).sum(axis=-1) / contact**2
    moved = np.zeros(PLACE.shape)
    moved[..., 2] = -0.5 * contact**2 / ball * np.maximum(2.0 - square, 0.3)
    return depth * moved, depth * 0.1 * np.sqrt(np.maximum(1.0 - square, 0.0))


def grasp(turned: float, coupling: float = 0.0, load: float = 0.9, torque: float = 0.0, noise: float = 0.0) -> GraspLog:
    """Pressed and then loaded to a share of friction; most of what keeps the gel in shape gives way."""
    rng, time = np.random.default_rng(0), np.arange(60) / 30.0
    displacement, force = np.zeros((60, *PLACE.shape)), np.zeros((60, *PLACE.shape))
    arm = np.stack([-PLACE[..., 1], PLACE[..., 0], 0.0 * PLACE[..., 0]], axis=-1) / ACROSS[0]
    for k, t in enumerate(time):
        moved, p = pit(min(t / 0.5, 1.0))
        grows = load * np.clip((t - 0.6) / 1.2, 0.0, 1.0)
        inward = np.array([0.0, 0.0, 1.0]) - normals_of_shape(PLACE, moved[None])[0]
        share = turned + coupling * (1.0 - 0.7 * grows)
        sideways = share * inward + FRICTION * grows * ((1.0 - torque) * np.array([0.8, 0.6, 0.0]) + torque * arm)
        displacement[k], force[k] = moved, p[..., None] * (sideways - np.array([0.0, 0.0, 1.0]))
    displacement += 1e2 * noise * 1e-5 * rng.standard_normal(displacement.shape)
    return GraspLog(time, PLACE, displacement, 1e-6, force=force + noise * rng.standard_normal(force.shape))


def turn(log: GraspLog) -> bool:
    """Whether the log's forces are split at the normals of its shape."""
    found = normals_of(log)
    at_rest = np.array_equal(found, np.broadcast_to(normals_at_rest(log.position), found.shape))
    assert at_rest or np.array_equal(found, normals_of_shape(log.position, log.displacement))
    return not at_rest


@pytest.mark.parametrize("noise", [0.0, 2e-3])
@pytest.mark.parametrize("torque", [0.0, 1.0])
@pytest.mark.parametrize("coupling", [-1.0, -0.5, 0.0, 0.5, 0.9])
@pytest.mark.parametrize("turned", [REST, SHAPE])
def test_forces_that_turn_are_distinguished_from_friction_that_keeps_the_gel_in_shape(
    turned: float, coupling: float, torque: float, noise: float
) -> None:
    assert turn(grasp(turned, coupling, torque=torque, noise=noise)) == (turned == SHAPE)


@pytest.mark.parametrize(("turned", "coupling"), [(REST, -1.0), (REST, 0.6), (SHAPE, 0.0), (SHAPE, 0.3)])
def test_a_press_without_load_leaves_forces_at_rest_unless_they_turn_wholly(turned: float, coupling: float) -> None:
    assert turn(grasp(turned, coupling, load=0.0)) == (turned == SHAPE)


def test_noise_alone_leaves_forces_at_rest() -> None:
    quiet = grasp(REST)
    for seed in range(20):
        rng = np.random.default_rng(seed)
        force, moved = (size * rng.standard_normal(quiet.displacement.shape) for size in (2e-3, 1e-5))
        assert not turn(replace(quiet, displacement=moved, force=force))


def test_where_nothing_is_pressed_in_nothing_turns() -> None:
    log = grasp(SHAPE)
    assert not turn(replace(log, displacement=0.0 * log.displacement))


@pytest.mark.parametrize("turned", [REST, SHAPE])
def test_a_lattice_that_is_curved_at_rest_has_normals_of_its_own(turned: float) -> None:
    """A dome whose forces are pressures, at the one surface or the other."""
    flat = grasp(REST, load=0.0)
    position = PLACE - (PLACE**2).sum(axis=-1, keepdims=True) / 60e-3 * np.array([0.0, 0.0, 1.0])
    shape = normals_of_shape(position, flat.displacement)
    at_rest = normals_at_rest(position)
    assert flat.force is not None
    log = replace(flat, position=position, force=flat.force[..., 2:] * (shape if turned else at_rest))
    assert turn(log) == (turned == SHAPE)
    outward = unit(PLACE / 30e-3 + np.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(at_rest[1:-1, 1:-1], outward[1:-1, 1:-1], rtol=0.0, atol=1e-12)


def without_normals(log: GraspLog, turned: float) -> GraspLog:
    """Forces on the plane, or turned with its deformed shape by the least rotation."""
    assert log.force is not None
    if turned == REST:
        return replace(log, normal=None, object_pose=None)
    shape, upward = normals_of_shape(log.position, log.displacement), np.array([0.0, 0.0, 1.0])
    axis = np.cross(upward, shape)
    along = np.vecdot(axis, log.force)[..., None] * axis / (1.0 + shape[..., 2:])
    return replace(
        log, normal=None, object_pose=None, force=log.force * shape[..., 2:] + np.cross(axis, log.force) + along
    )


@pytest.mark.parametrize("turned", [REST, SHAPE])
def test_detector_and_samples_split_forces_at_the_normals_that_are_found(short_ramp: GraspLog, turned: float) -> None:
    log = without_normals(short_ramp, turned)
    given = replace(log, normal=normals_of(log))
    assert turn(log) == (turned == SHAPE)
    found, expected = detect_slip(log), detect_slip(given)
    np.testing.assert_array_equal(found.probability, expected.probability)
    for one, other in zip(found.patches, expected.patches, strict=True):
        np.testing.assert_array_equal(one.tangential_force, other.tangential_force)
    samples = collect_samples(log, found).friction_coefficient
    np.testing.assert_array_equal(samples, collect_samples(given, expected).friction_coefficient)
    assert with_normals(given) is given


@pytest.mark.parametrize("turned", [REST, SHAPE])
def test_a_stream_finds_out_while_it_is_pressed(short_ramp: GraspLog, turned: float) -> None:
    log = without_normals(short_ramp, turned)
    detector, whole = SlipDetector(log.position, log.element_area), detect_slip(log)
    told, slip = [], []
    for frame in log.frames():
        slip.append(detector.step(frame.time, frame.displacement, frame.force).slip)
        told.append(bool(detector.state.memory.noise[TURNING, SUMS]))
    pressed = whole.contact.any(axis=(1, 2)).argmax()
    assert sum(np.diff(told)) == (turned == SHAPE)  # once or never
    assert told[pressed + 4 :] == [turned == SHAPE] * len(told[pressed + 4 :])
    assert (np.array(slip) == whole.slip).mean() > 0.999
    if turned == REST:
        np.testing.assert_array_equal(slip, whole.slip)
