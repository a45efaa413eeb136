"""Forces of single frames by one fit: matrix products with what it is the same for all of them."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_fill_holes, maximum_filter

from slipcore.forces.defaults import RECONSTRUCTION
from slipcore.forces.inverse.fit import TractionMean
from slipcore.forces.recording import OUTWARD
from slipcore.forces.tracking.known import KnownForce
from slipcore.forces.tracking.sensor import SensorResponse
from slipcore.forces.tracking.tracker import Key
from slipcore.forces.tracking.unresolved import Unresolved
from slipcore.frames import BoolArray, FloatArray


class TypicalDeviations:
    """How unsure forces are as a whole, of one frame's or a log's."""

    __slots__ = ()
    deviation: FloatArray
    of_changes: FloatArray
    contact: BoolArray

    @property
    def force_noise(self) -> float:
        """Typical standard deviation of an element's normal force in contact, N; 0 without contact."""
        return _typical_deviation(self.deviation[..., 2], self.contact)

    @property
    def ratio_noise(self) -> float:
        """Typical standard deviation of changes of it, for an element's force ratio beside its own at other times."""
        return _typical_deviation(self.of_changes, self.contact)

    @property
    def of_samples(self) -> dict[str, float]:
        """Options of friction samples by these forces."""
        return {"force_noise": self.force_noise, "force_to_noise": RECONSTRUCTION.force_to_noise}


@dataclass(frozen=True, slots=True, eq=False)
class FrameForces(TypicalDeviations):
    """Forces by the object on one frame's elements, and how well they are known: as of a ``Reconstruction``.

    ``force`` [n, m, 3] N, z outward, with its standard ``deviation``, and that of changes of the normal force
    ``of_changes`` [n, m] N; ``alike`` [n, m, 3] N, forces averaged once
    more so that tangential and normal parts are averaged alike; ``resultant`` [3] N, also of what lies beyond the
    lattice, with ``resultant_deviation``, and its ``moment`` N m about the sensor's z, with ``moment_deviation``;
    ``contact`` [n, m].
    """

    force: FloatArray
    deviation: FloatArray
    of_changes: FloatArray
    alike: FloatArray
    resultant: FloatArray
    resultant_deviation: FloatArray
    moment: float
    moment_deviation: float
    contact: BoolArray

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
        untouched = np.zeros(grid, dtype=bool)
        return cls(nothing, deviation, deviation[..., 2], nothing, total, left, 0.0, moment, untouched)


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

    def read(
        self,
        data: FloatArray,
        grid: tuple[int, int],
        estimate: FrameEstimate | None = None,
        wider: TractionMean | None = None,
    ) -> FrameForces:
        """Forces of a frame's ``data`` [m] m on elements of this grid; what the fit leaves unexplained beyond noise
        widens their deviations. ``estimate``: that by other frames, too; ``wider``: on a contact that may be the
        frame's as well as the key's.
        """
        known = FrameEstimate(self.key.fit.mean(data), data) if estimate is None else estimate
        traction = self.key.fit.traction(known.mean)
        misfit = self._misfit(traction, data)
        of_elements, of_wrench = self._deviations(traction, known, misfit, wider)
        wrench = self._wrench(traction)
        force = ((self.elements @ traction.T) * OUTWARD).reshape(*grid, 3)
        largest = RECONSTRUCTION.element_error * np.abs(force).max()
        deviation = np.hypot(of_elements.T.reshape(force.shape), largest)
        noise = (misfit * self.deviation).reshape(3, *grid)
        return FrameForces(
            force,
            deviation,
            deviation[..., 2] if self.sensor.sees_depth else np.hypot(noise[2], largest),
            (self._averaged_alike(traction) @ self.elements.T).T.reshape(force.shape) * OUTWARD,
            wrench[:3] * OUTWARD,
            of_wrench[:3],
            float(wrench[3]),
            float(of_wrench[3]),
            self._contact(force, deviation, noise),
        )

    def _contact(self, force: FloatArray, deviation: FloatArray, noise: FloatArray) -> BoolArray:
        """Elements [n, m] in contact, by forces [n, m, 3] N with their ``deviation`` and ``noise`` [3, n, m] N: those
        that are pressed, as far as markers show it. In the plane alone these mostly show shear better, which only what
        touches bears: then those that bear it, and what is pressed between them.
        """
        pressed = self._pressed(-force[..., 2], noise[2], np.abs(force).max())
        if self.sensor.sees_depth:
            return pressed
        shear = np.hypot(force[..., 0], force[..., 1])
        left = RECONSTRUCTION.element_error * shear.max()
        bearing = _touching(shear, np.hypot(noise[:2].max(axis=0), left))
        either = pressed | bearing
        if not either.any():
            return either
        unsure = np.median(deviation[either], axis=0)
        if self.sensor.shows_pressure and unsure[:2].max() * -force[..., 2].min() > unsure[2] * shear.max():
            return pressed
        return np.asarray(bearing | (pressed & binary_fill_holes(bearing)))

    def _pressed(self, normal: FloatArray, noise: FloatArray, largest: float) -> BoolArray:
        """Elements with a ``normal`` force [n, m] N beyond ``noise`` N, beside a ``largest`` force N of any; none where
        markers do not show pressure.
        """
        if not self.sensor.shows_pressure:
            return np.zeros(normal.shape, dtype=bool)
        covered = self.elements.sum(axis=1).reshape(normal.shape) > RECONSTRUCTION.covered * self.sensor.load
        return np.asarray(_touching(normal, np.hypot(noise, RECONSTRUCTION.element_error * largest)) & covered)

    def _deviations(
        self, traction: FloatArray, known: FrameEstimate, misfit: float, wider: TractionMean | None
    ) -> tuple[FloatArray, FloatArray]:
        """Standard deviations of elements' forces [3, e] N and of the wrench [4], N and N m: by the data, by what
        bilinear tractions leave wrong, by how much the bound on pulling changes what the data say, and by what other
        contacts are as probable (the variance between models; Hoeting et al., Stat. Sci. 14 (1999) 382), all of what
        a ``wider`` one does.
        """
        linear = known.mean
        bound = traction - linear
        unresolved, of_wrench = self.unresolved.deviations(traction)
        of_elements = (misfit * self.deviation) ** 2 + (bound @ self.elements.T) ** 2
        of_elements[:, self.unresolved.near] += unresolved**2
        total = (misfit * self.total) ** 2 + of_wrench**2 + self._wrench(bound) ** 2
        others = self.key.others if wider is None else (*self.key.others, (1.0, wider))
        for probability, fit in others:
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


def _typical_deviation(deviation: FloatArray, contact: BoolArray) -> float:
    """Median ``deviation`` [...] N of normal forces on elements in ``contact`` [...], 0 without."""
    touching = deviation[contact]
    return float(np.median(touching)) if touching.size else 0.0


def _touching(force: FloatArray, deviation: FloatArray) -> BoolArray:
    """Elements [n, m] whose normal force or shear is neither noise of this ``deviation`` nor little beside others':
    what may lie between nodes says where in the contact a force acts, not whether there is one.
    """
    near = RECONSTRUCTION.rim_share * maximum_filter(force, 3)
    least = np.maximum(near, RECONSTRUCTION.element_share * force.max())
    return np.asarray(force > np.maximum(RECONSTRUCTION.element_significance * deviation, least))
