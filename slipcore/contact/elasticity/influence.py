"""Influence of one uniformly loaded rectangular cell on the surface of an elastic body.

Every influence on a half-space is an integral over the cell of one of five functions of the distance (Love 1929;
Johnson, Contact Mechanics, §3.3). Near the cell the integral is a sum over its corners. Far away that sum subtracts
nearly equal numbers and loses (distance / cell)² in precision, so there the integral is taken by Gauss quadrature,
which is exact to rounding and loses nothing.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, Protocol

import numpy as np

from slipcore.contact.defaults import INFLUENCE
from slipcore.contact.elasticity.grid import Grid
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray

Component = Literal["nn", "xx", "xy", "yy", "zx", "zy"]
"""``nn``: normal displacement by pressure; ``xx``, ``xy``, ``yy``: tangential by traction; ``zx``, ``zy``: normal by
traction (tangential by pressure is its negative). Even in x and y but for ``xy`` (odd in both), ``zx`` (in x), ``zy``
(in y)."""

Function = Callable[[FloatArray, FloatArray], FloatArray]


class ElasticBody(Protocol):
    """A body whose surface gives way under load; compliances of bodies and corrections to them add up."""

    def influence(self, component: Component, grid: Grid) -> FloatArray | None:
        """Displacement (m) by 1 Pa on one cell at the offsets of the first quadrant [ny, nx]; None where it is zero."""


@dataclass(frozen=True, slots=True)
class HalfSpace:
    """Elastic half-space (Boussinesq and Cerruti) of ``shear_modulus`` Pa and ``poisson`` ratio, z into the body.

    Reference: Johnson, Contact Mechanics, eq. 3.18 and 3.75.
    """

    shear_modulus: float
    poisson: float

    def __post_init__(self) -> None:
        if not 0.0 < self.shear_modulus < np.inf:
            raise InvalidInput("shear modulus", self.shear_modulus, "finite and above 0 Pa")
        if not 0.0 <= self.poisson <= 0.5:
            raise InvalidInput("Poisson's ratio", self.poisson, "0 to 0.5")

    @classmethod
    def from_young(cls, young: float, poisson: float) -> "HalfSpace":
        """The half-space of a given Young's modulus, Pa."""
        return cls(young / (2.0 * (1.0 + poisson)), poisson)

    def influence(self, component: Component, grid: Grid) -> FloatArray | None:
        """Displacement (m) by 1 Pa on one cell at the offsets of the first quadrant [ny, nx]; None where it is zero."""
        nu = self.poisson
        scale = 1.0 / (2.0 * np.pi * self.shear_modulus)
        match component:
            case "nn":
                return (1.0 - nu) * scale * cell_integral("r", grid)
            case "xx" | "yy":
                across = "yy" if component == "xx" else "xx"
                isotropic = scale * cell_integral("r", grid)
                return isotropic - nu * scale * cell_integral(across, grid) if nu else isotropic
            case "xy":
                return nu * scale * cell_integral("xy", grid) if nu else None
            case "zx" | "zy":
                return (0.5 - nu) * scale * cell_integral(component[1], grid) if nu != 0.5 else None


@dataclass(frozen=True, slots=True)
class Scaled:
    """A body ``factor`` times as compliant."""

    body: ElasticBody
    factor: float

    def influence(self, component: Component, grid: Grid) -> FloatArray | None:
        """Displacement (m) by 1 Pa on one cell at the offsets of the first quadrant [ny, nx]; None where it is zero."""
        influence = self.body.influence(component, grid)
        return None if influence is None else self.factor * influence


@dataclass(frozen=True, slots=True)
class MirroredBody:
    """A body on the other side of the contact: what pulls the finger to the right pulls it to the left."""

    body: ElasticBody

    def influence(self, component: Component, grid: Grid) -> FloatArray | None:
        """Displacement (m) by 1 Pa on one cell at the offsets of the first quadrant [ny, nx]; None where it is zero."""
        influence = self.body.influence(component, grid)
        return -influence if influence is not None and component in {"zx", "zy"} else influence


def _inverse_distance(x: FloatArray, y: FloatArray) -> FloatArray:
    return 1.0 / np.hypot(x, y)


def _along_x(x: FloatArray, y: FloatArray) -> FloatArray:
    return x / (x * x + y * y)


def _xx(x: FloatArray, y: FloatArray) -> FloatArray:
    xx: FloatArray = x * x / np.hypot(x, y) ** 3
    return xx


def _xy(x: FloatArray, y: FloatArray) -> FloatArray:
    xy: FloatArray = x * y / np.hypot(x, y) ** 3
    return xy


# Mixed antiderivatives ∂²F/∂x∂y of the above; corners never lie on an axis of the grid.


def _corner_xx(x: FloatArray, y: FloatArray) -> FloatArray:
    return y * np.arcsinh(x / np.abs(y))


def _corner_xy(x: FloatArray, y: FloatArray) -> FloatArray:
    return -np.hypot(x, y)


def _corner_inverse_distance(x: FloatArray, y: FloatArray) -> FloatArray:
    return _corner_xx(x, y) + _corner_xx(y, x)


def _corner_along_x(x: FloatArray, y: FloatArray) -> FloatArray:
    return y * np.log(np.hypot(x, y)) + x * np.arctan(y / x)


def _swapped(function: Function) -> Function:
    return lambda x, y: function(y, x)


INTEGRANDS: dict[str, tuple[Function, Function]] = {
    "r": (_inverse_distance, _corner_inverse_distance),
    "xx": (_xx, _corner_xx),
    "yy": (_swapped(_xx), _swapped(_corner_xx)),
    "xy": (_xy, _corner_xy),
    "x": (_along_x, _corner_along_x),
    "y": (_swapped(_along_x), _swapped(_corner_along_x)),
}
"""1/ρ, x²/ρ³, y²/ρ³, xy/ρ³, x/ρ² and y/ρ², each with its antiderivative."""


@lru_cache(maxsize=16)  # bodies of any stiffness on one grid ask for the same
def cell_integral(name: str, grid: Grid) -> FloatArray:
    """∫∫ of one of ``INTEGRANDS`` over a cell, seen at the offsets (i·hy, j·hx), i < ny, j < nx; [ny, nx] m."""
    integrand, antiderivative = INTEGRANDS[name]
    hx, hy = grid.pitch
    y, x = np.meshgrid(np.arange(grid.shape[0]) * hy, np.arange(grid.shape[1]) * hx, indexing="ij")
    reach = INFLUENCE.near * max(hx, hy)
    near = np.s_[: int(reach / hy) + 1, : int(reach / hx) + 1]
    corners = _by_corners(antiderivative, x[near], y[near], hx, hy)
    integral = corners if corners.shape == x.shape else _by_quadrature(integrand, x, y, hx, hy)
    integral[near] = corners
    integral.flags.writeable = False
    return integral


def _by_quadrature(integrand: Function, x: FloatArray, y: FloatArray, hx: float, hy: float) -> FloatArray:
    node, weight = np.polynomial.legendre.leggauss(INFLUENCE.gauss_points)
    total = np.zeros_like(x)
    for v, wv in zip(node / 2, weight / 2, strict=True):
        for u, wu in zip(node / 2, weight / 2, strict=True):
            total += wu * wv * integrand(x + u * hx, y + v * hy)
    return total * (hx * hy)


def _by_corners(antiderivative: Function, x: FloatArray, y: FloatArray, hx: float, hy: float) -> FloatArray:
    def strip(side: float) -> FloatArray:
        return antiderivative(x + side, y + hy / 2) - antiderivative(x + side, y - hy / 2)

    return strip(hx / 2) - strip(-hx / 2)
