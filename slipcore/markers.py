"""Tracked dots without a lattice, laid onto one, once, before the detector (stage 1: frames).

Each element *is* one marker, at the marker's own place: nothing is interpolated. An element without a marker, or whose
marker is lost in a frame, is not observed. Its displacement then is a placeholder that moves on as the markers around
it do, so that its neighbours' derivatives and a detector's memory stay sound; a detector says nothing of it.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import binary_dilation, binary_fill_holes, generate_binary_structure
from scipy.spatial import ConvexHull, QhullError, cKDTree

from slipcore.defaults import MARKERS
from slipcore.errors import InvalidInput
from slipcore.frames import UNNAMED, BoolArray, FloatArray, GraspLog
from slipcore.surface.strain import lattice_steps


class MarkerFrame(NamedTuple):
    """A frame laid onto the lattice: ``displacement`` [n, m, 3] m, ``observed`` [n, m], and ``markers`` [k, 3] m, the
    displacement of every marker with placeholders for the lost ones.
    """

    displacement: FloatArray
    observed: BoolArray
    markers: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class MarkerLattice:
    """Which marker each element takes, and where it is at rest.

    ``position`` [n, m, 3] m; ``element_area`` m²; ``marker`` [n, m], the index of an element's marker (where it has
    none of its own, of the nearest); ``occupied`` [n, m]: whether it has; ``neighbours`` [k, K] of each of the k
    markers, nearest first, and their ``weight`` [k, K] when it is lost.
    """

    position: FloatArray
    element_area: float
    marker: NDArray[np.intp]
    occupied: BoolArray
    neighbours: NDArray[np.intp]
    weight: FloatArray

    @classmethod
    def over(cls, markers: ArrayLike) -> "MarkerLattice":
        """Lay a lattice along x and y over markers at rest [k, 3] m, with about as many elements as markers.

        Markers that no element takes are left out. Raises ``InvalidInput`` for fewer than four markers, for markers in
        one line, and for numbers that are not finite.
        """
        rest = np.array(markers, dtype=np.float64)
        if rest.ndim != 2 or rest.shape[1:] != (3,) or len(rest) < 4 or not np.isfinite(rest).all():
            raise InvalidInput("markers", f"of shape {list(rest.shape)}", "4 or more finite points, shape [k, 3]")
        pitch = mean_spacing(rest[:, :2])
        places = _places(rest[:, :2], pitch)
        marker, own = _assign(rest[:, :2], places, MARKERS.farthest * pitch)
        position, occupied = _positions(rest, marker, own, places)
        return cls(position, pitch**2, marker, occupied, *_neighbours(rest[:, :2], MARKERS.reach * pitch))

    def step(self, before: MarkerFrame | None, displacement: ArrayLike) -> MarkerFrame:
        """Take the markers' next displacement [k, 3] m, NaN where one is lost. Raises ``InvalidInput``."""
        moved = np.array(displacement, dtype=np.float64)
        if moved.shape != (len(self.weight), 3):
            raise InvalidInput("displacement", f"of shape {list(moved.shape)}", f"shape {[len(self.weight), 3]}")
        seen: BoolArray = np.asarray(np.isfinite(moved).all(axis=1))
        last = np.zeros_like(moved) if before is None else before.markers
        change = np.where(seen[:, None], moved - last, 0.0)
        moved[~seen] = last[~seen] + self._change_around(change, seen)[~seen]
        return MarkerFrame(moved[self.marker], self.occupied & seen[self.marker], moved)

    def _change_around(self, change: FloatArray, seen: BoolArray) -> FloatArray:
        """Mean change [k, 3] of the markers seen around each; 0 where none is."""
        weight = np.where(seen[self.neighbours], self.weight, 0.0)
        total = np.maximum(weight.sum(axis=1), np.finfo(float).tiny)
        mean: FloatArray = np.einsum("jk,jkc->jc", weight, change[self.neighbours]) / total[:, None]
        return mean


def on_lattice(
    time: ArrayLike,
    markers: ArrayLike,
    displacement: ArrayLike,
    contact: ArrayLike | None = None,
    sensor: str = UNNAMED,
    metadata: Mapping[str, str] | None = None,
) -> tuple[GraspLog, MarkerLattice]:
    """A grasp log of tracked dots, and the lattice that it lies on, which names each element's marker.

    ``time`` [t] s; ``markers`` [k, 3] m at rest; ``displacement`` [t, k, 3] m, NaN where a marker is lost; ``contact``
    [t, k] bool where it is known, as it must be for markers that are seen from above only: their displacement along z
    is 0 then, and shows no contact. Raises ``InvalidInput``.
    """
    lattice = MarkerLattice.over(markers)
    frames = list(_frames(lattice, np.asarray(displacement, dtype=np.float64)))
    log = GraspLog(
        time=np.asarray(time),
        position=lattice.position,
        displacement=np.stack([frame.displacement for frame in frames]),
        element_area=lattice.element_area,
        sensor=sensor,
        metadata=metadata or {},
        contact=None if contact is None else np.asarray(contact, dtype=bool)[:, lattice.marker],
        observed=np.stack([frame.observed for frame in frames]),
    )
    return log, lattice


def contact_by_motion(time: FloatArray, displacement: FloatArray) -> BoolArray:
    """Which elements [t, n, m] touch, of displacements [t, n, m, 3] m that are seen in the plane only.

    A body takes along what it touches, and the gel around it lags behind: under a rigid punch to ¾ a tenth of its
    radius away, and at the rim of a sphere that is about to slide to ½ (Johnson, Contact Mechanics, §3.7 and §7.2). So
    those touch that move by more than a share of the largest motion, with all that they enclose; where nothing moves
    beyond noise, none. A contact as large as the sensor is found whole. Shares: ``defaults.MARKERS``.
    """
    from slipcore.noise import estimate_noise  # compiled

    plane = displacement[..., :2]
    noise = float(np.nan_to_num(estimate_noise(time, plane.reshape(len(time), -1, 2).swapaxes(1, 2))))
    return np.stack([taken_along(frame, noise) for frame in displacement])


def taken_along(displacement: FloatArray, noise: float) -> BoolArray:
    """The same of one frame's displacements [n, m, 3] m, of this ``noise`` m: [n, m]."""
    moved = np.hypot(displacement[..., 0], displacement[..., 1])
    largest = np.quantile(moved, MARKERS.touching_quantile)
    touching = (moved > MARKERS.touching_share * largest) & (largest > MARKERS.touching_noise * noise)
    return np.asarray(binary_fill_holes(touching))


def mean_spacing(markers: FloatArray) -> float:
    """Pitch m of the square lattice of as many points as markers [k, 2] m that has their hull's area.

    Raises ``InvalidInput`` for markers in one line.
    """
    try:
        area = ConvexHull(markers).volume
    except (QhullError, ValueError) as error:
        raise InvalidInput("markers", "in one line", "markers that span an area") from error
    return float(np.sqrt(area) / (np.sqrt(len(markers)) - 1.0))


def _frames(lattice: MarkerLattice, displacement: FloatArray) -> Iterator[MarkerFrame]:
    frame = None
    for moved in displacement:
        frame = lattice.step(frame, moved)
        yield frame


def _places(markers: FloatArray, pitch: float) -> FloatArray:
    """Lattice points [n, m, 2] m, centred in the markers' bounding box, which they must fill to some degree."""
    low, high = markers.min(axis=0), markers.max(axis=0)
    cells = np.maximum(np.rint((high - low) / pitch), 1.0)
    if not np.prod(cells + 1.0) <= MARKERS.sparsest * len(markers):
        value = f"{len(markers)} in a band across {cells[0] + 1:.0f} × {cells[1] + 1:.0f} places"
        raise InvalidInput("markers", value, f"one marker in {MARKERS.sparsest} places of their bounding box, or more")
    axes = [
        0.5 * (first + last) + pitch * (np.arange(count + 1.0) - 0.5 * count)
        for first, last, count in zip(low, high, cells, strict=True)
    ]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def _assign(markers: FloatArray, places: FloatArray, farthest: float) -> tuple[NDArray[np.intp], BoolArray]:
    """Marker of each place [n, m], and whether it is its own: pairs are taken nearest first."""
    flat = places.reshape(-1, 2)
    distance, index = _nearest(markers, flat, MARKERS.candidates)
    marker, own = np.array(index[:, 0], dtype=np.intp), np.zeros(len(flat), bool)
    free = np.ones(len(markers), bool)
    for pair in np.argsort(distance, axis=None, kind="stable")[: np.count_nonzero(distance <= farthest)]:
        place, candidate = divmod(int(pair), index.shape[1])
        if not own[place] and free[index[place, candidate]]:
            marker[place] = index[place, candidate]
            own[place], free[marker[place]] = True, False
    return marker.reshape(places.shape[:2]), own.reshape(places.shape[:2])


def _positions(
    markers: FloatArray, marker: NDArray[np.intp], own: BoolArray, places: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Positions [n, m, 3] m of the elements, and which keep their own marker: the others stand at their place.

    Where markers would fold the lattice, the one that is furthest from its place among those around is left out, until
    rows and columns cross everywhere.
    """
    position, occupied = markers[marker], own.copy()
    position[~own, :2] = places[~own]
    offset = np.hypot(*np.moveaxis(position[..., :2] - places, -1, 0))
    while (folded := _folded(position)).any():
        around = binary_dilation(folded, generate_binary_structure(2, 1))
        worst = np.unravel_index(np.argmax(np.where(around, offset, -1.0)), offset.shape)
        position[worst][:2], offset[worst], occupied[worst] = places[worst], -1.0, False
    return position, occupied


def _folded(position: FloatArray) -> BoolArray:
    """Where rows and columns [n, m] do not cross widely enough in the plane, from x to y."""
    (x_i, y_i, _), (x_j, y_j, _) = lattice_steps(position)
    folded: BoolArray = x_i * y_j - x_j * y_i <= MARKERS.narrowest * np.hypot(x_i, y_i) * np.hypot(x_j, y_j)
    return folded


def _neighbours(markers: FloatArray, reach: float) -> tuple[NDArray[np.intp], FloatArray]:
    """Nearest other markers [k, K] of each, and their biweight by distance."""
    distance, index = _nearest(markers, markers, MARKERS.neighbours + 1)
    return index[:, 1:], np.maximum(1.0 - (distance[:, 1:] / reach) ** 2, 0.0) ** 2


def _nearest(markers: FloatArray, places: FloatArray, most: int) -> tuple[FloatArray, NDArray[np.intp]]:
    """Distances [p, K] of the nearest markers of each place, nearest first, and which they are."""
    distance, index = cKDTree(markers).query(places, k=min(most, len(markers)))
    return np.asarray(distance), np.asarray(index, dtype=np.intp)
