"""Normals of the surface over a whole log."""

import numpy as np

from slipcore.frames import FloatArray, GraspLog
from slipcore.surface.strain import Lattice


def normals_of(log: GraspLog) -> FloatArray:
    """Outward normals [t, n, m, 3] of a log, from the deformed shape where it has none.

    Raises ``InvalidInput`` where such a log has no lattice from which a shape follows.
    """
    return log.normal if log.normal is not None else normals_of_shape(log.position, log.displacement)


def normals_of_shape(position: FloatArray, displacement: FloatArray) -> FloatArray:
    """Outward normals [t, n, m, 3] of the surface whose markers are displaced [t, n, m, 3] from ``position``, m.

    Raises ``InvalidInput`` where there is no lattice from which a shape follows.
    """
    from slipcore.surface.normals import normals_over_time  # compiled: who only holds samples goes without

    lattice = Lattice.at_rest(position)
    normals = np.empty_like(displacement)
    normals_over_time(lattice.steps, lattice.orientation, displacement, normals)
    return normals
