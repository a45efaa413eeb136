"""Displacement of gels whose thickness is not alike everywhere, by finite elements: a truth that no kernel gives.

A wedge or a ridge is alike along y, a dome all around its axis, and so is what is solved: elements (quadratic
quadrilaterals) fill a section of the gel, and each Fourier mode along y, or around the axis, is a plane problem of its
own (Zienkiewicz and Taylor, The Finite Element Method, 5th ed., vol. 2, ch. 9, "semi-analytical" elements). The base is
held. Tractions act per area of the plane z = 0, as those of a reconstruction do, on the surface as it is.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.linalg import solveh_banded
from scipy.sparse import csc_matrix

from slipcore.frames import FloatArray

ComplexArray = NDArray[np.complex128]
Profile = Callable[[FloatArray], FloatArray]
"""A height or a thickness, m, over x or over the distance from the axis, m."""

FINE, LAYERS, BEYOND = 0.3e-3, 12, 12
"""Width of elements near the contact, m; elements through the thickness, and beyond the fine ones on each side."""
HALF_WIDTH = 9e-3
"""m, within which elements are fine."""
FARTHEST = 25e-3
"""m from the middle, where the section ends, free."""
GAUSS = np.polynomial.legendre.leggauss(3)


@dataclass(frozen=True, slots=True)
class Layer:
    """A gel of ``young_modulus`` Pa and ``poisson_ratio`` between a ``surface`` and a base ``thickness`` below it.

    ``ring``: around an axis at x = 0; else alike along y.
    """

    young_modulus: float
    poisson_ratio: float
    surface: Profile
    thickness: Profile
    ring: bool = False


class Section:
    """Its elements, made once, and the displacement of its surface by the loads of one mode after the other."""

    def __init__(self, layer: Layer) -> None:
        self.layer = layer
        x = _along(layer.ring)
        depth = np.linspace(0.0, 1.0, 2 * LAYERS + 1)
        depth = 0.45 * depth + 0.55 * depth**2  # finer under the surface
        self.x = x
        self._shape = (len(x), len(depth))
        self._place = np.stack(
            np.broadcast_arrays(x[:, None], layer.surface(x)[:, None] - layer.thickness(x)[:, None] * depth), axis=-1
        )
        self._parts = self._assembled()
        free = np.ones((*self._shape, 3), dtype=bool)
        free[:, -1] = False
        self._free = free.ravel()
        self.surface_nodes = np.arange(len(x)) * len(depth)

    def moved(self, mode: float, load: ComplexArray) -> ComplexArray:
        """Displacement [x, 3, ...] m of the surface's nodes by nodal loads [x, 3, ...] N (a metre, or a radian), x, y
        and up; ``mode``: the wavenumber along y in 1/m, or how many waves go round.
        """
        k0, k1, k2 = self._parts
        stiffness = (k0 + mode * k1 + mode**2 * k2).tocsc()
        free = self._free.copy()
        if self.layer.ring and mode == 0:  # nothing moves sideways on the axis
            free.reshape(*self._shape, 3)[0, :, :2] = False
        sides = load.reshape(*load.shape[:2], -1) * np.array([1.0, -1.0j, 1.0])[:, None]
        right = np.zeros((len(free), sides.shape[-1]), dtype=complex)
        right.reshape(-1, 3, sides.shape[-1])[self.surface_nodes] = sides
        both = np.concatenate((right.real, right.imag), axis=1)[free]
        solved = np.zeros((len(free), both.shape[1]))
        solved[free] = solveh_banded(_banded(stiffness[free][:, free]), both, overwrite_ab=True, check_finite=False)
        real, imaginary = np.split(solved.reshape(-1, 3, both.shape[1])[self.surface_nodes], 2, axis=2)
        return np.asarray(((real + 1j * imaginary) * np.array([1.0, 1.0j, 1.0])[:, None]).reshape(load.shape))

    def nodal(self, traction: Callable[[FloatArray], ComplexArray]) -> ComplexArray:
        """Loads [x, ...] on the surface's nodes of a ``traction`` [q, ...] Pa at places x [q] m."""
        points, weights = np.polynomial.legendre.leggauss(8)
        left, right = self.x[:-1:2], self.x[2::2]
        half = 0.5 * (right - left)
        x = (0.5 * (left + right)[:, None] + half[:, None] * points).ravel()
        value = traction(x)
        weight = (half[:, None] * weights).ravel() * (x if self.layer.ring else 1.0)
        value = (value.T * weight).T.reshape(len(left), len(points), *value.shape[1:])
        shape = np.stack([function(points) for function in QUADRATIC])
        of_elements = np.einsum("ap,ep...->ea...", shape, value)
        loads = np.zeros((len(self.x), *value.shape[2:]), dtype=complex)
        for a in range(3):
            np.add.at(loads, 2 * np.arange(len(left)) + a, of_elements[:, a])
        return loads

    def _assembled(self) -> tuple[csc_matrix, csc_matrix, csc_matrix]:
        """Stiffness as a polynomial of the mode: K₀ + mode K₁ + mode² K₂."""
        nx, nz = self._shape
        i, j = np.meshgrid(np.arange(0, nx - 2, 2), np.arange(0, nz - 2, 2), indexing="ij")
        corner = (i * nz + j).ravel()
        nodes = corner[:, None] + np.add.outer(np.arange(3) * nz, np.arange(3)).ravel()
        place = self._place.reshape(-1, 2)[nodes]
        stiffness = np.zeros((3, len(nodes), 27, 27))
        for a, of_a in zip(*GAUSS, strict=True):
            for b, of_b in zip(*GAUSS, strict=True):
                value, slope = _shape_functions(a, b)
                jacobian = np.einsum("dn,enk->edk", slope, place)
                size = np.abs(np.linalg.det(jacobian))
                gradient = np.linalg.solve(jacobian, np.broadcast_to(slope, (len(nodes), 2, 9)))
                radius = place[:, :, 0] @ value if self.layer.ring else np.ones(len(nodes))
                constant, by_mode = _strains(value, gradient, 1.0 / radius, self.layer.ring)
                weight = of_a * of_b * size * radius
                for order, (left, right) in enumerate(((constant, constant), (constant, by_mode), (by_mode, by_mode))):
                    term = np.einsum("esa,st,etb,e->eab", left, self._elasticity(), right, weight, optimize=True)
                    stiffness[order] += term + term.transpose(0, 2, 1) if order == 1 else term
        number = (3 * nodes[:, :, None] + np.arange(3)).reshape(len(nodes), 27)
        rows, columns = np.repeat(number, 27, axis=1).ravel(), np.tile(number, 27).ravel()
        size3 = 3 * nx * nz
        k0, k1, k2 = (csc_matrix((each.ravel(), (rows, columns)), shape=(size3, size3)) for each in stiffness)
        return k0, k1, k2

    def _elasticity(self) -> FloatArray:
        young, nu = self.layer.young_modulus, self.layer.poisson_ratio
        shear, lame = 0.5 * young / (1.0 + nu), young * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
        matrix = np.diag([2.0 * shear] * 3 + [shear] * 3)
        matrix[:3, :3] += lame
        return matrix


def _banded(matrix: csc_matrix) -> FloatArray:
    """The upper half of a symmetric matrix, diagonal by diagonal, as LAPACK has it."""
    entries = matrix.tocoo()
    above = entries.col - entries.row
    upper = above >= 0
    width = int(above.max())
    bands = np.zeros((width + 1, matrix.shape[0]))
    bands[width - above[upper], entries.col[upper]] = entries.data[upper]
    return bands


QUADRATIC: tuple[Profile, ...] = (lambda t: 0.5 * t * (t - 1.0), lambda t: 1.0 - t**2, lambda t: 0.5 * t * (t + 1.0))
SLOPES: tuple[Profile, ...] = (lambda t: t - 0.5, lambda t: -2.0 * t, lambda t: t + 0.5)


def _along(ring: bool) -> FloatArray:
    """Nodes along x, two to an element."""
    fine = np.arange(0.0, HALF_WIDTH + 0.25 * FINE, 0.5 * FINE)
    step = np.geomspace(1.0, 12.0, BEYOND).cumsum()
    ends = fine[-1] + (FARTHEST - fine[-1]) * step / step[-1]
    ends = np.concatenate((fine[-1:], ends))
    right = np.concatenate((fine, np.stack((0.5 * (ends[:-1] + ends[1:]), ends[1:]), axis=1).ravel()))
    return right if ring else np.concatenate((-right[:0:-1], right))


def _shape_functions(a: float, b: float) -> tuple[FloatArray, FloatArray]:
    """Values [9] and slopes [2, 9] of the quadratic functions at a point of the unit square."""
    one, two = (np.array([float(f(np.array(at))) for f in QUADRATIC]) for at in (a, b))
    d_one, d_two = (np.array([float(f(np.array(at))) for f in SLOPES]) for at in (a, b))
    return np.outer(one, two).ravel(), np.stack((np.outer(d_one, two).ravel(), np.outer(one, d_two).ravel()))


def _strains(
    value: FloatArray, gradient: FloatArray, curvature: FloatArray, ring: bool
) -> tuple[FloatArray, FloatArray]:
    """Strains [e, 6, 27] by nodal (u_x, v, u_z), where u_y = i v: what is constant, and what goes with the mode.

    xx, yy, zz, and twice xy, yz and xz; around an axis x is the radius and ``curvature`` [e] one over it.
    """
    constant, by_mode = (np.zeros((len(gradient), 6, 9, 3)) for _ in range(2))
    along, up = gradient[:, 0], gradient[:, 1]
    of_mode = curvature[:, None] * value if ring else np.broadcast_to(value, along.shape)
    constant[:, 0, :, 0], constant[:, 2, :, 2] = along, up
    constant[:, 3, :, 1], constant[:, 4, :, 1] = along, up
    constant[:, 5, :, 0], constant[:, 5, :, 2] = up, along
    by_mode[:, 1, :, 1], by_mode[:, 3, :, 0], by_mode[:, 4, :, 2] = -of_mode, of_mode, of_mode
    if ring:
        constant[:, 1, :, 0] = of_mode
        constant[:, 3, :, 1] -= of_mode
    return constant.reshape(-1, 6, 27), by_mode.reshape(-1, 6, 27)


PERIODS, SHORTEST = 256, 60
"""Cells along y after which a load comes again, and waves in these up to which it is followed."""


def moved_by_cells(layer: Layer, loads: FloatArray, cell: float, places: tuple[FloatArray, FloatArray]) -> FloatArray:
    """Displacement [t, 3, y, x] m (x, y and into the gel) at places x and y, of a layer alike along y, by ``loads``
    [t, 3, n, n] Pa (x, y and into it) on square cells around the middle.
    """
    section, side = Section(layer), loads.shape[-1]
    first = -0.5 * side * cell
    up = loads * np.array([1.0, 1.0, -1.0])[:, None, None]
    padded = np.zeros((*up.shape[:2], PERIODS, side))
    padded[:, :, :side] = up
    number = np.arange(SHORTEST + 1)
    wave = 2.0 * np.pi * number / (PERIODS * cell)
    modes = np.fft.rfft(padded, axis=2)[:, :, : SHORTEST + 1] / PERIODS  # of y = first + cell/2 on
    modes *= np.exp(-1j * wave * (first + 0.5 * cell))[:, None] * np.sinc(number / PERIODS)[:, None]

    def traction(x: FloatArray) -> ComplexArray:
        index = np.floor((x - first) / cell).astype(int)
        inside = (index >= 0) & (index < side)
        found = modes[..., np.clip(index, 0, side - 1)] * inside
        return np.ascontiguousarray(np.moveaxis(found, (3, 1, 2, 0), (0, 1, 2, 3)))

    nodal = section.nodal(traction)  # [x, 3, mode, t]
    result = np.zeros((loads.shape[0], 3, len(places[1]), len(places[0])))
    for n, k in enumerate(wave):
        moved = section.moved(float(k), nodal[:, :, n])
        at = CubicSpline(section.x, moved)(places[0])  # [x, 3, t]
        phase = (1.0 if n == 0 else 2.0) * np.exp(1j * k * places[1])
        result += np.real(np.einsum("y,xdt->tdyx", phase, at))
    return result * np.array([1.0, 1.0, -1.0])[:, None, None]


def moved_by_rings(
    layer: Layer, pressure: Profile, shear: Profile, direction: tuple[float, float], places: FloatArray
) -> FloatArray:
    """Displacement [3, j] m (x, y and into the gel) at ``places`` [j, 2] m of a dome, by a pressure and a shear of one
    direction, Pa over the distance from the axis.
    """
    section = Section(layer)

    def loads(*columns: Profile | None) -> ComplexArray:
        def traction(x: FloatArray) -> ComplexArray:
            return np.stack([np.zeros(len(x)) if each is None else each(x) for each in columns], axis=1) + 0j

        return section.nodal(traction)

    r, angle = np.hypot(*places.T), np.arctan2(places[:, 1], places[:, 0])
    pressed = CubicSpline(section.x, section.moved(0.0, loads(None, None, lambda x: -pressure(x))).real)(r)
    # along x: t_r = q cos, t_θ = −q sin, which is the real part of i q exp(i θ)
    sheared = CubicSpline(section.x, section.moved(1.0, loads(shear, None, None) + 1j * loads(None, shear, None)))(r)
    turned = angle - np.arctan2(direction[1], direction[0])
    size = float(np.hypot(*direction))
    along = pressed[:, 0] + size * sheared[:, 0].real * np.cos(turned)
    around = -size * sheared[:, 1].imag * np.sin(turned)
    into = -pressed[:, 2] - size * sheared[:, 2].real * np.cos(turned)
    x = along * np.cos(angle) - around * np.sin(angle)
    y = along * np.sin(angle) + around * np.cos(angle)
    return np.stack((x, y, into))
