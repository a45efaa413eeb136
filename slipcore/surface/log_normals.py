"""Normals of the surface over a whole log."""

import numpy as np

from slipcore.frames import FloatArray, GraspLog
from slipcore.surface.strain import Lattice


def normals_of(log: GraspLog) -> FloatArray:
    """Outward normals [t, n, m, 3] of a log, from the deformed shape where it has none.

    Raises ``InvalidInput`` where such a log has no lattice from which a shape follows.
    """
    if log.normal is not None:
        return log.normal
    from slipcore.surface.normals import normals_over_time  # compiled: who only holds samples goes without

    lattice = Lattice.at_rest(log.position)
    normals = np.empty_like(log.displacement)
    normals_over_time(lattice.steps, lattice.orientation, log.displacement, normals)
    return normals
