"""Forces on micro-elements from the displacement of markers (stage 2 of logs that have no forces)."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import maximum_filter, minimum_filter

from slipcore.errors import InvalidInput
from slipcore.forces.defaults import RECONSTRUCTION
from slipcore.forces.fit import Fit, Observation, Prior, choose_prior, fit
from slipcore.forces.gel import Gel
from slipcore.forces.nodes import Nodes
from slipcore.forces.recording import Recording
from slipcore.forces.response import response_matrix
from slipcore.forces.strength import Criterion
from slipcore.forces.support import better_support, relevant_nodes, widened
from slipcore.forces.whole_lattice import WholeLattice, whole_lattice
from slipcore.frames import BoolArray, FloatArray, GraspLog


@dataclass(frozen=True, slots=True, eq=False)
class Reconstruction:
    """Forces by the object, and how well they are known.

    ``force`` [t, n, m, 3] N on each element, z outward, with its standard ``deviation``; ``resultant`` [t, 3] N of the
    whole contact, also of what lies beyond the lattice, with ``resultant_deviation``; ``contact`` [t, n, m];
    ``kernel_width`` m: side of the square over which forces are in effect averaged; ``information`` [3]: share of what
    is known of the resultant's x, y and z that data tell and not the prior; ``condition``: largest over smallest
    singular value of the markers' response to traction on the contact (all three at the frame that moved markers most;
    NaN and no information without contact); ``noise`` m of a marker's coordinate that was assumed.
    """

    force: FloatArray
    deviation: FloatArray
    resultant: FloatArray
    resultant_deviation: FloatArray
    contact: BoolArray
    kernel_width: float
    information: FloatArray
    condition: float
    noise: float

    def apply(self, log: GraspLog) -> GraspLog:
        """The log with these forces, which its metadata call reconstructed, and their contact where it knows none."""
        if self.force.shape != log.displacement.shape:
            raise InvalidInput("log", f"of shape {list(log.displacement.shape)}", f"{list(self.force.shape)}")
        normal = np.broadcast_to([0.0, 0.0, 1.0], self.force.shape)  # linear theory: loads act on the undeformed plane
        return replace(log, force=self.force, normal=normal, metadata={**log.metadata, "force": "reconstructed"})

    @property
    def force_noise(self) -> float:
        """Typical standard deviation of an element's normal force in contact, N; 0 without contact."""
        touching = self.deviation[..., 2][self.contact]
        return float(np.median(touching)) if touching.size else 0.0


def reconstruct(
    log: GraspLog,
    gel: Gel,
    total_force: ArrayLike | None = None,
    noise: float | None = None,
    criterion: Criterion = "evidence",
) -> Reconstruction:
    """Find the forces that moved a log's markers, by Bayesian inversion of the gel's elastic response.

    ``total_force``: what a gripper or a wrist measured, [t] N of normal force (positive where it presses) or [t, 3] N
    of the object on the sensor, NaN where unknown; ``noise`` m of a marker's coordinate (None: estimated from the log);
    ``criterion`` that chooses the strength of the prior. Markers whose z never changes count as seen in the plane only.
    Raises ``UnknownScale`` for a log not in metres and ``InvalidInput`` for what does not fit.
    """
    shown = Recording.of(log, noise)
    sensor = _Sensor.of(log, gel, shown)
    recording = _Recording(sensor, shown, _total_force(total_force, len(log)))
    result = _no_forces(log, shown.noise)
    touched, strongest = shown.touched(), shown.strongest()
    if not touched.any():
        return result
    tracker = _Tracker.of(sensor, *recording.frame(strongest), criterion)
    result = replace(
        result,
        information=tracker.key.fit.information(),
        condition=tracker.key.observation.condition(tracker.key.fit.support),
        kernel_width=tracker.key.fit.kernel_width(tracker.key.observation, sensor.nodes.grid.pitch[0]),
    )
    for way in (range(strongest, len(log)), range(strongest - 1, -1, -1)):
        now = tracker
        for t in way:
            if touched[t]:
                now = now.at(*recording.frame(t))
                _write_frame(result, t, sensor, now.key, recording.frame(t)[1])
    return result


@dataclass(frozen=True, slots=True, eq=False)
class _Sensor:
    """What no frame changes, for tractions in Young's moduli: the ``response`` [m, 3, k] m of markers, ``elements`` [e,
    k] N of theirs by tractions at nodes, and ``load`` N, the force by a traction of 1 at one node.
    """

    nodes: Nodes
    response: FloatArray
    elements: FloatArray
    load: float
    axes: tuple[int, ...]

    @classmethod
    def of(cls, log: GraspLog, gel: Gel, recording: Recording) -> "_Sensor":
        place, axes = log.position[..., :2].reshape(-1, 2), recording.axes
        nodes = Nodes.around(place, log.element_area)
        response = response_matrix(gel, nodes, place)[list(axes)].reshape(len(axes) * len(place), 3, len(nodes))
        young = gel.young_modulus
        return cls(nodes, young * response, young * nodes.over_elements(place), young * nodes.area, axes)


def _total_force(given: ArrayLike | None, frames: int) -> FloatArray:
    """Resultant [t, 3] N in the gel's frame (z into it), NaN where it is not known."""
    total = np.full((frames, 3), np.nan)
    if given is not None:
        force = np.asarray(given, dtype=np.float64)
        if force.shape not in {(frames,), (frames, 3)} or np.isinf(force).any():
            raise InvalidInput("total_force", f"of shape {list(force.shape)}", f"finite, [{frames}] or [{frames}, 3] N")
        total[:, 2 if force.ndim == 1 else slice(3)] = force * (1.0 if force.ndim == 1 else [1.0, 1.0, -1.0])
    return total


@dataclass(frozen=True, slots=True, eq=False)
class _Recording:
    """What was ``shown`` to a ``sensor``, and ``given`` resultants [t, 3] N, NaN where unknown."""

    sensor: _Sensor
    shown: Recording
    given: FloatArray

    def frame(self, t: int) -> tuple[Observation, FloatArray]:
        """What one frame tells: displacements, then the parts of its resultant that are given."""
        data, given = self.shown.data[t], self.given[t]
        error = self.shown.error(data, self.shown.seen[t], self.shown.noise)
        known = np.flatnonzero(np.isfinite(given))
        if not known.size:
            return Observation(self.sensor.response, error), data
        rows = np.zeros((len(known), *self.sensor.response.shape[1:]))
        rows[np.arange(len(known)), known] = self.sensor.load
        share = RECONSTRUCTION.force_tolerance
        largest = np.nanmax(np.abs(self.given), initial=RECONSTRUCTION.least_force)
        tolerance = share * np.maximum(np.abs(given[known]), share * largest)
        noise = np.concatenate((error, tolerance))
        return Observation(np.concatenate((self.sensor.response, rows)), noise), np.concatenate((data, given[known]))


@dataclass(frozen=True, slots=True, eq=False)
class _Key:
    """A frame at which the contact was sought, and the fit that holds until markers have moved on."""

    observation: Observation
    data: FloatArray
    fit: Fit

    def holds(self, observation: Observation, data: FloatArray) -> bool:
        """Whether a frame sees the same markers and differs by little more than the noise of both."""
        if len(data) != len(self.data) or ((observation.noise == np.inf) != (self.observation.noise == np.inf)).any():
            return False
        change, before = (data - self.data) / self.observation.noise, self.data / self.observation.noise
        noise = 2.0 * np.isfinite(self.observation.noise).sum()
        return bool(change @ change <= RECONSTRUCTION.change**2 * (before @ before) + noise)

    def misfit(self, traction: FloatArray, data: FloatArray) -> float:
        """Root mean square of the residuals over their noise, at least 1."""
        explained = self.observation.response[:, :, self.fit.support].reshape(len(data), -1) @ traction.ravel()
        residual = (data - explained) / self.observation.noise
        return float(np.sqrt(max(1.0, residual @ residual / max(np.isfinite(self.observation.noise).sum(), 1))))


@dataclass(frozen=True, slots=True, eq=False)
class _Tracker:
    """The contact followed from frame to frame; ``lattice`` where depth is seen."""

    sensor: _Sensor
    criterion: Criterion
    prior: Prior
    key: _Key
    lattice: WholeLattice | None

    @classmethod
    def of(cls, sensor: _Sensor, observation: Observation, data: FloatArray, criterion: Criterion) -> "_Tracker":
        """Begin with a frame, which chooses the prior."""
        nodes, count, lattice = sensor.nodes, len(sensor.response), None
        if len(sensor.axes) == 3:
            everywhere = Observation(sensor.response, np.full(count, np.min(observation.noise[:count])))
            lattice = whole_lattice(everywhere, nodes, float(np.sqrt(np.mean(data[:count] ** 2))))
            support = _pressed(lattice, data[:count], nodes.grid.shape)
        else:
            support = relevant_nodes(observation, data, np.ones(nodes.grid.shape, dtype=bool))
        prior = choose_prior(observation, data, nodes, support.ravel(), criterion)
        key = _Key(observation, data, fit(observation, nodes, support.ravel(), prior))
        begun = cls(sensor, criterion, prior, key, lattice)
        return begun if lattice is not None else begun._sought_in_the_plane(observation, data)

    def at(self, observation: Observation, data: FloatArray) -> "_Tracker":
        """Go on to another frame; the contact is sought again only where markers have moved on."""
        if self.key.holds(observation, data):
            return self
        if self.lattice is None:
            return self._sought_in_the_plane(observation, data)
        support = _pressed(self.lattice, data[: len(self.sensor.response)], self.sensor.nodes.grid.shape)
        return self._on(observation, data, support, self.prior)

    def _sought_in_the_plane(self, observation: Observation, data: FloatArray) -> "_Tracker":
        """With a better contact for a frame, and before it the frame's own prior: one that allows for the shear of
        another frame lets shear stand for pressure, and the contact shrinks to where it would.
        """
        nodes, before = self.sensor.nodes, self.key.fit.support
        prior = choose_prior(observation, data, nodes, before, self.criterion, self.prior.smoothness)
        support = better_support(observation, data, nodes, before.reshape(nodes.grid.shape), prior)
        return self._on(observation, data, support, prior)

    def _on(self, observation: Observation, data: FloatArray, support: BoolArray, prior: Prior) -> "_Tracker":
        found = fit(observation, self.sensor.nodes, support.ravel(), prior)
        return replace(self, prior=prior, key=_Key(observation, data, found))


def _pressed(lattice: WholeLattice, data: FloatArray, shape: tuple[int, int]) -> BoolArray:
    """Nodes [ny, nx] with a pressure that is not noise, and one row around them; never none."""
    pressure, deviation = lattice.operator @ data, lattice.deviation
    noise = RECONSTRUCTION.node_significance * deviation
    least = np.maximum(noise, RECONSTRUCTION.node_share * pressure.max())
    pressed = (pressure > least) | (pressure == pressure.max())
    return widened(pressed.reshape(shape), 1)


def _no_forces(log: GraspLog, noise: float) -> Reconstruction:
    """Forces of zero, to be written to."""
    shape = log.displacement.shape
    return Reconstruction(
        force=np.zeros(shape),
        deviation=np.zeros(shape),
        resultant=np.zeros((len(log), 3)),
        resultant_deviation=np.zeros((len(log), 3)),
        contact=np.zeros(shape[:3], dtype=bool),
        kernel_width=float("nan"),
        information=np.zeros(3),
        condition=float("nan"),
        noise=noise,
    )


def _write_frame(result: Reconstruction, t: int, sensor: _Sensor, key: _Key, data: FloatArray) -> None:
    """Put one frame's forces into the result; what the fit leaves unexplained beyond noise widens its deviations."""
    support, grid = key.fit.support, result.contact.shape[1:]
    traction = key.fit.traction(data)
    elements = sensor.elements[:, support]
    outward = np.array([1.0, 1.0, -1.0])
    misfit = key.misfit(traction, data)
    force = ((elements @ traction.T) * outward).reshape(*grid, 3)
    spread = np.hypot(
        misfit * key.fit.deviation(elements).T.reshape(force.shape), RECONSTRUCTION.element_error * np.abs(force).max()
    )
    covered = elements.sum(axis=1).reshape(grid) > RECONSTRUCTION.covered * sensor.load
    result.force[t], result.contact[t] = force, _touching(-force[..., 2], spread[..., 2]) & covered
    result.deviation[t] = np.hypot(spread, _step_error(force, in_plane=len(sensor.axes) == 2))
    result.resultant[t] = sensor.load * traction.sum(axis=1) * outward
    of_all = RECONSTRUCTION.resultant_error * np.linalg.norm(result.resultant[t])
    total = sensor.load * key.fit.deviation(np.ones((1, elements.shape[1])))[:, 0]
    result.resultant_deviation[t] = np.hypot(misfit * total, of_all)


def _touching(normal: FloatArray, deviation: FloatArray) -> BoolArray:
    """Elements [n, m] whose normal force is neither noise nor little beside others'."""
    near = RECONSTRUCTION.rim_share * maximum_filter(normal, 3)
    least = np.maximum(near, RECONSTRUCTION.element_share * normal.max())
    return np.asarray(normal > np.maximum(RECONSTRUCTION.element_significance * deviation, least))


def _step_error(force: FloatArray, in_plane: bool) -> FloatArray:
    """Standard deviation [n, m, 3] of what bilinear tractions and the contact leave wrong where force steps."""
    share = np.full(3, RECONSTRUCTION.step_error)
    if in_plane:
        share[2] = RECONSTRUCTION.step_error_in_plane
    around = 3, 3, 1
    return np.asarray(share * (maximum_filter(force, around) - minimum_filter(force, around)))
