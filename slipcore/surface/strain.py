"""Surface strain from marker displacement on a lattice (stage 2: strain).

Components stand in front and the lattice behind: a strain is ``[3, n, m]`` in the order xx, yy, xy. What is taken from
a displacement starts with its ``lattice_steps`` [2, 3, n, m], worked out once a frame.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slipcore.defaults import LIMITS
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray, check_position


@dataclass(frozen=True, slots=True, eq=False)
class Lattice:
    """The markers at rest and how their rows and columns lie in the sensor's plane.

    ``position`` [n, m, 3] m and its ``steps`` [2, 3, n, m] m; ``inverse_jacobian`` [2, 2, n, m] 1/m of these steps in
    the plane; ``orientation`` +1 or −1: the handedness of (row, column) in (x, y).
    """

    position: FloatArray
    steps: FloatArray
    inverse_jacobian: FloatArray
    orientation: float

    @classmethod
    def at_rest(cls, position: ArrayLike) -> "Lattice":
        """Lay out the markers at rest; rows and columns may be flipped, rotated, curved or unevenly spaced.

        Raises ``InvalidInput`` for fewer than 2 × 2 markers, a folded lattice and what ``check_position`` refuses.
        """
        rest = check_position(position)
        if min(rest.shape[:2]) < 2:
            raise InvalidInput("position", f"{rest.shape[0]} × {rest.shape[1]} markers", "at least 2 × 2 markers")
        steps = lattice_steps(rest)
        (x_i, y_i, _), (x_j, y_j, _) = steps
        determinant = x_i * y_j - x_j * y_i
        orientation = _orientation(determinant, x_i**2 + y_i**2 + x_j**2 + y_j**2)
        inverse = np.array([[y_j, -x_j], [-y_i, x_i]]) / determinant
        steps.flags.writeable = inverse.flags.writeable = False
        return cls(rest, steps, inverse, orientation)

    @property
    def strain_noise(self) -> FloatArray:
        """Noise of the strain's Frobenius norm for marker noise of 1 m: [n, m], 1/m.

        Each difference carries √2 σ; summed over xx, yy and twice xy (half a sum of two) this is σ √3 ‖J⁻¹‖_F (but for
        skewed corners, whose two differences share a marker).
        """
        noise: FloatArray = np.sqrt(3.0 * (self.inverse_jacobian**2).sum(axis=(0, 1)))
        return noise


@lru_cache(maxsize=64)
def _neighbours(size: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    index = np.arange(size)
    return np.minimum(index + 1, size - 1), np.maximum(index - 1, 0)


def lattice_steps(field: FloatArray) -> FloatArray:
    """Differences of a field [n, m, 3] along rows and along columns: [2, 3, n, m].

    Central, (i+1) − (i−1), inside and one-sided at the edges, as the numerators and denominators of the paper's
    eq. 27 (with its y row corrected): the step's length cancels in the quotient.
    """
    components = np.ascontiguousarray(field.transpose(2, 0, 1))
    steps = np.empty((2, *components.shape))
    for along, axis in enumerate((1, 2)):
        ahead, behind = _neighbours(components.shape[axis])
        np.subtract(components.take(ahead, axis), components.take(behind, axis), out=steps[along])
    return steps


def displacement_gradient(lattice: Lattice, steps: FloatArray) -> FloatArray:
    """Gradient ∂u_a/∂x_b, [2, 2, n, m] with a before b, of a displacement with the given ``lattice_steps``.

    The paper's eq. 27 generalised with the Jacobian of the rest positions; exact for affine fields on any lattice.
    """
    rows, columns = lattice.inverse_jacobian
    gradient: FloatArray = steps[0, :2, None] * rows + steps[1, :2, None] * columns
    return gradient


def green_lagrange(gradient: FloatArray) -> FloatArray:
    """Green–Lagrange strain ½(G + Gᵀ + GᵀG) of a gradient [2, 2, ...]: [3, ...] as xx, yy, xy (paper, eq. 28–30)."""
    (ux_x, ux_y), (uy_x, uy_y) = gradient
    strain = np.empty((3, *ux_x.shape))
    strain[0] = ux_x + 0.5 * (ux_x * ux_x + uy_x * uy_x)
    strain[1] = uy_y + 0.5 * (ux_y * ux_y + uy_y * uy_y)
    strain[2] = 0.5 * (ux_y + uy_x + ux_x * ux_y + uy_x * uy_y)
    return strain


def principal_strains(strain: FloatArray) -> FloatArray:
    """Principal strains ε₁ ≥ ε₂ of a strain [3, ...]: [2, ...] (paper, eq. 31), in closed form.

    The larger in magnitude is a sum of equal signs; the other follows from the determinant, because their difference
    from the mean would cancel where one is much smaller than the other.
    """
    xx, yy, xy = strain
    mean = 0.5 * (xx + yy)
    larger = mean + np.copysign(np.hypot(0.5 * (xx - yy), xy), mean)
    quotient = np.divide(yy, larger, out=np.zeros_like(larger), where=larger != 0.0)
    shear = np.divide(xy, larger, out=np.zeros_like(larger), where=larger != 0.0)
    other = xx * quotient - xy * shear  # divided first: the determinant itself would underflow
    return np.stack([np.maximum(larger, other), np.minimum(larger, other)])


def inclination_factor(normal: FloatArray) -> FloatArray:
    """Factor 1/(ẑ·n) that turns strain seen along z into strain on the inclined surface: [n, m] (paper, eq. 33).

    ``normal`` [n, m, 3]. Bounded by ``LIMITS.inclination``: on a nearly vertical face the markers say nothing.
    """
    factor: FloatArray = 1.0 / np.maximum(normal[..., 2], 1.0 / LIMITS.inclination)
    return factor


def frobenius(strain: FloatArray) -> FloatArray:
    """Frobenius norm of a symmetric tensor [3, ...]: [...]; equals √(ε₁² + ε₂²)."""
    xx, yy, xy = strain
    norm: FloatArray = np.sqrt(xx * xx + yy * yy + 2.0 * xy * xy)
    return norm


def literal_rate(before: FloatArray, after: FloatArray, interval: float) -> FloatArray:
    """Rate measure δ = √(e₁² + e₂²), 1/s, from principal strains [2, ...] ``interval`` s apart (paper, eq. 34–35)."""
    first, second = (after - before) / interval
    measure: FloatArray = np.hypot(first, second)
    return measure


def _orientation(determinant: FloatArray, size: FloatArray) -> float:
    orientation = 1.0 if np.median(determinant) >= 0.0 else -1.0
    bad = orientation * determinant <= LIMITS.coincidence * size
    if bad.any():
        index = tuple(int(k) for k in np.argwhere(bad)[0])
        raise InvalidInput("position", f"folded or in one line at marker {index}", "rows and columns that cross")
    return orientation
