"""The pairs of geoms that press on each other in a scene that has come to rest."""

from collections import defaultdict
from copy import copy
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

LEAST_FORCE = 1e-9
"""N; what presses less does not touch."""


@dataclass(frozen=True, slots=True, eq=False)
class Touch:
    """Two geoms in contact: their numbers ``first`` and ``second``, and MuJoCo's ``contact`` parameters of the pair.

    ``frame`` [3, 3]: rows are the direction in which ``first`` pushes ``second``, and two along the surface;
    ``normal_force`` N; ``tangential_force`` [2] N along the last two; ``speed`` m/s of ``second`` along the surface;
    ``points`` of contact, a mean.
    """

    first: int
    second: int
    contact: Any
    frame: FloatArray
    normal_force: float
    tangential_force: FloatArray
    speed: float
    points: float


@dataclass(slots=True)
class _Sum:
    """What the points of one pair add up to over some steps: force, force-weighted normal and velocity."""

    contact: Any = None
    force: FloatArray = field(default_factory=lambda: np.zeros(3))
    normal: FloatArray = field(default_factory=lambda: np.zeros(3))
    velocity: FloatArray = field(default_factory=lambda: np.zeros(3))
    weight: float = 0.0
    points: int = 0

    def add(self, model: Any, data: Any, index: int) -> None:
        """Add one contact point."""
        contact = data.contact[index]
        frame = contact.frame.reshape(3, 3)
        wrench = np.zeros(6)
        mujoco.mj_contactForce(model, data, index, wrench)
        weight = abs(wrench[0])
        if self.contact is None:
            self.contact = copy(contact)  # what the engine gives is of this step alone: the next one writes over it
        self.force += wrench[:3] @ frame
        self.normal += weight * frame[0]
        self.velocity += weight * _relative_velocity(model, data, contact)
        self.weight += weight
        self.points += 1


def touching(model: Any, data: Any, steps: int) -> list[Touch]:
    """Step ``data`` and find which geoms press on each other, each pair with its means over the ``steps``."""
    sums: defaultdict[tuple[int, int], _Sum] = defaultdict(_Sum)
    for _ in range(steps):
        mujoco.mj_step(model, data)
        for index in range(data.ncon):
            first, second = (int(geom) for geom in data.contact[index].geom)
            if min(first, second) >= 0:
                sums[first, second].add(model, data, index)
    found = (_touch(pair, total, steps) for pair, total in sums.items() if total.weight > LEAST_FORCE * steps)
    return sorted(found, key=lambda touch: (touch.first, touch.second))


def _touch(pair: tuple[int, int], total: _Sum, steps: int) -> Touch:
    normal = total.normal / np.linalg.norm(total.normal)
    frame = _frame(normal, total.contact.frame[3:6])
    along = frame @ total.force / steps
    speed = float(np.linalg.norm(frame[1:] @ total.velocity / total.weight))
    return Touch(*pair, total.contact, frame, float(along[0]), along[1:], speed, total.points / steps)


def _frame(normal: FloatArray, tangent: FloatArray) -> FloatArray:
    """The normal and two directions across it, the first as close to ``tangent`` as can be."""
    first = tangent - (tangent @ normal) * normal
    first /= np.linalg.norm(first)
    return np.stack([normal, first, np.cross(normal, first)])


def _relative_velocity(model: Any, data: Any, contact: Any) -> FloatArray:
    """Of the second geom's surface over the first's at the contact point, m/s."""
    velocities = []
    for geom in contact.geom:
        twist = np.zeros(6)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_GEOM, int(geom), twist, 0)
        velocities.append(twist[3:] + np.cross(twist[:3], contact.pos - data.geom_xpos[geom]))
    return np.asarray(velocities[1] - velocities[0])
