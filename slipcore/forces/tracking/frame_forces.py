"""Forces of single frames by one fit: matrix products with what it is the same for all of them."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter

from slipcore.forces.defaults import RECONSTRUCTION
from slipcore.forces.recording import OUTWARD
from slipcore.forces.tracking.known import KnownForce
from slipcore.forces.tracking.sensor import SensorResponse
from slipcore.forces.tracking.tracker import Key
from slipcore.forces.tracking.unresolved import Unresolved
from slipcore.frames import BoolArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class FrameForces:
    """Forces by the object on one frame's elements, and how well they are known: as of a ``Reconstruction``.

    ``force`` [n, m, 3] N, z outward, with its standard ``deviation``; ``alike`` [n, m, 3] N, the same averaged once
    more so that tangential and normal parts are averaged alike; ``resultant`` [3] N, also of what lies beyond the
    lattice, with ``resultant_deviation``, and its ``moment`` N m about the sensor's z, with ``moment_deviation``;
    ``contact`` [n, m].
    """

    force: FloatArray
    deviation: FloatArray
    alike: FloatArray
    resultant: FloatArray
    resultant_deviation: FloatArray
    moment: float
    moment_deviation: float
    contact: BoolArray

    @property
    def force_noise(self) -> float:
        """As of a ``Reconstruction``, N."""
        return typical_deviation(self.deviation, self.contact)

    @property
    def of_samples(self) -> dict[str, float]:
        """As of a ``Reconstruction``."""
        return sample_options(self.force_noise)

    @classmethod
    def none(cls, grid: tuple[int, int]) -> "FrameForces":
        """Of a frame of which nothing is known yet."""
        force, total = np.zeros((*grid, 3)), np.zeros(3)
        return cls(force, force, force, total, total, 0.0, 0.0, np.zeros(grid, dtype=bool))

    @classmethod
    def unnoticed(cls, grid: tuple[int, int], limit: FloatArray, moment: float, known: KnownForce) -> "FrameForces":
        """Of a frame whose markers do not move beyond noise: none, up to the ``limit`` [3] N and ``moment`` N m that
        they would not show, unless the resultant is ``known``. Where on the elements it acts is not.
        """
        share = np.where(known.given, limit**2 / (limit**2 + known.deviation**2), 0.0)
        total = share * np.nan_to_num(known.force) * OUTWARD
        left = np.where(known.given, np.sqrt(share) * known.deviation, limit)
        deviation = np.broadcast_to(limit, (*grid, 3))
        nothing = np.zeros((*grid, 3))
        return cls(nothing, deviation, nothing, total, left, 0.0, moment, np.zeros(grid, dtype=bool))


@dataclass(frozen=True, slots=True, eq=False)
class FrameEstimate:
    """What is known of a frame by others as well: ``mean`` tractions [3, j], and ``data`` [m] m with less noise."""

    mean: FloatArray
    data: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Reader:
    """Reads forces from frames by one ``key``'s fit.

    ``response`` [m, 3 j] of what is observed and ``elements`` [e, j] N of the j nodes in contact; before any misfit,
    ``deviation`` [3, e] N of elements' forces, and ``total`` [4] of the ``wrench`` [4, 3, j], N and N m; ``averaging``
    [2, j, j] of shear and of pressure; ``unresolved``: what bilinear tractions leave wrong.
    """

    sensor: SensorResponse
    key: Key
    response: FloatArray
    elements: FloatArray
    deviation: FloatArray
    wrench: FloatArray
    total: FloatArray
    averaging: FloatArray
    unresolved: Unresolved

    @classmethod
    def of(cls, sensor: SensorResponse, key: Key) -> "Reader":
        """Of a sensor whose contact was sought."""
        support, observation = key.fit.support, key.observation
        response = observation.response[:, :, support].reshape(len(observation.noise), -1)
        elements = sensor.elements[:, support]
        wrench = sensor.wrench()[..., support]
        total = np.linalg.norm(wrench.reshape(4, -1) @ key.fit.root, axis=1)
        depth_seen = sensor.depth_seen(observation)[elements.any(axis=1)]
        shown = sensor.sees_along_surface and depth_seen.size > 0 and bool(depth_seen.all())
        unresolved = Unresolved.of(sensor, key.fit, shown)
        return cls(
            sensor,
            key,
            response,
            elements,
            key.fit.deviation(elements),
            wrench,
            total,
            key.fit.averaging(response),
            unresolved,
        )

    @property
    def given(self) -> bool:
        """Whether the normal resultant was known from elsewhere."""
        return bool(np.isfinite(self.key.observation.noise[-1]))

    def read(self, data: FloatArray, grid: tuple[int, int], estimate: FrameEstimate | None = None) -> FrameForces:
        """Forces of a frame's ``data`` [m] m on elements of this grid; what the fit leaves unexplained beyond noise
        widens their deviations. ``estimate``: that by other frames, too.
        """
        known = FrameEstimate(self.key.fit.mean(data), data) if estimate is None else estimate
        traction = self.key.fit.traction(known.mean)
        misfit = self._misfit(traction, data)
        of_elements, of_wrench = self._deviations(traction, known, misfit)
        wrench = self._wrench(traction)
        force = ((self.elements @ traction.T) * OUTWARD).reshape(*grid, 3)
        largest = RECONSTRUCTION.element_error * np.abs(force).max()
        by_noise = np.hypot(misfit * self.deviation[2].reshape(grid), largest)
        covered = self.elements.sum(axis=1).reshape(grid) > RECONSTRUCTION.covered * self.sensor.load
        return FrameForces(
            force,
            np.hypot(of_elements.T.reshape(force.shape), largest),
            (self._averaged_alike(traction) @ self.elements.T).T.reshape(force.shape) * OUTWARD,
            wrench[:3] * OUTWARD,
            of_wrench[:3],
            float(wrench[3]),
            float(of_wrench[3]),
            _touching(-force[..., 2], by_noise) & covered,
        )

    def _deviations(self, traction: FloatArray, known: FrameEstimate, misfit: float) -> tuple[FloatArray, FloatArray]:
        """Standard deviations of elements' forces [3, e] N and of the wrench [4], N and N m: by the data, by what
        bilinear tractions leave wrong, by how much the bound on pulling changes what the data say, and by what other
        contacts are as probable (the variance between models; Hoeting et al., Stat. Sci. 14 (1999) 382).
        """
        linear = known.mean
        bound = traction - linear
        unresolved, of_wrench = self.unresolved.deviations(traction)
        of_elements = (misfit * self.deviation) ** 2 + (bound @ self.elements.T) ** 2
        of_elements[:, self.unresolved.near] += unresolved**2
        total = (misfit * self.total) ** 2 + of_wrench**2 + self._wrench(bound) ** 2
        for probability, fit in self.key.others:
            other = fit.mean(known.data)
            differs = other @ self.sensor.elements[:, fit.support].T - linear @ self.elements.T
            of_elements += probability * differs**2
            total += probability * (_wrench(self.sensor.wrench()[..., fit.support], other) - self._wrench(linear)) ** 2
        return np.sqrt(of_elements), np.sqrt(total)

    def _averaged_alike(self, traction: FloatArray) -> FloatArray:
        """Shear averaged as pressure is, and pressure as shear is, [3, j].

        Each is found averaged by its own kernel already, and over an element of the rim by more of the one than of the
        other, which their ratio shows. Where all slips with one friction, averaged by both it is that friction.
        """
        shear, pressure = self.averaging
        return np.concatenate((traction[:2] @ pressure.T, traction[2:] @ shear.T))

    def _wrench(self, traction: FloatArray) -> FloatArray:
        return _wrench(self.wrench, traction)

    def _misfit(self, traction: FloatArray, data: FloatArray) -> float:
        """Root mean square of the residuals over their noise, at least 1."""
        noise = self.key.observation.noise
        residual = (data - self.response @ traction.ravel()) / noise
        return float(np.sqrt(max(1.0, residual @ residual / max(np.isfinite(noise).sum(), 1))))


def _wrench(by_each: FloatArray, traction: FloatArray) -> FloatArray:
    """The wrench [4] of tractions [3, j], by what each makes of it, [4, 3, j]."""
    return np.asarray(by_each.reshape(4, -1) @ traction.ravel())


def typical_deviation(deviation: FloatArray, contact: BoolArray) -> float:
    """Median ``deviation`` [..., 3] N of normal forces on elements in ``contact`` [...], 0 without."""
    touching = deviation[..., 2][contact]
    return float(np.median(touching)) if touching.size else 0.0


def sample_options(force_noise: float) -> dict[str, float]:
    """Options of friction samples by forces with this noise N of an element's normal force."""
    return {"force_noise": force_noise, "force_to_noise": RECONSTRUCTION.force_to_noise}


def _touching(normal: FloatArray, deviation: FloatArray) -> BoolArray:
    """Elements [n, m] whose normal force is neither noise of this ``deviation`` nor little beside others': what may lie
    between nodes says where in the contact a force acts, not whether there is one.
    """
    near = RECONSTRUCTION.rim_share * maximum_filter(normal, 3)
    least = np.maximum(near, RECONSTRUCTION.element_share * normal.max())
    return np.asarray(normal > np.maximum(RECONSTRUCTION.element_significance * deviation, least))
