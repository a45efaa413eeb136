"""A half-space under the traction √(c² − r²) on a circle: what Hertz, Cattaneo and Mindlin superpose.

With ρ the distance between field point and load, two integrals over the circle give every displacement:

    V = ∬ √(c² − r'²)/ρ dA,    W_xx = ∬ √(c² − r'²) Δx²/ρ³ dA = V/2 + D (x² − y²)/2r²

    u_z = V (1 − ν)/2πG,    u_x = [(1 − ν/2) V + (ν/2) D (x² − y²)/r²]/2πG,    u_y = (ν/2) D 2xy/r² /2πG

Outside the circle the textbook forms subtract nearly equal numbers; with the angle φ = 2 asin(c/r) they don't.
Source: Johnson, Contact Mechanics (1985), §3.4 and 3.7; the paper, (A6)–(A11), corrected.
"""

import numpy as np
from scipy import special

from slipcore.contact.defaults import REFERENCE
from slipcore.frames import FloatArray


def sin_minus_x_cos(x: FloatArray) -> FloatArray:
    """Value of sin x − x cos x = x² j₁(x), to full relative precision for x in [0, π]."""
    result: FloatArray = x * x * special.spherical_jn(1, x)
    return result


def x_minus_sin(x: FloatArray) -> FloatArray:
    """Value of x − sin x, to full relative precision for x ≥ 0."""
    series = np.ones_like(x)
    for k in range(10, 1, -1):  # 1 − x²/(4·5)·(1 − x²/(6·7)·(…)): the rest is below 1e-20 at x = 1
        series = 1.0 - x * x / (2 * k * (2 * k + 1)) * series
    result: FloatArray = np.where(x < REFERENCE.series_below, x**3 / 6.0 * series, x - np.sin(x))
    return result


def polar_angle(r: FloatArray, radius: float) -> FloatArray:
    """Angle φ = 2 asin(c/r) outside the circle, π inside; no division, so that r = c = 0 is fine."""
    outside = np.sqrt(np.maximum(r - radius, 0.0) * (r + radius))
    angle: FloatArray = np.where(r <= radius, np.pi, 2.0 * np.arctan2(radius, outside))
    return angle


def potential(r: FloatArray, radius: float) -> FloatArray:
    """Integral V in m³, over the whole surface."""
    outer = r * r * sin_minus_x_cos(polar_angle(r, radius))
    inner = 2.0 * np.pi * np.maximum(radius - r, 0.0) * (radius + r)
    result: FloatArray = 0.25 * np.pi * (outer + inner)
    return result


def deviator_over_square(r: FloatArray, radius: float) -> FloatArray:
    """Integral D divided by r², in m: it multiplies x² − y² in u_x and 2xy in u_y."""
    result: FloatArray = np.pi / 16.0 * x_minus_sin(2.0 * polar_angle(r, radius))
    return result


def tangential_displacement(
    x: FloatArray, y: FloatArray, axial: FloatArray, deviator: FloatArray, shear: float, poisson: float
) -> FloatArray:
    """Displacement [..., 2] under a traction along x, from V (``axial``), D/r² (``deviator``), 1/G and ν/G."""
    u_x = (shear - 0.5 * poisson) * axial + 0.5 * poisson * deviator * (x - y) * (x + y)
    u_y = 0.5 * poisson * deviator * 2.0 * x * y
    return np.stack([u_x, u_y], axis=-1) / (2.0 * np.pi)
