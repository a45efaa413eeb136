"""Forces of frames as they come: by the last contact found at once, while it is sought anew beside the frames."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import dataclass, replace
from types import NoneType

import numpy as np
from numpy.typing import ArrayLike

from slipcore.arguments import number, of_kind, real_array
from slipcore.errors import InvalidInput
from slipcore.forces.defaults import FORCE_STREAM, STRENGTH
from slipcore.forces.operator.gel import Gel
from slipcore.forces.operator.nodes import Nodes
from slipcore.forces.operator.uneven import UnevenLayer
from slipcore.forces.recording import axes_seen, checked_noise, moved, noise_of, rows, seen_along
from slipcore.forces.tracking.frame_forces import FrameForces
from slipcore.forces.tracking.known import KnownForce, contradicts
from slipcore.forces.tracking.look import ContactTracking, MarkerReading, bytes_needed
from slipcore.forces.tracking.sensor import SensorResponse
from slipcore.frames import BoolArray, FloatArray, check_displacement, check_gripper_report, check_mask, reported
from slipcore.saturation import RangeWatch


@dataclass(frozen=True, slots=True, eq=False)
class StreamedForces:
    """The ``forces`` of a frame, and the ``age`` s of the frame by which its contact was last sought.

    Those of elements are zero where nothing touches, and where they are not known yet, because they ``wait_for`` what
    that says: "noise", "set-up" or "contact"; the resultant is then the gripper's force, or zero give or take what the
    gel bears. ``given``: whether they are by the gripper's force, too, and ``contradiction`` by
    how many standard deviations this differs from what is found; NaN without one, and while markers have moved on from
    where the contact was last sought. ``saturated``: how many elements show displacement at the end of the sensor's
    range, by the frames until then; it counts as not seen. ``force_deviation`` N: how unsure forces are for a detector,
    as ``Reconstruction.apply`` says it of a log's.
    """

    forces: FrameForces
    age: float = 0.0
    wait_for: str | None = None
    given: bool = False
    contradiction: float = float("nan")
    saturated: int = 0
    force_deviation: float = 0.0

    @property
    def contact(self) -> BoolArray:
        """The elements in contact, for a detector, [n, m]."""
        return self.forces.contact


class ForceStream:
    """Forces of one sensor's frames as they come, found as ``reconstruct`` finds those of a whole log.

    ``position`` [n, m, 3] m of markers at rest, ``element_area`` m², ``noise`` m of a marker's coordinate (None: the
    first 15 frames show it, and have no forces). With an ``executor`` of one thread, frames never wait: contacts are
    sought there, in the newest frame, and forces are by the last one found. Without, a frame waits where it is time to
    seek. Raises ``InvalidInput`` for what cannot be a sensor.
    """

    def __init__(
        self,
        position: ArrayLike,
        element_area: float,
        gel: Gel,
        noise: float | None = None,
        executor: Executor | None = None,
    ) -> None:
        place = real_array("position", position).astype(np.float64)
        if place.ndim != 3 or place.shape[-1] != 3 or not np.isfinite(place).all():
            raise InvalidInput("position", f"of shape {list(place.shape)}", "finite, [n, m, 3] m")
        area = number("element_area", element_area)
        if not 0.0 < area < np.inf:
            raise InvalidInput("element_area", element_area, "above 0 m², finite")
        noise = None if noise is None else checked_noise(noise)
        of_kind("gel", gel, Gel)
        of_kind("executor", executor, Executor | NoneType)
        gel.check_beside(float(np.sqrt(area)))  # so that what does not fit is refused here, and not by a look
        UnevenLayer.of(gel, place)
        self.nodes = len(Nodes.around(place[..., :2].reshape(-1, 2), area))
        """On which traction is sought: a look takes time with their cube, and memory with their square."""
        self.held_bytes = bytes_needed(place, area)
        """At most, but for what the contact itself takes."""
        self._position, self._area, self._gel, self._executor = place, area, gel, executor
        self._given, self._noise = noise, noise
        self._recent: deque[tuple[float, FloatArray]] = deque(maxlen=FORCE_STREAM.frames)
        self._range = RangeWatch()
        self._axes: tuple[int, ...] = (0, 1)
        self._data = np.zeros(0)
        self._largest, self._compared, self._contradicted = 0.0, 0, 0
        self._touches, self._touched, self._until_look = 0, False, 0
        self.touched_early = False
        """Whether something touched before forces could be known: while it was waited for noise or set-up."""
        self._tracking: ContactTracking | None = None
        self._look: tuple[int, Future[ContactTracking]] | None = None

    @property
    def contradicted(self) -> float:
        """Share of the frames that could be compared in which the gripper's force and what is found are not alike; 0
        while these are few.
        """
        few = self._compared < FORCE_STREAM.compared
        return 0.0 if few else self._contradicted / self._compared

    def step(
        self,
        time: float,
        displacement: ArrayLike,
        observed: ArrayLike | None = None,
        gripper_force: float | None = None,
        gripper_force_deviation: float | None = None,
    ) -> StreamedForces:
        """Forces of the next frame: displacements [n, m, 3] m at ``time`` s, of markers that were ``observed`` [n, m],
        and the ``gripper_force`` N with its standard deviation N, as a ``GraspLog`` has them.

        Raises ``InvalidInput`` for what is no such frame, and is then as before.
        """
        moved_by, marked = self._checked(time, displacement, observed)
        known = self._reported(gripper_force, gripper_force_deviation)
        self._largest = max(self._largest, gripper_force or 0.0)
        at_end = self._range.step(moved_by, marked)
        found = self._found(time, moved_by, seen_along(marked, at_end), known)
        count = int(np.count_nonzero(at_end.any(axis=-1)))
        return replace(found, saturated=count, force_deviation=self._force_deviation(found.forces))

    def close(self) -> None:
        """Give up the look for a contact that waits for its executor, if one does: no more frames come."""
        if self._look is not None:
            self._look[1].cancel()

    def _found(self, time: float, moved_by: FloatArray, seen: BoolArray, known: KnownForce) -> StreamedForces:
        self._remember(time, moved_by)
        if len(axes_seen(moved_by)) > len(self._axes):
            self._axes, self._tracking, self._data = axes_seen(moved_by), None, np.zeros(0)
        self._until_look -= 1
        self._collect()
        if self._tracking is None:
            self._begin_to(self._set_up)
        if self._noise is None:
            return self._unknown("noise", known)
        frame = self._marker_frame(time, moved_by, seen, known)
        if self._tracking is not None:
            self._seek(self._tracking, frame)
        if self._tracking is None or not self._tracking.is_ready:
            self.touched_early |= self._touched
            return self._unknown("set-up", known)
        if not self._touched:
            return self._untouched(self._tracking.sensor, frame)
        reader = self._tracking.reader
        if reader is None:
            return self._unknown("contact", known)
        n, m = self._position.shape[:2]
        forces = self._tracking.read(reader, frame, (n, m))
        return StreamedForces(forces, time - self._tracking.time, None, reader.given, self._compare(frame, forces))

    def _force_deviation(self, forces: FrameForces) -> float:
        """How unsure forces are for a detector, N: all of them where markers do not show pressure."""
        if self._tracking is None or self._tracking.sensor.shows_pressure:
            return forces.ratio_noise
        return float(np.abs(forces.force).max())

    def _checked(
        self, time: float, displacement: ArrayLike, observed: ArrayLike | None
    ) -> tuple[FloatArray, BoolArray | None]:
        time = number("time", time)
        moved_by = real_array("displacement", displacement).astype(np.float64)
        if moved_by.shape != self._position.shape:
            raise InvalidInput("displacement", f"of shape {list(moved_by.shape)}", f"{list(self._position.shape)}")
        seen = None if observed is None else check_mask("observed", observed, moved_by.shape[:2])
        observed_displacement = moved_by if seen is None else np.where(seen[..., None], moved_by, 0.0)
        if not np.isfinite(time) or not np.isfinite(observed_displacement).all():
            raise InvalidInput("frame", "one with numbers that are not", "finite time and displacement")
        check_displacement(observed_displacement, self._position)
        return observed_displacement, seen

    def _reported(self, force: float | None, deviation: float | None) -> KnownForce:
        check_gripper_report(force, deviation, self._largest)
        report = None if force is None else reported(np.array([force]))
        known = KnownForce.of(report, deviation, 1, self._largest)
        known.check("gripper_force", self._gel, self._area * self._position[..., 0].size)
        return known[0]

    def _compare(self, frame: MarkerReading, found: FrameForces) -> float:
        """The contradiction of a frame, which is counted."""
        if not frame.known.given.any() or self._tracking is None or not self._tracking.holds(frame):
            return float("nan")
        away = frame.known.away(found.resultant, found.resultant_deviation)
        self._compared += 1
        self._contradicted += bool(contradicts(away))
        return float(away[2])

    def _remember(self, time: float, displacement: FloatArray) -> None:
        """For the noise. Of two frames whose times do not grow, one is wrong: neither is kept where that is unclear."""
        if self._recent and time <= self._recent[-1][0]:
            self._recent.pop()
        if not self._recent or time > self._recent[-1][0]:
            self._recent.append((time, displacement))
        if self._noise is None and len(self._recent) == FORCE_STREAM.frames:
            self._noise = self._noise_now()
            self.touched_early = any(self._moves(moved_by) for _, moved_by in self._recent)

    def _noise_now(self) -> float:
        if self._given is not None:
            return self._given
        times, moved_by = zip(*self._recent, strict=True)
        return noise_of(np.array(times), np.stack(moved_by)[..., :2])

    def _moves(self, displacement: FloatArray) -> bool:
        """Whether markers are moved by more than noise, if all are seen."""
        (data,), (seen,) = rows(displacement[None], np.ones((1, *displacement.shape), dtype=bool), self._axes)
        return bool(moved(data, seen, self._noise or 0.0))

    def _marker_frame(
        self, time: float, displacement: FloatArray, is_observed: BoolArray, known: KnownForce
    ) -> MarkerReading:
        """The frame, and whether something touches in it; noise is that of the frames just before a touch.

        A marker that is not seen stays where it was, until a contact is sought without it; so does a gripper's force.
        """
        (data,), (seen,) = rows(displacement[None], is_observed[None], self._axes)
        there = np.concatenate((seen, known.given))
        self._data = np.where(there, SensorResponse.data(data, known), self._data if self._data.size else 0.0)
        data, before = self._data[: len(seen)], self._touched
        self._touched = bool(moved(data, seen, self._noise or 0.0))
        if self._touched and not before:
            self._noise = self._noise_now()
            self._touched = bool(moved(data, seen, self._noise))
            self._touches += self._touched
        return MarkerReading(time, self._data, seen, max(self._noise or 0.0, FORCE_STREAM.least_noise), known)

    def _seek(self, tracking: ContactTracking, frame: MarkerReading) -> None:
        """Let the contact be sought, if it is time to; forget it once nothing touches."""
        if not self._touched:
            self._tracking = tracking = tracking.untouched()
        if self._look is not None or self._until_look > 0:
            return
        look = tracking.next_look(frame, self._touched)
        if look is not None:
            self._until_look = FORCE_STREAM.stride_in_plane if len(self._axes) == 2 else FORCE_STREAM.stride
            self._begin_to(look)

    def _set_up(self) -> ContactTracking:
        return ContactTracking(SensorResponse.of(self._position, self._area, self._gel, self._axes))

    def _begin_to(self, look: Callable[[], ContactTracking]) -> None:
        """Look beside the frames, or at once."""
        if self._look is not None:
            return
        future: Future[ContactTracking] = Future()
        if self._executor is None:
            future.set_result(look())
        else:
            future = self._executor.submit(look)
        self._look = self._touches, future
        self._collect()

    def _collect(self) -> None:
        """Take what was found, if it is there and still of this contact; raises what it raised."""
        if self._look is None or not self._look[1].done():
            return
        (touch, look), self._look = self._look, None
        found = look.result()
        if found.sensor.axes == self._axes:
            self._tracking = found if self._touched and touch == self._touches else found.untouched()

    def _untouched(self, sensor: SensorResponse, frame: MarkerReading) -> StreamedForces:
        return self._unseen(sensor.unnoticed(frame.noise), sensor.unnoticed_moment(frame.noise), frame.known)

    def _unknown(self, wait_for: str, known: KnownForce) -> StreamedForces:
        """Forces that may be the most that is taken for possible: the widest prior's traction on all elements."""
        most = STRENGTH.largest * self._gel.young_modulus * self._area * self._position[..., 0].size
        arm = float(np.hypot(*np.abs(self._position[..., :2]).max(axis=(0, 1))))
        return replace(self._unseen(np.full(3, most), most * arm, known), wait_for=wait_for)

    def _unseen(self, limit: FloatArray, moment: float, known: KnownForce) -> StreamedForces:
        """No forces of elements, a resultant that is ``known``, or one up to a ``limit`` [3] N and ``moment`` N m."""
        n, m = self._position.shape[:2]
        return StreamedForces(FrameForces.unnoticed((n, m), limit, moment, known), given=bool(known.given.any()))
