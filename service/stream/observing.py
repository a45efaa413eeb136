"""A sensor's frames as a grip controller takes them: resultant forces, and friction where elements slip."""

import math
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from slipcore import Frame, SlipState
from slipcore.element_forces import element_forces
from slipcore.frames import BoolArray, FloatArray
from stiction_client import Observation, SlipSamples

WINDOW = 6
"""Frames over which an element's slip is averaged: noise of 1 µm then makes 14 µm/s."""
LEAST_SPEED = 5e-5
"""m/s of an element whose friction is sampled: above 3 standard deviations of that."""
LEAST_SHARE = 0.1
"""Of the largest normal force in the frame: at the rim forces are least certain."""

UP = np.array([0.0, 0.0, 1.0])


class SampledForces(NamedTuple):
    """Reconstructed forces of a frame for friction samples: ``force`` [n, m, 3] N whose tangential and normal parts are
    averaged alike, and the ``least`` normal force N of an element for one.
    """

    force: FloatArray
    least: float


@dataclass(frozen=True, slots=True, eq=False)
class Observer:
    """What turns the frames of one sensor into observations: the ``position`` [n, m, 3] m of its markers at rest, the
    ``last`` slip states, and what the elements ``beside`` the contact bear (N, N, N, N·m): a running mean in which a
    new frame counts one in so many states as there are.
    """

    position: FloatArray
    last: tuple[SlipState, ...] = ()
    beside: FloatArray = field(default_factory=lambda: np.zeros(4))

    def step(
        self, frame: Frame, found: SlipState, sampled: SampledForces | None = None
    ) -> tuple["Observer", Observation]:
        """A frame with forces, and what the detector says of it: the observer after it, and the observation.

        Resultants are over the contact and the elements beside it. Forces that are not known (NaN) are left out. The
        torque is about the centre of what presses. Friction is that of the frame's forces, or of those that are to be
        ``sampled``.
        """
        assert frame.force is not None
        known = np.nan_to_num(frame.force)
        force = np.where(found.contact[..., None], known, 0.0)
        places = _about_centre(self.position[..., :2], force)
        last = (*self.last, found)[-WINDOW:]
        rim = _resultant(places, np.where(_beside(found.contact)[..., None], known, 0.0))
        beside = self.beside + (rim - self.beside) / len(last) if found.contact.any() else np.zeros(4)
        after = replace(self, last=last, beside=beside)
        x, y, z, moment = (_resultant(places, force) + after.beside).tolist()
        samples = after._samples(SampledForces(known, 0.0) if sampled is None else sampled, found.contact, frame.normal)
        return after, Observation(frame.time, max(-z, 0.0), math.hypot(x, y), abs(moment), found.stick_ratio, samples)

    def _samples(self, of: SampledForces, contact: BoolArray, normal: FloatArray | None) -> SlipSamples | None:
        """Friction where elements slip: well pressed, slipping for ``WINDOW`` frames, and fast enough to be seen."""
        slips = np.logical_and.reduce([state.slip for state in self.last])
        if len(self.last) < WINDOW or not slips.any():
            return None
        force = np.where(contact[..., None], of.force, 0.0)
        forces = element_forces(force, np.broadcast_to(UP, force.shape) if normal is None else normal)
        velocity = np.nan_to_num(np.mean([state.velocity for state in self.last], axis=0))
        pressed = forces.pressing > max(LEAST_SHARE * forces.pressing.max(), of.least)
        slips &= pressed
        use = slips & (np.hypot(velocity[..., 0], velocity[..., 1]) > LEAST_SPEED)
        if not slips.any():
            return None
        moving = float(use.sum() / slips.sum())
        return SlipSamples(forces.tangential[use] / forces.pressing[use], forces.pressing[use], moving)


def _beside(contact: BoolArray) -> BoolArray:
    """The elements beside the contact, [n, m]: one that its edge cuts is pressed too little to count as in contact, but
    bears a part of the load, and the edge moves as the force does.
    """
    near = np.zeros_like(contact)
    near[1:] |= contact[:-1]
    near[:-1] |= contact[1:]
    near[:, 1:] |= contact[:, :-1]
    near[:, :-1] |= contact[:, 1:]
    return near & ~contact


def _about_centre(place: FloatArray, force: FloatArray) -> FloatArray:
    """Of the elements at ``place`` [n, m, 2] m, x and y [2, n, m] from the centre of pressure of forces [n, m, 3] N:
    about any other point the tangential force would add to the torque. 0 where nothing presses.
    """
    pressing = np.maximum(-force[..., 2], 0.0)
    total = float(pressing.sum())
    if total == 0.0:
        return np.zeros((2, *pressing.shape))
    return np.moveaxis(place - np.tensordot(pressing, place, 2) / total, -1, 0)


def _resultant(place: FloatArray, force: FloatArray) -> FloatArray:
    """Of forces [n, m, 3] N at ``place`` [2, n, m] m: along x, y and z, and the moment about z, [4] N, N, N, N·m."""
    x, y = place
    moment = (x * force[..., 1] - y * force[..., 0]).sum()
    return np.append(force.sum(axis=(0, 1)), moment)
