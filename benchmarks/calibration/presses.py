"""Presses of a ball (Hertz) on a sensor with known faults; the force on an element is the sum over 5 × 5 points."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy.ndimage import gaussian_filter

from slipcore import GraspLog
from slipcore.contact import RampSchedule, tangential_ramp

FINE = 5
"""Points along each side of an element."""
WHITE_SHARE = 0.1
"""Standard deviation of white marker noise beside the one with memory, as a share of it."""


@dataclass(frozen=True, slots=True)
class Faults:
    """What is put into a log: ``offset`` N (standard deviation over elements, white; the same in every log), ``drift``
    N/s and ``crosstalk`` of each element alike, ``smoothing`` of forces over elements (standard deviation), ``gain``,
    which the sensor multiplies forces with, ``marker_noise`` m, autoregressive with ``memory`` from frame to frame
    beside white noise of a tenth, and white ``force_noise`` N.
    """

    offset: float = 0.0
    drift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    crosstalk: tuple[float, float] = (0.0, 0.0)
    smoothing: float = 0.0
    gain: float = 1.0
    marker_noise: float = 0.0
    memory: float = 0.0
    force_noise: float = 0.0

    def offsets(self, grid: tuple[int, int]) -> np.ndarray:
        """Of each element, [n, m, 3] N: those of the sensor, whatever the log."""
        return self.offset * np.random.default_rng(20).standard_normal((*grid, 3))

    def put_into(self, log: GraspLog, seed: int) -> GraspLog:
        """A log as that sensor would tell it."""
        assert log.force is not None
        rng, elapsed = np.random.default_rng(seed), (log.time - log.time[0])[:, None, None, None]
        force = gaussian_filter(log.force, (0.0, self.smoothing, self.smoothing, 0.0)) if self.smoothing else log.force
        force = np.concatenate([force[..., :2] - force[..., 2:] * self.crosstalk, force[..., 2:]], axis=-1)
        force = self.gain * force + self.offsets(log.grid) + elapsed * self.drift
        force += self.force_noise * rng.standard_normal(force.shape)
        noise = rng.standard_normal(log.displacement.shape)
        for k in range(1, len(noise)):
            noise[k] = self.memory * noise[k - 1] + np.sqrt(1.0 - self.memory**2) * noise[k]
        noise = self.marker_noise * (noise + WHITE_SHARE * rng.standard_normal(noise.shape))
        return replace(log, force=force, displacement=log.displacement + noise)


@cache
def pressed(
    normal_force: float = 2.0, radius: float = 15e-3, rest: float = 1.0, press: float = 1.5, sideways: float = 0.0
) -> GraspLog:
    """A ball that is pressed on 20 × 20 elements of 1 mm with that force, N, and lifted again.

    ``sideways``: load along the surface in the hold, as a share of the friction limit. Made once for each.
    """
    schedule = RampSchedule(rest=rest, press=press, settle=0.2, shear=0.3, hold=0.0)
    fine = tangential_ramp(
        schedule=schedule, points=20 * FINE, pitch=1e-3 / FINE, normal_force=normal_force, sphere_radius=radius,
        tangential_force=sideways,
    )  # fmt: skip
    assert fine.force is not None
    fields = fine.force, fine.displacement, fine.position
    force, displacement, position = (field.reshape(*field.shape[:-3], 20, FINE, 20, FINE, 3) for field in fields)
    down = force.sum(axis=(2, 4)), displacement.mean(axis=(2, 4))
    both = [np.concatenate([field, field[::-1]]) for field in down]
    time = np.arange(len(both[0])) * (fine.time[1] - fine.time[0])
    normal = np.broadcast_to([0.0, 0.0, 1.0], both[0].shape)
    return GraspLog(time, position.mean(axis=(1, 3)), both[1], 1e-6, force=both[0], normal=normal, sensor="ball press")
