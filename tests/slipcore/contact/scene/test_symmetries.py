"""What a scene must give when it is turned, mirrored or told in other units: the same, turned, mirrored or scaled."""

from collections.abc import Callable

import numpy as np
import pytest

from slipcore import GraspLog
from slipcore.contact import Fidelity, Finger, Press, Scene, simulate
from slipcore.contact.effects import (
    FiniteLayer,
    LoadPath,
    NormalTangentialCoupling,
    SensorSampling,
    Viscoelasticity,
)

Turn = Callable[[np.ndarray], np.ndarray]
PATH = np.array([[0.0, 0.0], [1.2, 0.5], [-0.36, 0.4]])  # N: the load turns, as does slip
MOMENT = np.array([0.0, 1.5e-3, 0.6e-3])  # N·m
TOLERANCE = 1e-9
"""Of the largest value: sums in another order leave 8e-12, and a field that is not turned right differs by 1."""


def log_of(
    bodies: str, turn: Turn = np.asarray, handedness: float = 1.0, force: float = 1.0, length: float = 1.0
) -> GraspLog:
    """A coupled press, pull and twist with forces and lengths so many times as large, of matter that is as soft for its
    size.
    """
    pulled = force * turn(PATH.T)
    twisted = handedness * force * length * MOMENT
    path = LoadPath((0.5, 0.9, 1.5), force_x=tuple(pulled[0]), force_y=tuple(pulled[1]), moment=tuple(twisted))
    sensor = SensorSampling((12, 12), length * 1e-3, 6.0)
    more = {"layer": (FiniteLayer(length * 4e-3),), "creep": (Viscoelasticity((0.4,), (0.5,)),)}.get(bodies, ())
    finger = Finger(length * 12e-3, force / length**2 * 1e6, 0.3)
    effects = (path, sensor, NormalTangentialCoupling(), *more)
    scene = Scene(bodies, effects, finger=finger, friction=0.4, press=Press(force * 6.0, 0.5), duration=1.5)
    return simulate(scene, fidelity=Fidelity(12, tolerance=1e-8))


def assert_the_same(given: GraspLog, force: np.ndarray, displacement: np.ndarray, ratio: np.ndarray) -> None:
    assert given.force is not None
    assert given.truth is not None
    np.testing.assert_allclose(given.force, force, rtol=0.0, atol=TOLERANCE * np.abs(force).max())
    np.testing.assert_allclose(given.displacement, displacement, rtol=0.0, atol=TOLERANCE * np.abs(displacement).max())
    np.testing.assert_array_equal(given.truth.stick_ratio, ratio)


@pytest.fixture(scope="module", params=["half-space", "layer", "creep"])
def usual(request: pytest.FixtureRequest) -> tuple[str, GraspLog]:
    log = log_of(request.param)
    assert log.truth is not None
    touched = log.truth.stick_ratio[~np.isnan(log.truth.stick_ratio)]
    assert touched.min() < 0.7  # much slips, and not all
    assert touched.max() > 0.9
    return request.param, log


def test_a_load_turned_by_a_right_angle_turns_all_fields(usual: tuple[str, GraspLog]) -> None:
    bodies, log = usual
    assert log.force is not None
    assert log.truth is not None

    def quarter(field: np.ndarray) -> np.ndarray:
        moved = np.rot90(field, axes=(1, 2))
        return np.stack((-moved[..., 1], moved[..., 0], moved[..., 2]), axis=-1)

    turned = log_of(bodies, lambda path: np.stack((-path[1], path[0])))
    places = quarter(np.broadcast_to(log.position, log.force.shape))
    np.testing.assert_allclose(places[0], turned.position, rtol=0.0, atol=1e-15)  # the turn itself is right
    assert_the_same(turned, quarter(log.force), quarter(log.displacement), log.truth.stick_ratio)


def test_a_mirrored_scene_gives_mirrored_fields(usual: tuple[str, GraspLog]) -> None:
    bodies, log = usual
    assert log.force is not None
    assert log.truth is not None
    flip = np.array([1.0, -1.0, 1.0])
    mirrored = log_of(bodies, lambda path: np.stack((path[0], -path[1])), handedness=-1.0)
    assert_the_same(mirrored, log.force[:, :, ::-1] * flip, log.displacement[:, :, ::-1] * flip, log.truth.stick_ratio)


@pytest.mark.parametrize(("force", "length"), [(1e-6, 1.0), (1e-3, 20.0)])
def test_units_of_force_and_length_do_not_matter(usual: tuple[str, GraspLog], force: float, length: float) -> None:
    bodies, log = usual
    assert log.force is not None
    assert log.truth is not None
    scaled = log_of(bodies, force=force, length=length)
    assert_the_same(scaled, force * log.force, length * log.displacement, log.truth.stick_ratio)
