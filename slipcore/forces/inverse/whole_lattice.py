"""Pressure anywhere under the lattice, by one linear operator: for markers that also show their depth.

With depth the problem is well-posed without knowing where the object touches, so one matrix, made once, shows in every
frame where that is. In-plane markers alone need the contact first: shear that spreads from a point looks like pressure.
"""

from dataclasses import dataclass

import numpy as np

from slipcore.forces.defaults import LATTICE
from slipcore.forces.inverse.covariance import covariance_root, solve_root
from slipcore.forces.inverse.fit import ObservationModel
from slipcore.forces.inverse.prior import Smoothness, factors
from slipcore.forces.operator.nodes import Nodes
from slipcore.frames import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class WholeLattice:
    """``operator`` [k, m] from displacement to the pressures at all nodes; ``deviation`` [k] of these."""

    operator: FloatArray
    deviation: FloatArray


def whole_lattice(observation: ObservationModel, nodes: Nodes, typical: float, shape: Smoothness) -> WholeLattice:
    """The operator for displacements of the root mean square ``typical`` m, under a prior of this ``shape``."""
    m = len(observation.noise)
    root = factors(nodes.places(), nodes.grid.pitch[0], shape)
    whitened = observation.response / observation.noise[:, None, None]
    spread = np.stack([whitened[:, axis] @ root[axis] for axis in range(3)], axis=1)
    level = typical / float(np.median(observation.noise))
    strength = LATTICE.concentration * level * np.sqrt(m) / float(np.linalg.norm(spread))
    upper = covariance_root(strength * spread.reshape(m, -1))
    by_pressure, pressure = strength * spread[:, 2], strength * root[2]
    seen = solve_root(upper, by_pressure, transposed=True)
    gain = solve_root(upper, seen)
    variance = np.sum(pressure**2, axis=1) - np.sum((pressure @ seen.T) ** 2, axis=1)
    return WholeLattice(pressure @ gain.T / observation.noise, np.sqrt(np.maximum(variance, 0.0)))
