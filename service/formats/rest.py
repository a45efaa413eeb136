"""Where markers are at rest: in a frame that is chosen, or in a recording of the sensor alone (docs/formats.md)."""

from dataclasses import dataclass

import numpy as np

from service.formats.members import Members
from slipcore.errors import InvalidInput
from slipcore.frames import BoolArray, FloatArray, GraspLog

FIRST, LEAST_CONTACT = "first", "least contact"
ALL_FRAMES = "all frames"
"""As of a recording of the sensor alone, which nobody says of a log: places count from their median, and displacement
as it is.
"""
ALLOWED = f"{FIRST}, {LEAST_CONTACT}, or the number of a frame from 0 (local commands: or a file)"
MOST_DIGITS = 9
NEIGHBOUR = 1.25
"""-, of the usual distance to the nearest marker, up to which markers are neighbours: more than a lattice's sides
scatter by, less than a square's diagonal of 1.41.
"""
IRREGULAR = 0.1
"""-, standard deviation of that distance over its mean, above which dots are on no lattice: printed or moulded ones
scatter by far less, dots strewn at random by 0.5.
"""


def check(rest: str) -> str:
    """One of the words, or a number as text; raises ``InvalidInput``."""
    text = rest.strip().lower()
    if text in (FIRST, LEAST_CONTACT) or (text.isascii() and text.isdecimal() and len(text) <= MOST_DIGITS):
        return text
    raise InvalidInput("rest", repr(rest)[:60], ALLOWED)


def frame_of(rest: str, frames: int, load: FloatArray | None, place: FloatArray) -> int:
    """The frame that ``rest`` names, of so many; the first of those with the least ``load`` [t] where it is the least
    contact, or of those in which a lattice of markers ``place`` [t, k, 3] is stretched least.

    Raises ``InvalidInput`` for a number that is none of a frame, and where nothing shows contact.
    """
    text = check(rest)
    if text == LEAST_CONTACT and load is not None and len(load) != frames:
        raise InvalidInput("rest", f"{LEAST_CONTACT}, of {len(load)} frames", f"{frames} frames, as displacement")
    if text == LEAST_CONTACT:
        return int(np.argmin(stretch(place) if load is None else load))
    frame = 0 if text == FIRST else int(text)
    if frame >= frames:
        raise InvalidInput("rest", f"frame {frame} of {frames}", f"0 to {frames - 1}")
    return frame


@dataclass(frozen=True, slots=True, eq=False)
class SensorAlone:
    """A recording of the sensor alone: ``position`` and median ``displacement`` [n, m, 3] m of its elements, of which
    those ``known`` [n, m] were observed, and the ``name`` of its file.
    """

    position: FloatArray
    displacement: FloatArray
    known: BoolArray
    name: str

    @classmethod
    def of(cls, log: GraspLog, name: str) -> "SensorAlone":
        """As a log that was read with ``ALL_FRAMES`` at rest has it."""
        seen = np.ones(log.displacement.shape[:-1], bool) if log.observed is None else log.observed
        return cls(log.position, *unmoved(log.displacement, seen), name)

    def zero(self, shape: tuple[int, ...], places: bool) -> tuple[FloatArray, BoolArray]:
        """What counts as 0 of a log's ``places``, or displacement, of this shape; raises ``InvalidInput``."""
        if self.position.shape != shape:
            raise InvalidInput("rest", f"a file of {self.known.shape} elements", f"{shape[:-1]}, as the log")
        return (self.position if places else self.displacement), self.known


def unmoved(moved: FloatArray, seen: BoolArray) -> tuple[FloatArray, BoolArray]:
    """Median over frames of what elements ``moved`` [t, n, m, c] where they were ``seen`` [t, n, m], and which were
    seen at all [n, m]; of the others it is 0.
    """
    ever = np.asarray(seen.any(axis=0))
    rest: FloatArray = np.zeros(moved.shape[1:])
    rest[ever] = np.nanmedian(np.where(seen[..., None], moved, np.nan)[:, ever], axis=0)
    return rest, ever


def load_of(members: Members) -> FloatArray | None:
    """How much touches in each frame [t]: elements in contact, or force, or the gripper's; None where none is known."""
    for name in ("contact", "force", "gripper_force"):
        if name in members and np.ndim(members[name]):  # one number for all frames says nothing of rest
            load = np.abs(np.asarray(members[name], dtype=np.float64))
            return np.asarray(np.nan_to_num(load).reshape(len(load), -1).sum(axis=1))
    return None


def stretch(place: FloatArray) -> FloatArray:
    """Sum of squared distances [t] of neighbouring markers ``place`` [t, k, 3] of a lattice.

    Of places x + u it is that at rest, plus Σ|δu|², plus 2 Σ δx·δu, which on a lattice telescopes to its border: least
    at rest where the border stands still. Raises ``InvalidInput`` for markers on no lattice, whose distances show none.
    """
    from scipy.spatial import cKDTree

    seen = place[:, np.isfinite(place).all(axis=(0, 2))]
    if seen.shape[1] < 4:
        raise InvalidInput("rest", f"{LEAST_CONTACT}, with {seen.shape[1]} markers never lost", ALLOWED)
    usual = np.median(seen, axis=0)
    nearest = np.asarray(cKDTree(usual).query(usual, k=2)[0])[:, 1]
    if nearest.std() > IRREGULAR * nearest.mean():
        raise InvalidInput("rest", f"{LEAST_CONTACT}, of dots on no lattice without contact or force", ALLOWED)
    pairs = cKDTree(usual).query_pairs(NEIGHBOUR * float(np.median(nearest)), output_type="ndarray")
    return np.asarray(((seen[:, pairs[:, 0]] - seen[:, pairs[:, 1]]) ** 2).sum(axis=(1, 2)))
