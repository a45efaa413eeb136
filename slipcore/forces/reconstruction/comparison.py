"""A sensor's own forces beside those that follow from the displacement of its markers."""

from dataclasses import dataclass

import numpy as np

from slipcore.arguments import of_kind
from slipcore.errors import InvalidInput, NoForces
from slipcore.forces.reconstruction.whole_log import Reconstruction
from slipcore.frames import FloatArray, GraspLog


@dataclass(frozen=True, slots=True)
class Agreement:
    """How own forces agree with reconstructed ones: the ``ratio`` own over reconstructed that fits best by least
    squares, and the ``correlation`` -1 to 1 of the two about zero. NaN where either is zero throughout.
    """

    ratio: float
    correlation: float


@dataclass(frozen=True, slots=True)
class ForceComparison:
    """Agreement of normal and of tangential forces: of single elements, and of their sums over all elements of a frame.

    All ratios alike: Young's modulus is wrong by that factor. A ratio of normal forces other than that of tangential
    ones: thickness or Poisson's ratio is wrong, or the sensor's own forces are. A correlation well below 1: they are
    not the same field.
    """

    normal: Agreement
    tangential: Agreement
    total_normal: Agreement
    total_tangential: Agreement


def compare_forces(log: GraspLog, reconstruction: Reconstruction) -> ForceComparison:
    """How a log's own forces agree with ``reconstruction`` of the same log, along the sensor's axes.

    Raises ``NoForces`` for a log without forces of its own, and ``InvalidInput`` where the reconstruction is of another
    log.
    """
    of_kind("log", log, GraspLog)
    of_kind("reconstruction", reconstruction, Reconstruction)
    if log.force is None:
        raise NoForces("forces are compared with a sensor's own, and the log has none")
    own, found = log.force, reconstruction.force
    if own.shape != found.shape:
        raise InvalidInput("reconstruction", f"of shape {list(found.shape)}", f"that of the log, {list(own.shape)}")
    own_total, found_total = own.sum(axis=(1, 2)), found.sum(axis=(1, 2))
    return ForceComparison(
        _agreement(own[..., 2], found[..., 2]),
        _agreement(own[..., :2], found[..., :2]),
        _agreement(own_total[:, 2], found_total[:, 2]),
        _agreement(own_total[:, :2], found_total[:, :2]),
    )


def _agreement(own: FloatArray, found: FloatArray) -> Agreement:
    a, b = own.ravel(), found.ravel()
    size, other = float(np.linalg.norm(a)), float(np.linalg.norm(b))
    if not size or not other:
        return Agreement(float("nan"), float("nan"))
    correlation = float((a / size) @ (b / other))  # neither squares of small forces nor of large ones
    return Agreement(correlation * size / other, correlation)
