"""Displacement below the loaded surface of a half-space, or of a layer bonded to a rigid base.

On a half-space in closed form (Boussinesq and Cerruti; Johnson, Contact Mechanics, eq. 3.18 to 3.19 and 3.75 to 3.76).
What a rigid base takes from it is, as at the surface, a function of the distance alone for each pair of directions: an
integral over wave numbers of the layer's response less the half-space's, held as a polynomial in asinh(r/2h).
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.polynomial import Chebyshev
from scipy import special

from slipcore.contact.defaults import INTERIOR, LAYER
from slipcore.contact.elasticity.bonded_layer import polynomial, radii, wave_numbers
from slipcore.contact.elasticity.chebyshev import evaluate
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.reference.elastic_pair import half_space
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray

Below = Literal["nn", "xx", "xy", "yy", "zx", "zy", "xz", "yz"]
"""As ``influence.Component``; ``xz``, ``yz``: tangential displacement by pressure, which below the surface is no longer
the negative of ``zx``, ``zy``."""


class WaveResponse(NamedTuple):
    """Displacements by a unit load at wave number k, times Gk: of the wave's shape.

    With z into the body: pressure cos kx gives u_z = ``normal`` cos kx and u_x = ``spread`` sin kx; traction q_x = sin
    kx gives u_x = ``longitudinal`` sin kx and u_z = ``lift`` cos kx; q_y gives u_y = ``transverse``.
    """

    normal: FloatArray
    spread: FloatArray
    longitudinal: FloatArray
    lift: FloatArray
    transverse: FloatArray


@dataclass(frozen=True, slots=True)
class Interior:
    """Body of ``young_modulus`` Pa and ``poisson_ratio`` seen ``depth`` m below its loaded surface; a rigid base lies
    ``thickness`` m below that surface (inf: a half-space). Raises ``InvalidInput`` for a depth outside the body.
    """

    young_modulus: float
    poisson_ratio: float
    thickness: float
    depth: float

    def __post_init__(self) -> None:
        half_space(self.young_modulus, self.poisson_ratio)
        if not 0.0 < self.depth < self.thickness:
            raise InvalidInput("depth below the surface", self.depth, f"above 0 m and below {self.thickness} m")

    def influences(self, grid: Grid) -> dict[Below, FloatArray]:
        """Displacements (m) by 1 Pa on one cell at the offsets of the first quadrant, each [ny, nx]."""
        (ny, nx), (hx, hy) = grid.shape, grid.pitch
        y, x = np.meshgrid(np.arange(ny) * hy, np.arange(nx) * hx, indexing="ij")
        side, near = max(hx, hy), np.s_[: INTERIOR.near, : INTERIOR.near]
        total = self._over_cell(x, y, grid, _points(np.hypot(INTERIOR.near * side, self.depth) / side))
        for component, close in self._over_cell(x[near], y[near], grid, _points(self.depth / side)).items():
            total[component][near] = close
        return total

    def _over_cell(self, x: FloatArray, y: FloatArray, grid: Grid, points: int) -> dict[Below, FloatArray]:
        node, weight = np.polynomial.legendre.leggauss(points)
        v, u = (0.5 * side * axis.ravel() for side, axis in zip(grid.pitch[::-1], np.meshgrid(node, node), strict=True))
        share = 0.25 * grid.cell_area * np.multiply.outer(weight, weight).ravel()
        everywhere = self.responses(x[..., None] + u, y[..., None] + v)
        return {component: value @ share for component, value in everywhere.items()}

    def responses(self, x: FloatArray, y: FloatArray) -> dict[Below, FloatArray]:
        """Displacements (m/N) at x, y m beside a unit force on the surface, not right under it (r > 0)."""
        r = np.hypot(x, y)
        normal, spread, mean, turning, lift = self._radial(r)
        cosine, sine = x / r, y / r
        twice = (cosine - sine) * (cosine + sine)
        return {
            "nn": normal,
            "xx": mean - turning * twice,
            "yy": mean + turning * twice,
            "xy": -2.0 * turning * cosine * sine,
            "zx": lift * cosine,
            "zy": lift * sine,
            "xz": spread * cosine,
            "yz": spread * sine,
        }

    def _radial(self, r: FloatArray) -> tuple[FloatArray, ...]:
        """Normal, spread, mean, turning and lift at the distance r m, m/N."""
        free = self._half_space(r)
        if not np.isfinite(self.thickness):
            return free
        s = np.arcsinh(0.5 * r / self.thickness)
        taken = [evaluate(part, s) for part in _base(self, _reach(r, self.thickness))]
        within = r <= LAYER.far * self.thickness
        return tuple(np.where(within, a + b, 0.0) for a, b in zip(free, taken, strict=True))

    def _half_space(self, r: FloatArray) -> tuple[FloatArray, ...]:
        """Normal, spread, mean, turning and lift of a half-space at the distance r m, m/N."""
        z, nu = self.depth, self.poisson_ratio
        scale = half_space(self.young_modulus, nu).shear / (4.0 * np.pi)
        rho = np.hypot(r, z)
        loose = (1.0 - 2.0 * nu) / (rho + z)
        along = r**2 / rho**3 - loose * r**2 / (rho * (rho + z))  # what x²/r² of it adds to u_x by q_x
        return (
            scale * (z**2 / rho**3 + 2.0 * (1.0 - nu) / rho),
            scale * (r * z / rho**3 - loose * r / rho),
            scale * (1.0 / rho + loose + 0.5 * along),
            -0.5 * scale * along,
            scale * (r * z / rho**3 + loose * r / rho),
        )


def _points(depth: float) -> int:
    """Even number of Gauss points over a cell that is seen from ``depth`` of its sides."""
    ellipse = 2.0 * depth + float(np.hypot(1.0, 2.0 * depth))
    return min(2 * int(np.ceil(-0.25 * np.log(INTERIOR.cell_tolerance) / np.log(ellipse))), INTERIOR.most_points)


def _reach(r: FloatArray, thickness: float) -> float:
    reach = min(max(float(np.max(r)) / thickness, 1.0), LAYER.far)
    return float(2.0 ** np.ceil(np.log2(reach)))


@lru_cache(maxsize=16)
def _base(body: Interior, reach: float) -> tuple[Chebyshev, ...]:
    """What the base takes from normal, spread, mean, turning and lift of a half-space, m/N; over asinh(r/2h)."""
    share = body.depth / body.thickness
    k, weight = wave_numbers(reach, body.thickness, 2.0 * LAYER.deepest_wave / (2.0 - share))
    radius = radii(reach, body.thickness)
    layer = wave_response(k * body.thickness, k * body.depth, body.poisson_ratio)
    free = wave_response(np.full_like(k, np.inf), k * body.depth, body.poisson_ratio)
    taken = WaveResponse(*(a - b for a, b in zip(layer, free, strict=True)))
    phase = np.multiply.outer(radius, k)
    zero, one = special.j0(phase), special.j1(phase)
    two = 2.0 * one / phase - zero
    scale = half_space(body.young_modulus, body.poisson_ratio).shear / (2.0 * np.pi)
    pairs = (
        (zero, taken.normal),
        (one, taken.spread),
        (zero, 0.5 * (taken.longitudinal + taken.transverse)),
        (two, 0.5 * (taken.longitudinal - taken.transverse)),
        (one, -taken.lift),
    )
    return tuple(polynomial(scale * (bessel @ (weight * of_wave)), reach) for bessel, of_wave in pairs)


def wave_response(base: FloatArray, depth: FloatArray, nu: float) -> WaveResponse:
    """Response at ``depth`` [w] of layers with a rigid base at ``base`` [w] (inf: none), both in 1/k.

    Each displacement is a sum of four solutions of Navier's equations, two that decay from the surface and two from the
    base (Papkovich–Neuber); tractions at the surface and the fixed base determine them.
    """
    reach = np.minimum(base, 700.0)  # beyond it exp(−kh) is zero
    bottom = _solutions(reach, reach, nu)
    conditions = np.stack((_pull(reach, nu), _shear(reach, nu), *bottom), axis=1)
    conditions[reach != base, 2:] = np.array([[0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    loads = np.zeros((4, 2))
    loads[0, 0] = loads[1, 1] = -1.0
    strength = np.linalg.solve(conditions, np.broadcast_to(loads, (len(depth), 4, 2)))
    along, inwards = _solutions(depth, reach, nu)
    u, w = (np.einsum("ws,wsl->lw", field, strength) for field in (along, inwards))
    transverse = np.exp(-depth) * -np.expm1(-2.0 * (reach - depth)) / (1.0 + np.exp(-2.0 * reach))
    return WaveResponse(normal=w[0], spread=u[0], longitudinal=u[1], lift=w[1], transverse=transverse)


def _solutions(z: FloatArray, base: FloatArray, nu: float) -> tuple[FloatArray, FloatArray]:
    """Displacements along the wave and inwards, each [w, 4], of the four solutions at z, in 1/k."""
    fall, up, c = np.exp(-z), base - z, 3.0 - 4.0 * nu
    rise = np.exp(-up)
    along = np.stack((fall, z * fall, rise, up * rise), axis=-1)
    inwards = np.stack((fall, (z + c) * fall, -rise, -(up + c) * rise), axis=-1)
    return along, inwards


def _pull(base: FloatArray, nu: float) -> FloatArray:
    """Normal stress σ_zz/Gk at the surface, [w, 4]."""
    rise, one = np.exp(-base), np.ones_like(base)
    last = -4.0 * nu * rise + 2.0 * (4.0 * nu - 2.0 - base) * rise
    return np.stack((-2.0 * one, -4.0 * (1.0 - nu) * one, -2.0 * rise, last), axis=-1)


def _shear(base: FloatArray, nu: float) -> FloatArray:
    """Shear stress σ_xz/Gk at the surface, [w, 4]."""
    rise, one = np.exp(-base), np.ones_like(base)
    last = (2.0 * base + 2.0 - 4.0 * nu) * rise
    return np.stack((-2.0 * one, (4.0 * nu - 2.0) * one, 2.0 * rise, last), axis=-1)
