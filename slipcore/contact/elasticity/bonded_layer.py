"""Influence of one loaded cell on a layer bonded to a rigid base, as what the base takes from a half-space.

The layer's compliance less that of a half-space decays as (kh)² exp(−2kh) with the wave number, so its transform to
space is smooth over the layer's thickness h: three radial functions, each an integral over wave numbers with a Bessel
function, held as a polynomial in asinh(r/2h). The half-space itself keeps its own exact influence, so a layer that is
thick against the contact meets it without any loss.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy.fft
from numpy.polynomial import Chebyshev
from scipy import special

from slipcore.contact.defaults import LAYER
from slipcore.contact.elasticity.chebyshev import evaluate
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import Component
from slipcore.contact.reference.bonded_layer import BondedLayer, LayerModes, half_space_modes
from slipcore.frames import FloatArray


class RadialFunctions(NamedTuple):
    """What the base takes from a half-space's response at asinh(r/2h), each in 1/Pa·m: ``normal``; tangential
    ``mean`` of all directions, and its part that turns twice (``turning``); ``coupling``.
    """

    normal: Chebyshev
    mean: Chebyshev
    turning: Chebyshev
    coupling: Chebyshev


@dataclass(frozen=True, slots=True)
class LayerBase:
    """Correction to a half-space of ``young_modulus`` Pa and ``poisson_ratio`` for a rigid base ``thickness`` m below
    its surface, to which it is bonded.
    """

    thickness: float
    young_modulus: float
    poisson_ratio: float

    def __post_init__(self) -> None:
        self.layer()

    def layer(self) -> BondedLayer:
        """The layer, wave by wave."""
        return BondedLayer(self.thickness, self.young_modulus, self.poisson_ratio)

    def influence(self, component: Component, grid: Grid) -> FloatArray | None:
        """Displacement (m) by 1 Pa on one cell at the offsets of the first quadrant [ny, nx]."""
        ny, nx = grid.shape
        whole = (-(-ny // LAYER.chunk) * LAYER.chunk, -(-nx // LAYER.chunk) * LAYER.chunk)
        return _influence(self, component, Grid(whole, grid.pitch))[:ny, :nx]

    def at(self, component: Component, functions: RadialFunctions, x: FloatArray, y: FloatArray) -> FloatArray:
        """Response (m/N) to a unit force, seen at x, y m from it but not at the force itself."""
        r = np.hypot(x, y)
        s = np.arcsinh(0.5 * r / self.thickness)
        match component:
            case "nn":
                response = evaluate(functions.normal, s)
            case "xx":
                response = evaluate(functions.mean, s) - evaluate(functions.turning, s) * ((x - y) * (x + y) / r**2)
            case "yy":
                response = evaluate(functions.mean, s) + evaluate(functions.turning, s) * ((x - y) * (x + y) / r**2)
            case "xy":
                response = -evaluate(functions.turning, s) * (2.0 * x * y / r**2)
            case "zx":
                response = evaluate(functions.coupling, s) * (x / r)
            case "zy":
                response = evaluate(functions.coupling, s) * (y / r)
        return np.asarray(response)


@lru_cache(maxsize=32)
def _influence(base: LayerBase, component: Component, grid: Grid) -> FloatArray:
    (ny, nx), (hx, hy) = grid.shape, grid.pitch
    reach = float(np.hypot(nx * hx, ny * hy)) / base.thickness
    functions = radial_functions(base.layer(), 2.0 ** np.ceil(np.log2(max(reach, 1.0))))
    node, weight = np.polynomial.legendre.leggauss(_points(max(hx, hy) / base.thickness))
    y, x = np.arange(ny)[:, None] * hy, np.arange(nx)[None, :] * hx
    total = np.zeros(grid.shape)
    for v, wv in zip(0.5 * hy * node, 0.5 * weight, strict=True):
        for u, wu in zip(0.5 * hx * node, 0.5 * weight, strict=True):
            total += wu * wv * base.at(component, functions, x + u, y + v)
    total *= grid.cell_area
    total.flags.writeable = False
    return total


@lru_cache(maxsize=16)
def radial_functions(layer: BondedLayer, reach: float) -> RadialFunctions:
    """What the base takes, from r = 0 to ``reach`` thicknesses.

    A wave's longitudinal L and transverse T give (L + T)/2 with J₀ and (L − T)/2 with J₂; its coupling goes with J₁.
    """
    k, weight = wave_numbers(min(reach, LAYER.far), layer.thickness)
    radius = radii(reach, layer.thickness)
    near = radius <= LAYER.far * layer.thickness
    phase = np.multiply.outer(radius[near], k)
    zero, one = special.j0(phase), special.j1(phase)
    base, free = _taken_by_the_base(layer, k), half_space_modes(1.0, layer.surface)

    def transform(bessel: FloatArray, of_wave: FloatArray, of_half_space: FloatArray) -> Chebyshev:
        value = -of_half_space / radius
        value[near] = bessel @ (weight * k * of_wave)
        return polynomial(value / (2.0 * np.pi), reach)

    return RadialFunctions(
        normal=transform(zero, base.normal, free.normal),
        mean=transform(zero, 0.5 * (base.longitudinal + base.transverse), 0.5 * (free.longitudinal + free.transverse)),
        turning=transform(
            2.0 * one / phase - zero,
            0.5 * (base.longitudinal - base.transverse),
            0.5 * (free.longitudinal - free.transverse),
        ),
        coupling=transform(one, base.coupling, free.coupling),
    )


def radii(reach: float, thickness: float) -> FloatArray:
    """Chebyshev points of asinh(r/2h), as distances m."""
    points = np.polynomial.chebyshev.chebpts1(LAYER.degree + 1)
    return np.asarray(2.0 * thickness * np.sinh(0.5 * (points + 1.0) * np.arcsinh(0.5 * reach)))


def polynomial(value: FloatArray, reach: float) -> Chebyshev:
    """The polynomial through values at ``radii``, without coefficients that do not count."""
    coefficients = scipy.fft.dct(value[::-1], type=2) / len(value)
    coefficients[0] *= 0.5
    size = np.abs(coefficients)
    kept = int(np.flatnonzero(size > LAYER.negligible * size.max())[-1]) + 1 if size.any() else 1
    return Chebyshev(coefficients[:kept], domain=[0.0, float(np.arcsinh(0.5 * reach))])


def wave_numbers(reach: float, thickness: float, deepest: float = LAYER.deepest_wave) -> tuple[FloatArray, FloatArray]:
    """Nodes (1/m) and weights of Gauss quadrature over all waves that reach the base: those of kh up to ``deepest``."""
    panels = int(np.ceil(deepest * max(reach, 2.0) / LAYER.panel_phase))
    node, weight = np.polynomial.legendre.leggauss(LAYER.panel_points)
    width = deepest / panels
    y = width * (np.arange(panels)[:, None] + 0.5 * (node + 1.0)[None, :])
    return y.ravel() / thickness, np.tile(0.5 * width * weight, panels) / thickness


def _taken_by_the_base(layer: BondedLayer, k: FloatArray) -> LayerModes:
    """Compliance of the layer less that of a half-space, m/Pa."""
    with_base, without = layer.modes(k), half_space_modes(k, layer.surface)
    return LayerModes(*(a - b for a, b in zip(with_base, without, strict=True)))


def _points(pitch: float) -> int:
    """Even number of Gauss points over a cell of ``pitch`` thicknesses: poles lie two thicknesses away."""
    ellipse = 4.0 / pitch + float(np.hypot(1.0, 4.0 / pitch))
    needed = -np.log(LAYER.cell_tolerance) / (2.0 * np.log(ellipse))
    return 2 * int(np.ceil(0.5 * needed))
