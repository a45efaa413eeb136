"""Looks for the contact of a stream's frames: what is known, and what is to be found out next."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from slipcore.forces.defaults import FORCE_STREAM
from slipcore.forces.inverse.fit import ObservationModel, TractionMean
from slipcore.forces.inverse.whole_lattice import WholeLattice
from slipcore.forces.operator.nodes import Nodes
from slipcore.forces.recording import error
from slipcore.forces.tracking.frame_forces import FrameForces, Reader
from slipcore.forces.tracking.known import KnownForce
from slipcore.forces.tracking.sensor import SensorResponse
from slipcore.forces.tracking.tracker import Tracker, lattice_of
from slipcore.frames import BoolArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class MarkerReading:
    """What markers show at one ``time`` s: ``moved`` [m] m, which of them were ``seen`` [m], and their ``noise`` m; and
    what is ``known`` of the resultant. ``data`` [m + 3] are both, with the last ones of what is not there.
    """

    time: float
    data: FloatArray
    seen: BoolArray
    noise: float
    known: KnownForce

    @property
    def moved(self) -> FloatArray:
        """Displacements, m."""
        return self.data[: len(self.seen)]

    @property
    def size(self) -> float:
        """Root mean square of the displacements, m."""
        return float(np.sqrt(np.mean(self.moved**2)))


@dataclass(frozen=True, slots=True, eq=False)
class Prepared:
    """The operator by which pressed nodes are found where depth is seen, for this ``noise`` m and ``typical`` m."""

    lattice: WholeLattice
    noise: float
    typical: float

    @classmethod
    def of(cls, sensor: SensorResponse, noise: float, typical: float) -> "Prepared":
        """For displacements that are as large as this, or as is expected."""
        typical = max(typical, FORCE_STREAM.typical * noise)
        return cls(lattice_of(sensor, noise, typical), noise, typical)

    def fits(self, frame: MarkerReading) -> bool:
        """Whether it still does for a frame."""
        change = max(frame.noise / self.noise, self.noise / frame.noise)
        return change <= FORCE_STREAM.noise_change and frame.size <= FORCE_STREAM.lattice_growth * self.typical


@dataclass(frozen=True, slots=True, eq=False)
class ContactTracking:
    """What is known of a ``sensor``, and while something touches, of its contact: ``reader`` of forces by the frame at
    ``time`` s, and the ``size`` m of displacements by which the ``tracker`` began. ``wider``: tractions on a contact
    that has grown since, where depth is not seen.
    """

    sensor: SensorResponse
    prepared: Prepared | None = None
    tracker: Tracker | None = None
    reader: Reader | None = None
    wider: TractionMean | None = None
    time: float = 0.0
    size: float = 0.0

    @property
    def is_ready(self) -> bool:
        """Whether all is made that is made before a touch."""
        return self.prepared is not None or not self.sensor.sees_depth

    def untouched(self) -> "ContactTracking":
        """Of the sensor alone."""
        return ContactTracking(self.sensor, self.prepared)

    def next_look(self, frame: MarkerReading, touched: bool) -> "Callable[[], ContactTracking] | None":
        """What is to be found out next, if anything; it takes its time, and changes nothing that is there."""
        if self.sensor.sees_depth and (self.prepared is None or not self.prepared.fits(frame)):
            return partial(self._prepare, frame)
        if not touched:
            return None
        in_plane = not self.sensor.sees_depth
        growth = FORCE_STREAM.growth_in_plane if in_plane else FORCE_STREAM.growth
        if self.tracker is None or frame.size > growth * self.size:
            return partial(self._begin, frame)
        return None if self.holds(frame) else partial(self._follow, self.tracker, frame)

    def holds(self, frame: MarkerReading) -> bool:
        """Whether the contact is that of a frame in which something touches, too."""
        return self.tracker is not None and self.tracker.key.holds(self._observation(frame), frame.data)

    def read(self, reader: Reader, frame: MarkerReading, grid: tuple[int, int]) -> FrameForces:
        """Forces on elements of this ``grid`` in a frame; less sure once markers have moved on from its contact."""
        return reader.read(frame.data, grid, wider=None if self.holds(frame) else self.wider)

    def _observation(self, frame: MarkerReading) -> ObservationModel:
        return self.sensor.observation(error(frame.moved, frame.seen, frame.noise), frame.known)

    def _prepare(self, frame: MarkerReading) -> "ContactTracking":
        return replace(self, prepared=Prepared.of(self.sensor, frame.noise, frame.size))

    def _begin(self, frame: MarkerReading) -> "ContactTracking":
        lattice = None if self.prepared is None else self.prepared.lattice
        tracker = Tracker.of(self.sensor, self._observation(frame), frame.data, "evidence", lattice)
        return replace(self._by(tracker, frame), size=frame.size)

    def _follow(self, tracker: Tracker, frame: MarkerReading) -> "ContactTracking":
        return self._by(tracker.at(self._observation(frame), frame.data), frame)

    def _by(self, tracker: Tracker, frame: MarkerReading) -> "ContactTracking":
        reader, wider = Reader.of(self.sensor, tracker.key), None if self.sensor.sees_depth else tracker.wider()
        return replace(self, tracker=tracker, reader=reader, wider=wider, time=frame.time)


def bytes_needed(position: FloatArray, element_area: float) -> int:
    """What a sensor with markers at ``position`` [n, m, 3] m takes that sees depth, without a contact's own.

    Raises ``InvalidInput`` where elements are far smaller than the markers lie apart.
    """
    place = position[..., :2].reshape(-1, 2)
    nodes, elements = len(Nodes.around(place, element_area)), len(place)
    observed, over_elements, lattice = 18 * (elements + 1) * nodes, 2 * elements * nodes, 3 * elements * nodes
    return (observed + over_elements + lattice) * position.itemsize
