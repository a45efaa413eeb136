"""What fingers must press, against the least total force with which a linear program balances all forces and torques.

The program knows nothing of shares: each contact presses, pulls and turns as it likes within Coulomb's friction and the
elliptic limit surface, of which it takes a polyhedron inside, so that it needs no less than the truth.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import linprog

from stiction_client import Contact, FrictionModel, antipodal, n_fingers, required_normal_force

Array = NDArray[np.float64]
Make = Callable[..., FrictionModel]

DIRECTIONS = 1500
LOST = 0.01
"""Of a unit sphere's radius, at most, between so many points of it."""
PAD = Contact.flat(6e-5)


@dataclass(frozen=True)
class Finger:
    """Where a contact is, m, which way it presses, and what it bears."""

    at: Array
    presses: Array
    friction: float
    arm: float


def sphere() -> Array:
    """Points spread evenly on the unit sphere (Fibonacci), and its poles and equator's quarters."""
    k = np.arange(DIRECTIONS) + 0.5
    height, turn = 1.0 - 2.0 * k / DIRECTIONS, math.pi * (1.0 + math.sqrt(5.0)) * k
    across = np.sqrt(1.0 - height**2)
    return np.vstack([np.stack([across * np.cos(turn), across * np.sin(turn), height], axis=1), np.eye(3), -np.eye(3)])


def wrenches(finger: Finger) -> Array:
    """Of a press of 1 N, and of each corner of what friction adds to it, [1 + corners, 6]: force N and torque N·m."""
    first = np.cross(finger.presses, [0.0, 0.0, 1.0])
    second = np.cross(finger.presses, first)
    corners = sphere()
    force = corners[:, :1] * first + corners[:, 1:2] * second
    spin = finger.arm * corners[:, 2:] * finger.presses
    pressing = np.concatenate([finger.presses, np.cross(finger.at, finger.presses)])
    return np.vstack([pressing, np.hstack([force, np.cross(finger.at, force) + spin])])


def least_forces(fingers: Sequence[Finger], load: Array) -> Array:
    """Normal forces [fingers], N, of the least sum that balance a ``load`` [6] of forces N and torques N·m."""
    each = [wrenches(finger) for finger in fingers]
    size = len(each[0])
    cost = np.tile(np.arange(size) == 0, len(fingers)).astype(float)
    within = np.kron(np.eye(len(fingers)), np.ones(size))
    for k, finger in enumerate(fingers):
        within[k, k * size] = -finger.friction
    found = linprog(cost, within, np.zeros(len(fingers)), np.vstack(each).T, -load)
    assert found.status == 0, found.message
    return np.asarray(found.x)[::size]


def around(count: int, radius: float, friction: float, arm: float) -> list[Finger]:
    """Fingers evenly around the z axis, each pressing towards it."""
    angles = 2.0 * math.pi * np.arange(count) / count
    outward = np.stack([np.cos(angles), np.sin(angles), np.zeros(count)], axis=1)
    return [Finger(radius * out, -out, friction, arm) for out in outward]


def coulomb(make_model: Make, friction: float = 0.4) -> FrictionModel:
    return make_model((friction, 0.0, 0.0), np.zeros((3, 3)), scale=0.0)


@pytest.mark.parametrize(("load", "torque"), [(2.0, 0.0), (2.0, 4e-3), (0.5, 8e-3), (0.0, 5e-3)])
def test_two_equal_fingers_need_no_more_than_balance_does(make_model: Make, load: float, torque: float) -> None:
    fingers = around(2, 0.03, 0.4, float(PAD.torque_arm))
    least = least_forces(fingers, np.array([0.0, 0.0, -load, torque, 0.0, 0.0]))
    answer = required_normal_force(coulomb(make_model), load, contacts=antipodal(PAD), torque=torque).normal_force
    assert least == pytest.approx([answer, answer], rel=LOST)
    assert least.sum() >= 2.0 * answer * (1.0 - 1e-9)


@pytest.mark.parametrize("count", [3, 4, 5])
@pytest.mark.parametrize(("load", "torque"), [(2.0, 0.0), (2.0, 0.05), (0.0, 0.1)])
def test_fingers_around_a_lid_need_no_more_than_balance_does(
    make_model: Make, count: int, load: float, torque: float
) -> None:
    """However unevenly they might press: of equal fingers none presses less in total than all alike."""
    fingers = around(count, 0.03, 0.4, float(PAD.torque_arm))
    least = least_forces(fingers, np.array([0.0, 0.0, -load, 0.0, 0.0, torque]))
    grasp = n_fingers(count, PAD, object_radius=0.03)
    answer = required_normal_force(coulomb(make_model), load, contacts=grasp, torque=torque).normal_force
    assert count * answer * (1.0 - 1e-9) <= least.sum() <= count * answer * (1.0 + LOST)


def test_of_two_unlike_fingers_the_weaker_needs_its_half_of_the_load(make_model: Make) -> None:
    """The load's moment about either finger leaves no other shares, and both press alike."""
    frictions = (0.3, 0.6)
    fingers = [replace(each, friction=mu) for each, mu in zip(around(2, 0.03, 0.4, 0.0), frictions, strict=True)]
    each = [required_normal_force(coulomb(make_model, mu), 1.0, contacts=PAD).normal_force for mu in frictions]
    assert least_forces(fingers, np.array([0.0, 0.0, -2.0, 0.0, 0.0, 0.0])) == pytest.approx([max(each)] * 2, rel=LOST)


@pytest.mark.parametrize("thumb_friction", [0.2, 0.5])
def test_a_thumb_bears_half_of_the_load_and_each_of_two_fingers_a_quarter(
    make_model: Make, thumb_friction: float
) -> None:
    presses = np.array([1.0, 0.0, 0.0])
    thumb = Finger(np.array([-0.03, 0.0, 0.0]), presses, thumb_friction, 0.0)
    others = [Finger(np.array([0.03, y, 0.0]), -presses, 0.4, 0.0) for y in (-0.02, 0.02)]
    of_thumb = required_normal_force(coulomb(make_model, thumb_friction), 1.0, contacts=PAD).normal_force
    of_finger = required_normal_force(coulomb(make_model), 0.5, contacts=PAD).normal_force
    finger = max(of_finger, 0.5 * of_thumb)
    least = least_forces([thumb, *others], np.array([0.0, 0.0, -2.0, 0.0, 0.0, 0.0]))
    assert least == pytest.approx([2.0 * finger, finger, finger], rel=LOST)
