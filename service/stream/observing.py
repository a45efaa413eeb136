"""A sensor's frames as a grip controller takes them: resultant forces, and friction where elements slip."""

from collections import deque

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


class Observer:
    """Frames of one sensor, one after the other; ``position`` [n, m, 3] m of its markers at rest."""

    def __init__(self, position: FloatArray) -> None:
        self._x, self._y = position[..., 0], position[..., 1]
        self._last: deque[SlipState] = deque(maxlen=WINDOW)

    def __call__(self, frame: Frame, found: SlipState) -> Observation:
        """A frame with forces, and what the detector says of it.

        Forces that are not known (NaN) are left out. The torque is about the middle of the lattice.
        """
        assert frame.force is not None
        force = np.where(found.contact[..., None], np.nan_to_num(frame.force), 0.0)
        total = force.sum(axis=(0, 1))
        torque = float((self._x * force[..., 1] - self._y * force[..., 0]).sum())
        normal = np.broadcast_to(UP, force.shape) if frame.normal is None else frame.normal
        samples = self._samples(element_forces(force, normal), found)
        tangential = float(np.hypot(total[0], total[1]))
        return Observation(frame.time, max(-float(total[2]), 0.0), tangential, abs(torque), found.stick_ratio, samples)

    def _samples(self, forces: ElementForces, found: SlipState) -> SlipSamples | None:
        """Friction where elements slip: well pressed, slipping for ``WINDOW`` frames, and fast enough to be seen."""
        self._last.append(found)
        velocity = np.nan_to_num(np.mean([state.velocity for state in self._last], axis=0))
        slips = np.all([state.slip for state in self._last], axis=0) & (len(self._last) == WINDOW)
        pressed = forces.pressing > LEAST_SHARE * forces.pressing.max()
        use = slips & pressed & (np.hypot(velocity[..., 0], velocity[..., 1]) > LEAST_SPEED)
        return SlipSamples(forces.tangential[use] / forces.pressing[use], forces.pressing[use]) if use.any() else None
