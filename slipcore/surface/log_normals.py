"""Normals over a whole log, at which its forces are split."""

from dataclasses import replace

import numpy as np

from slipcore.frames import FloatArray, GraspLog
from slipcore.surface.strain import Lattice


def normals_of(log: GraspLog) -> FloatArray:
    """Outward normals [t, n, m, 3] of a log; where it has none, those at which its forces are given: of the surface at
    rest, or of the deformed one where its forces are seen to turn with it (``turning``). Without forces the latter.

    Raises ``InvalidInput`` where such a log has no lattice from which a shape follows.
    """
    if log.normal is not None:
        return log.normal
    shape = normals_of_shape(log.position, log.displacement)
    if log.force is None or _turn(log, shape):
        return shape
    return np.broadcast_to(normals_at_rest(log.position), log.force.shape)


def with_normals(log: GraspLog) -> GraspLog:
    """The log with the normals at which its forces are split; the same where it has these, or no forces to split."""
    if log.force is None or log.normal is not None or not log.has_displacement:
        return log
    return replace(log, normal=normals_of(log))


def normals_at_rest(position: FloatArray) -> FloatArray:
    """Outward normals [n, m, 3] of a surface whose markers lie at rest at ``position`` [n, m, 3] m; raises as above."""
    (normal,) = normals_of_shape(position, np.zeros((1, *np.shape(position))))
    return np.asarray(normal)


def normals_of_shape(position: FloatArray, displacement: FloatArray) -> FloatArray:
    """Outward normals [t, n, m, 3] of the surface whose markers are displaced [t, n, m, 3] from ``position``, m.

    Raises ``InvalidInput`` where there is no lattice from which a shape follows.
    """
    from slipcore.surface.normals import normals_over_time  # compiled: who only holds samples goes without

    lattice = Lattice.at_rest(position)
    normals = np.empty_like(displacement)
    normals_over_time(lattice.steps, lattice.orientation, displacement, normals)
    return normals


def _turn(log: GraspLog, shape: FloatArray) -> bool:
    """Whether the forces of a log turn with its ``shape``: normals [t, n, m, 3]."""
    from slipcore.noise import estimate_noise  # compiled, as above
    from slipcore.surface.turning import SUMS, turning_over_time, turns

    assert log.force is not None
    sums = np.zeros(SUMS)
    turning_over_time(log.position, normals_at_rest(log.position), shape, log.force, sums)
    noise = float(estimate_noise(log.time, log.force[..., 2].reshape(len(log), 1, -1)))
    return turns(sums, noise, did=False)
