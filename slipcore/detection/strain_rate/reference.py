"""The strain rate of a frame in numpy: what the compiled step is tested against, and what figures of the paper draw.

Nothing that detects slip uses it.
"""

import numpy as np

from slipcore.frames import FloatArray
from slipcore.surface.strain import (
    Lattice,
    displacement_gradient,
    frobenius,
    green_lagrange,
    inclination_factor,
)


def surface_normal(lattice: Lattice, steps: FloatArray) -> FloatArray:
    """Outward unit normal [n, m, 3] of the surface displaced with the given ``lattice_steps`` (paper, eq. 32).

    Zero where markers have come to lie in one line.
    """
    (x_i, y_i, z_i), (x_j, y_j, z_j) = lattice.steps + steps
    normal = np.empty((*x_i.shape, 3))
    normal[..., 0] = y_i * z_j - z_i * y_j
    normal[..., 1] = z_i * x_j - x_i * z_j
    normal[..., 2] = x_i * y_j - y_i * x_j
    length = np.sqrt(np.vecdot(normal, normal))
    length[length == 0.0] = np.inf
    normal *= (lattice.orientation / length)[..., None]
    return normal


def surface_strain(lattice: Lattice, steps: FloatArray, normal: FloatArray) -> FloatArray:
    """Green–Lagrange strain corrected for inclination: [3, n, m] (paper, eq. 27–33)."""
    return green_lagrange(displacement_gradient(lattice, steps)) * inclination_factor(normal)


def signed_rate(strain: FloatArray, rate: FloatArray) -> FloatArray:
    """Rate measure ‖Ė‖_F · sign(E:Ė), 1/s: positive while the strain grows, negative while it falls,
    zero at zero strain.

    ``strain`` [3, ...] and ``rate`` [3, ...] 1/s. In place of the paper's eq. 35, which is never negative and, made
    of sorted principal values, loses the rotation of the principal axes.
    """
    xx, yy, xy = strain * rate
    measure: FloatArray = frobenius(rate) * np.sign(xx + yy + 2.0 * xy)
    return measure
