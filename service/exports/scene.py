"""What every viewer is shown of a log: states and colours of the elements, arrows, resultants, and patches."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from service.exports import DetectedLog
from slipcore.frames import FloatArray, GraspLog
from slipcore.slip_state import SlipHistory

COLOURS = np.array([[139, 148, 158, 64], [0, 114, 178, 255], [213, 94, 0, 255]], np.uint8)
"""Of an element without contact, one that sticks and one that slips: red, green, blue and opacity, told apart by the
colour-blind (Okabe & Ito, 2008)."""

LONGEST = 2.0
"""Cells of the lattice that the longest arrow spans."""


@dataclass(frozen=True, slots=True, eq=False)
class Arrows:
    """From where to where the arrows go: ``begin`` and ``end`` [t, n, m, 3] m; the longest stands for ``longest``.

    ``what``: tangential force, measured or reconstructed, or displacement where no force is known.
    """

    begin: FloatArray
    end: FloatArray
    longest: float
    what: str
    unit: str


def arrows(recording: DetectedLog) -> Arrows:
    """Tangential force of each element or, where none is known, its displacement; on the lattice at rest."""
    log = recording.log
    force = "reconstructed tangential force" if log.has_reconstructed_force else "tangential force"
    what, unit, vectors = ("displacement", "m", log.displacement) if log.force is None else (force, "N", log.force)
    flat = vectors * [1.0, 1.0, 0.0]
    in_contact = np.where(recording.history.contact, np.linalg.norm(flat, axis=-1), 0.0)
    longest = float(in_contact.max(initial=0.0))
    scale = LONGEST * np.sqrt(log.element_area) / (longest or 1.0)
    begin = np.broadcast_to(log.position, vectors.shape)
    return Arrows(begin, begin + scale * flat, longest, what, unit)


def normal_force(log: GraspLog) -> FloatArray:
    """Resultant [t] N along the sensor's normal; NaN without forces."""
    return np.full(len(log), np.nan) if log.force is None else np.abs(log.force[..., 2].sum(axis=(1, 2)))


def tangential_force(log: GraspLog) -> FloatArray:
    """Resultant [t] N across it; NaN without forces."""
    if log.force is None:
        return np.full(len(log), np.nan)
    return np.asarray(np.hypot(*np.moveaxis(log.force[..., :2].sum(axis=(1, 2)), -1, 0)))


def patches_at(history: SlipHistory, frame: int) -> Iterator[tuple[float, float, str]]:
    """Centre x and y, m, and regime of each contact patch in a frame."""
    for patch in history.patches:
        k = frame - patch.first
        if 0 <= k < len(patch.pose) and np.isfinite(patch.pose[k, :2]).all():
            yield float(patch.pose[k, 0]), float(patch.pose[k, 1]), str(patch.regime[k])
