"""Forces on micro-elements from the displacement of markers (stage 2 of logs that have no forces)."""

import math
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike

from slipcore.arguments import of_kind
from slipcore.errors import InvalidInput
from slipcore.forces.inverse.fit import ObservationModel
from slipcore.forces.inverse.kernel import ResolutionKernel
from slipcore.forces.inverse.strength import Criterion
from slipcore.forces.inverse.whole_lattice import WholeLattice
from slipcore.forces.operator.gel import Gel
from slipcore.forces.reconstruction.height import at_points
from slipcore.forces.recording import DisplacementData, error, rows
from slipcore.forces.tracking.frame_forces import FrameForces, Reader, TypicalDeviations
from slipcore.forces.tracking.known import KnownForce, contradicts
from slipcore.forces.tracking.over_time import ContactRun, runs
from slipcore.forces.tracking.sensor import SensorResponse
from slipcore.forces.tracking.tracker import Tracker
from slipcore.frames import BY_FORCES, BY_MOTION, RECONSTRUCTED, BoolArray, FloatArray, GraspLog, reported


@dataclass(frozen=True, slots=True, eq=False)
class Reconstruction(TypicalDeviations):
    """Forces by the object, and how well they are known.

    ``force`` [t, n, m, 3] N on each element, z outward, with its standard ``deviation``, and that of changes of the
    normal force ``of_changes`` [t, n, m] N: in the plane without the error of discretisation, which lasts as long as
    the contact; ``alike``, those of which
    tangential and normal parts are averaged alike, for their ratio; ``resultant`` [t, 3] N of the
    whole contact, also of what lies beyond the lattice, with ``resultant_deviation``, and its ``moment`` [t] N m about
    the sensor's z, through the origin of its places, with ``moment_deviation``; ``contact`` [t, n, m];
    ``kernel_width`` m: side of the square over which forces are in effect averaged; ``information`` [3]: share of what
    is known of the resultant's x, y and z that is from the data, not the prior; ``condition``: largest over smallest
    singular value of the markers' response to traction on the contact (all three at the frame that moved markers most;
    NaN and no information without contact); ``noise`` m of a marker's coordinate that was assumed; ``given`` [t, 3]
    says which components of the resultant were known from elsewhere, and so count among data, and ``contradiction``
    [t, 3] by how many standard deviations they differ from what is found where something touches (else NaN);
    ``saturated`` [t, n, m, 3]: displacements at the end of the sensor's range, taken as not seen; ``unnoticed`` [3] N:
    forces that would move markers by no more than noise, as which nothing is taken where nothing touches;
    ``shows_pressure``: False for markers in the plane on so thick a gel that they do not show where it presses;
    ``kernel``: what each element's force averages over, at that same frame; None without contact.
    """

    force: FloatArray
    deviation: FloatArray
    of_changes: FloatArray
    alike: FloatArray
    resultant: FloatArray
    resultant_deviation: FloatArray
    moment: FloatArray
    moment_deviation: FloatArray
    contact: BoolArray
    kernel_width: float
    information: FloatArray
    condition: float
    noise: float
    given: BoolArray
    contradiction: FloatArray
    saturated: BoolArray
    unnoticed: FloatArray
    shows_pressure: bool = True
    kernel: ResolutionKernel | None = None

    @property
    def contradicted(self) -> float:
        """Share of the frames that touch in which what was given and what is found are not alike."""
        known = np.isfinite(self.contradiction).any(axis=1)
        return float(contradicts(self.contradiction).sum() / known.sum()) if known.any() else 0.0

    def apply(self, log: GraspLog) -> GraspLog:
        """The log with these forces, which its metadata call reconstructed, and how unsure they are for a detector and
        for friction samples.

        Unless the log knows it, the contact is that which was found. Where markers do not show pressure no force is
        sure.
        """
        self._check_its_own(log)
        normal = np.broadcast_to([0.0, 0.0, 1.0], self.force.shape)  # linear theory: loads act on the undeformed plane
        deviation = self.ratio_noise if self.shows_pressure else float(np.abs(self.force).max())
        about = {"force": RECONSTRUCTED, "force_deviation": f"{deviation:.4g}"}
        about |= {name: f"{value:.4g}" for name, value in self.of_samples.items()}
        contact = log.contact
        if contact is None or log.metadata.get("contact") in (BY_MOTION, BY_FORCES):
            contact, about["contact"] = self.contact, BY_FORCES
        return replace(log, force=self.force, normal=normal, contact=contact, metadata={**log.metadata, **about})

    def for_samples(self, log: GraspLog) -> GraspLog:
        """The log that ``apply`` gave, as friction samples are to be collected from it: with forces averaged alike."""
        self._check_its_own(log)
        return replace(log, force=self.alike)

    def _check_its_own(self, log: GraspLog) -> None:
        of_kind("log", log, GraspLog)
        if self.force.shape != log.displacement.shape:
            raise InvalidInput("log", f"of shape {list(log.displacement.shape)}", f"{list(self.force.shape)}")


def reconstruct(
    log: GraspLog,
    gel: Gel,
    total_force: ArrayLike | None = None,
    noise: float | None = None,
    criterion: Criterion = "evidence",
    total_force_deviation: float | None = None,
    over_time: bool = False,
) -> Reconstruction:
    """Find the forces that moved a log's markers, by Bayesian inversion of the gel's elastic response.

    ``total_force``: what a gripper or a wrist measured, [t] N of normal force (positive where it presses) or [t, 3] N
    of the object on the sensor, NaN where unknown, and its standard ``total_force_deviation`` N (None: 1 % of it);
    without it the log's own ``gripper_force`` is taken where it is above 0. ``noise`` m of a marker's coordinate (None:
    estimated from the log); ``criterion`` that chooses the strength of the prior; ``over_time``: whether each frame is
    found by all before it and after in which markers have hardly moved, by a Kalman filter and smoother. Markers whose
    z never changes count as seen in the plane only, and displacements at the end of the sensor's range as not seen
    along that axis.
    Of a log that saw displacement along the normal alone, forces along the surface are 0 with an infinite deviation; it
    is taken for the height of places, as maps show it, not of points of the gel.
    Raises ``UnknownScale`` for a log not in metres and ``InvalidInput`` for what does not fit.
    """
    of_kind("log", log, GraspLog)
    of_kind("gel", gel, Gel)
    of_kind("criterion", criterion, str)
    of_kind("over_time", over_time, bool)
    shown = DisplacementData.of(log, noise)
    sensor = SensorResponse.of(log.position, log.element_area, gel, shown.axes)
    name = "total_force"
    if total_force is None and total_force_deviation is None and log.gripper_force is not None:
        name, total_force = "gripper_force", reported(log.gripper_force)
        total_force_deviation = log.gripper_force_deviation
    known = KnownForce.of(total_force, total_force_deviation, len(log))
    known.check(name, gel, log.element_area * math.prod(log.grid))
    result, lattice = _followed(log, sensor, shown, known, criterion, over_time)
    if sensor.sees_along_surface:
        return result
    of_points, _ = rows(at_points(log, gel, result.force), shown.saturated, shown.axes)
    result, _ = _followed(log, sensor, replace(shown, data=of_points), known, criterion, over_time, lattice)
    return _normal_alone(result)


def _followed(
    log: GraspLog,
    sensor: SensorResponse,
    shown: DisplacementData,
    known: KnownForce,
    criterion: Criterion,
    over_time: bool,
    lattice: WholeLattice | None = None,
) -> tuple[Reconstruction, WholeLattice | None]:
    """Forces in all frames, from that in which markers moved most both ways, and the ``lattice`` by which pressed nodes
    were found where depth is seen, made unless there is one.
    """
    recording = _Recording(sensor, shown, known)
    touched, strongest = shown.touched(), shown.strongest()
    result = _no_forces(log, shown, known.given, sensor)
    for t in map(int, np.flatnonzero(~touched)):
        none = FrameForces.unnoticed(log.grid, result.unnoticed, sensor.unnoticed_moment(shown.noise), known[t])
        _write_frame(result, t, none)
    if not touched.any():
        return result, lattice
    tracker = Tracker.of(sensor, *recording.frame(strongest), criterion, lattice)
    fit, observation = tracker.key.fit, tracker.key.observation
    places, elements = sensor.nodes.places()[fit.support], sensor.elements.reshape(*log.grid, -1)
    result = replace(
        result,
        kernel=ResolutionKernel(fit, observation, places, elements, sensor.load),
        information=fit.information(),
        condition=observation.condition(fit.support),
        kernel_width=fit.kernel_width(observation, sensor.nodes.grid.pitch[0]),
    )
    for key, frames in runs(tracker, recording.frame, touched, strongest):
        data = np.stack([recording.frame(t)[1] for t in frames])
        run = (
            ContactRun.of(key, data, log.time[frames], shown.noise)
            if over_time
            else ContactRun.frame_by_frame(key, len(data))
        )
        reader = Reader.of(sensor, run.key)
        for t, each, estimate in zip(frames, data, run.estimates, strict=True):
            _write_frame(result, t, reader.read(each, log.grid, estimate))
    away = known.away(result.resultant, result.resultant_deviation)
    return replace(result, contradiction=np.where(touched[:, None], away, np.nan)), tracker.lattice


@dataclass(frozen=True, slots=True, eq=False)
class _Recording:
    """What was ``shown`` to a ``sensor``, and resultants that are ``known``."""

    sensor: SensorResponse
    shown: DisplacementData
    known: KnownForce

    def frame(self, t: int) -> tuple[ObservationModel, FloatArray]:
        """What one frame measures: displacements, then its resultant."""
        data = self.shown.data[t]
        spread = error(data, self.shown.seen[t], self.shown.noise)
        return self.sensor.observation(spread, self.known[t]), self.sensor.data(data, self.known[t])


def _no_forces(log: GraspLog, shown: DisplacementData, given: BoolArray, sensor: SensorResponse) -> Reconstruction:
    """Forces of zero, to be written to."""
    shape = log.displacement.shape
    return Reconstruction(
        force=np.zeros(shape),
        deviation=np.zeros(shape),
        of_changes=np.zeros(shape[:3]),
        alike=np.zeros(shape),
        resultant=np.zeros((len(log), 3)),
        resultant_deviation=np.zeros((len(log), 3)),
        moment=np.zeros(len(log)),
        moment_deviation=np.zeros(len(log)),
        contact=np.zeros(shape[:3], dtype=bool),
        kernel_width=float("nan"),
        information=np.zeros(3),
        condition=float("nan"),
        noise=shown.noise,
        given=given,
        contradiction=np.full((len(log), 3), np.nan),
        saturated=shown.saturated,
        unnoticed=sensor.unnoticed(shown.noise),
        shows_pressure=sensor.shows_pressure,
    )


def _normal_alone(result: Reconstruction) -> Reconstruction:
    """The same, but that no force along the surface is known."""
    unknown = np.array([np.inf, np.inf, 0.0])
    normal = np.array([0.0, 0.0, 1.0])
    return replace(
        result,
        force=result.force * normal,
        alike=result.alike * normal,
        deviation=result.deviation + unknown,
        resultant=result.resultant * normal,
        resultant_deviation=result.resultant_deviation + unknown,
        moment=np.zeros_like(result.moment),
        moment_deviation=np.full_like(result.moment, np.inf),
        information=result.information * normal,
    )


def _write_frame(result: Reconstruction, t: int, found: FrameForces) -> None:
    """Put one frame's forces into the result."""
    for each in fields(found):
        getattr(result, each.name)[t] = getattr(found, each.name)
