"""Traction anywhere under the lattice, by one linear operator: for markers that also tell their depth.

With depth the problem is well-posed without knowing where the object touches, so one matrix, made once, gives every
frame's forces. In-plane markers alone need the contact first: shear that spreads from a point looks like pressure.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from slipcore.forces.covariance import covariance_root
from slipcore.forces.defaults import LATTICE
from slipcore.forces.fit import Observation
from slipcore.forces.nodes import Nodes
from slipcore.forces.prior import factors, usual
from slipcore.frames import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class WholeLattice:
    """``operator`` [3, k, m] from displacement to tractions at all nodes; ``deviation`` [3, k] of these."""

    operator: FloatArray
    deviation: FloatArray


def whole_lattice(observation: Observation, nodes: Nodes, typical: float) -> WholeLattice:
    """The operator for displacements of the root mean square ``typical`` m."""
    m, _, k = observation.response.shape
    root = factors(nodes.places(), nodes.grid.pitch[0], usual())
    whitened = observation.response / observation.noise[:, None, None]
    spread = np.concatenate([whitened[:, axis] @ root[axis] for axis in range(3)], axis=1)
    level = typical / float(np.median(observation.noise))
    strength = LATTICE.concentration * level * np.sqrt(m) / float(np.linalg.norm(spread))
    upper = covariance_root(strength * spread)
    seen = scipy.linalg.solve_triangular(upper, strength * spread, trans="T", check_finite=False)
    gain = scipy.linalg.solve_triangular(upper, seen, check_finite=False)
    parts = [strength * (root[axis] @ gain[:, axis * k : (axis + 1) * k].T) for axis in range(3)]
    deviation = [_deviation(strength * root[axis], seen[:, axis * k : (axis + 1) * k]) for axis in range(3)]
    return WholeLattice(np.stack(parts) / observation.noise, np.stack(deviation))


def _deviation(root: FloatArray, seen: FloatArray) -> FloatArray:
    """Posterior standard deviations [k]: prior variance less what the data explain."""
    explained = np.sum((root @ seen.T) ** 2, axis=1)
    return np.asarray(np.sqrt(np.maximum(np.sum(root**2, axis=1) - explained, 0.0)))
