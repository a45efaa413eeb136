"""A sensor's frames as a grip controller takes them: resultant forces, and friction where elements slip."""

import math
from dataclasses import dataclass, replace

import numpy as np

from slipcore import Frame, SlipState
from slipcore.element_forces import ElementForces, element_forces
from slipcore.frames import FloatArray
from stiction_client import Observation, SlipSamples

WINDOW = 6
"""Frames over which an element's slip is averaged: noise of 1 µm then makes 14 µm/s."""
LEAST_SPEED = 5e-5
"""m/s of an element whose friction is sampled: above 3 standard deviations of that."""
LEAST_SHARE = 0.1
"""Of the largest normal force in the frame: at the rim forces are least certain."""

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class Observer:
    """What turns the frames of one sensor into observations: the ``position`` [n, m, 3] m of its markers at rest, and
    the ``last`` slip states.
    """

    position: FloatArray
    last: tuple[SlipState, ...] = ()

    def step(self, frame: Frame, found: SlipState) -> tuple["Observer", Observation]:
        """A frame with forces, and what the detector says of it: the observer after it, and the observation.

        Forces that are not known (NaN) are left out. The torque is about the centre of what presses.
        """
        assert frame.force is not None
        force = np.where(found.contact[..., None], np.nan_to_num(frame.force), 0.0)
        x, y, z = force.sum(axis=(0, 1)).tolist()
        normal = np.broadcast_to(UP, force.shape) if frame.normal is None else frame.normal
        after = replace(self, last=(*self.last, found)[-WINDOW:])
        samples = after._samples(element_forces(force, normal))
        torque = abs(_torque(self.position[..., :2], force))
        return after, Observation(frame.time, max(-z, 0.0), math.hypot(x, y), torque, found.stick_ratio, samples)

    def _samples(self, forces: ElementForces) -> SlipSamples | None:
        """Friction where elements slip: well pressed, slipping for ``WINDOW`` frames, and fast enough to be seen."""
        slips = np.logical_and.reduce([state.slip for state in self.last])
        if len(self.last) < WINDOW or not slips.any():
            return None
        velocity = np.nan_to_num(np.mean([state.velocity for state in self.last], axis=0))
        pressed = forces.pressing > LEAST_SHARE * forces.pressing.max()
        slips &= pressed
        use = slips & (np.hypot(velocity[..., 0], velocity[..., 1]) > LEAST_SPEED)
        if not use.any():
            return None
        moving = float(use.sum() / slips.sum())
        return SlipSamples(forces.tangential[use] / forces.pressing[use], forces.pressing[use], moving)


def _torque(place: FloatArray, force: FloatArray) -> float:
    """Of forces [n, m, 3] N at ``place`` [n, m, 2] m about the normal through their centre of pressure, N·m: about any
    other point the tangential force would add to it. 0 where nothing presses.
    """
    along, across, outward = force.reshape(-1, 3).T
    pressing = np.maximum(-outward, 0.0)
    if not pressing.any():
        return 0.0
    places = place.reshape(-1, 2)
    x, y = (places - pressing @ places / pressing.sum()).T
    return float(x @ across - y @ along)
