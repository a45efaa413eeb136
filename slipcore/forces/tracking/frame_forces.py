"""Forces of single frames by one fit: matrix products with what it is the same for all of them."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter

from slipcore.forces.defaults import RECONSTRUCTION
from slipcore.forces.tracking.sensor import SensorResponse
from slipcore.forces.tracking.tracker import Key
from slipcore.frames import BoolArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class FrameForces:
    """Forces by the object on one frame's elements, and how well they are known: as of a ``Reconstruction``.

    ``force`` [n, m, 3] N, z outward, with its standard ``deviation``; ``resultant`` [3] N, also of what lies beyond the
    lattice, with ``resultant_deviation``; ``contact`` [n, m].
    """

    force: FloatArray
    deviation: FloatArray
    resultant: FloatArray
    resultant_deviation: FloatArray
    contact: BoolArray

    @classmethod
    def none(cls, grid: tuple[int, int]) -> "FrameForces":
        """Of a frame in which nothing touches."""
        force, total = np.zeros((*grid, 3)), np.zeros(3)
        return cls(force, force, total, total, np.zeros(grid, dtype=bool))


@dataclass(frozen=True, slots=True, eq=False)
class Reader:
    """Reads forces from frames by one ``key``'s fit.

    ``response`` [m, 3 j] of what is observed and ``elements`` [e, j] N of the j nodes in contact; before any misfit,
    ``deviation`` [3, e] N of elements' forces, and ``total`` [3] N of the resultant; ``depth_seen`` [e]: whether their
    markers' z was.
    """

    sensor: SensorResponse
    key: Key
    response: FloatArray
    elements: FloatArray
    deviation: FloatArray
    total: FloatArray
    depth_seen: BoolArray

    @classmethod
    def of(cls, sensor: SensorResponse, key: Key) -> "Reader":
        """Of a sensor whose contact was sought."""
        support, observation = key.fit.support, key.observation
        response = observation.response[:, :, support].reshape(len(observation.noise), -1)
        elements = sensor.elements[:, support]
        total = sensor.load * key.fit.deviation(np.ones((1, elements.shape[1])))[:, 0]
        depth_seen = sensor.depth_seen(observation)
        return cls(sensor, key, response, elements, key.fit.deviation(elements), total, depth_seen)

    @property
    def given(self) -> bool:
        """Whether the normal resultant was known from elsewhere."""
        return bool(np.isfinite(self.key.observation.noise[-1]))

    def read(self, data: FloatArray, grid: tuple[int, int]) -> FrameForces:
        """Forces of a frame's ``data`` [m] m on elements of this grid; what the fit leaves unexplained beyond noise
        widens their deviations.
        """
        sensor, outward = self.sensor, np.array([1.0, 1.0, -1.0])
        traction = self.key.fit.traction(data)
        misfit = self._misfit(traction, data)
        force = ((self.elements @ traction.T) * outward).reshape(*grid, 3)
        spread = np.hypot(
            misfit * self.deviation.T.reshape(force.shape), RECONSTRUCTION.element_error * np.abs(force).max()
        )
        covered = self.elements.sum(axis=1).reshape(grid) > RECONSTRUCTION.covered * sensor.load
        resultant = sensor.load * traction.sum(axis=1) * outward
        of_all = RECONSTRUCTION.resultant_error * np.linalg.norm(resultant)
        return FrameForces(
            force,
            np.hypot(spread, _step_error(force, self.depth_seen.reshape(grid))),
            resultant,
            np.hypot(misfit * self.total, of_all),
            _touching(-force[..., 2], spread[..., 2]) & covered,
        )

    def _misfit(self, traction: FloatArray, data: FloatArray) -> float:
        """Root mean square of the residuals over their noise, at least 1."""
        noise = self.key.observation.noise
        residual = (data - self.response @ traction.ravel()) / noise
        return float(np.sqrt(max(1.0, residual @ residual / max(np.isfinite(noise).sum(), 1))))


def _touching(normal: FloatArray, deviation: FloatArray) -> BoolArray:
    """Elements [n, m] whose normal force is neither noise nor little beside others'."""
    near = RECONSTRUCTION.rim_share * maximum_filter(normal, 3)
    least = np.maximum(near, RECONSTRUCTION.element_share * normal.max())
    return np.asarray(normal > np.maximum(RECONSTRUCTION.element_significance * deviation, least))


def _step_error(force: FloatArray, depth_seen: BoolArray) -> FloatArray:
    """Standard deviation [n, m, 3] of what bilinear tractions and the contact leave wrong where force steps, more of
    normal forces where z was not seen.
    """
    share = np.full(force.shape, RECONSTRUCTION.step_error)
    share[~depth_seen, 2] = RECONSTRUCTION.step_error_in_plane
    around = 3, 3, 1
    return np.asarray(share * (maximum_filter(force, around) - minimum_filter(force, around)))
