"""Compliance of an elastic layer bonded to a rigid base, exact for every wave number.

A surface load e^{i(k_x x + k_y y)} with z into the layer, traction (q_x, q_y) and pressure p gives displacements
û = C(k) (q̂_x, q̂_y, p̂). Along and across the wave, with y = kh, K = 3 − 4ν and D = K(cosh 2y − 1) + 2y² + 8(1 − ν)²:

    normal        (1 − ν)(K sinh 2y − 2y)/GkD          longitudinal  (1 − ν)(K sinh 2y + 2y)/GkD
    transverse    tanh y /Gk                           coupling      [(1 − 2ν)K(cosh 2y − 1) − 2y²]/2GkD

Source: solution of Navier's equations in the layer (cf. Burmister, J. Appl. Phys. 16 (1945) 89; Nogi & Kato, J. Tribol.
119 (1997) 493, without their coating's substrate); the tests solve the same equations by a matrix exponential.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slipcore.contact.defaults import REFERENCE
from slipcore.contact.reference.checks import check_range
from slipcore.contact.reference.elastic_pair import Compliance, half_space
from slipcore.frames import FloatArray

ComplexArray = NDArray[np.complex128]


class LayerModes(NamedTuple):
    """Compliances in m/Pa at wave numbers k, of the shape of k.

    ``normal`` û_z/p̂; ``longitudinal`` û/q̂ along the wave and ``transverse`` across it; ``coupling`` c with
    û_z = −i c q̂ and û = i c p̂ along the wave.
    """

    normal: FloatArray
    longitudinal: FloatArray
    transverse: FloatArray
    coupling: FloatArray


@dataclass(frozen=True, slots=True)
class BondedLayer:
    """Layer of ``thickness`` m with ``young_modulus`` Pa and ``poisson_ratio`` (−1 to 0.5) on a rigid base."""

    thickness: float
    young_modulus: float
    poisson_ratio: float

    def __post_init__(self) -> None:
        check_range("thickness", self.thickness, above=0.0, unit="m")
        half_space(self.young_modulus, self.poisson_ratio)

    @property
    def surface(self) -> Compliance:
        """Compliance of the half-space of the same material, which short waves see."""
        return half_space(self.young_modulus, self.poisson_ratio)

    def modes(self, wave_number: ArrayLike) -> LayerModes:
        """Compliances at ``wave_number`` k ≥ 0 in 1/m: from k = 0, where the layer is a spring, to any k."""
        y = np.asarray(wave_number, float) * self.thickness
        nu, scale = self.poisson_ratio, self.thickness * self.surface.shear
        k_nu, reach = 3.0 - 4.0 * nu, np.minimum(y, REFERENCE.bottomless)
        decay, rise = np.exp(-2.0 * reach), np.expm1(-2.0 * reach) ** 2  # 2(cosh 2y − 1) of the text, times decay
        bend = k_nu * _sinh_excess(y, reach)
        denominator = k_nu * rise + (4.0 * reach**2 + 16.0 * (1.0 - nu) ** 2) * decay
        coupling = (1.0 - 2.0 * nu) * k_nu * _over(rise, y) - 4.0 * _over(reach**2 * decay, y)
        return LayerModes(
            normal=scale * (1.0 - nu) * (bend + 4.0 * (2.0 - 4.0 * nu) * decay) / denominator,
            longitudinal=scale * (1.0 - nu) * (bend + 16.0 * (1.0 - nu) * decay) / denominator,
            transverse=scale * np.where(y > 0.0, _over(np.tanh(y), y), 1.0),
            coupling=0.5 * scale * coupling / denominator,
        )

    def compliance(self, k_x: ArrayLike, k_y: ArrayLike) -> ComplexArray:
        """Matrix C [..., 3, 3] in m/Pa from (q̂_x, q̂_y, p̂) to (û_x, û_y, û_z), Hermitian, at wave vectors in 1/m."""
        k_x, k_y = np.broadcast_arrays(np.asarray(k_x, float), np.asarray(k_y, float))
        k = np.hypot(k_x, k_y)
        return _rotated(self.modes(k), _over(k_x, k), _over(k_y, k))


def half_space_modes(wave_number: ArrayLike, compliance: Compliance) -> LayerModes:
    """Compliances in m/Pa of a half-space at ``wave_number`` k > 0 in 1/m: the limit of a thick layer."""
    inverse = 1.0 / np.asarray(wave_number, float)
    return LayerModes(
        normal=(compliance.shear - compliance.poisson) * inverse,
        longitudinal=(compliance.shear - compliance.poisson) * inverse,
        transverse=compliance.shear * inverse,
        coupling=0.5 * compliance.coupling * inverse,
    )


def _rotated(modes: LayerModes, cosine: FloatArray, sine: FloatArray) -> ComplexArray:
    """Modes along and across the wave, in x, y and z."""
    matrix = np.zeros((*np.shape(cosine), 3, 3), dtype=np.complex128)
    matrix[..., 0, 0] = modes.transverse + (modes.longitudinal - modes.transverse) * cosine**2
    matrix[..., 1, 1] = modes.transverse + (modes.longitudinal - modes.transverse) * sine**2
    matrix[..., 0, 1] = matrix[..., 1, 0] = (modes.longitudinal - modes.transverse) * cosine * sine
    matrix[..., 2, 2] = modes.normal
    matrix[..., 0, 2], matrix[..., 1, 2] = 1j * modes.coupling * cosine, 1j * modes.coupling * sine
    matrix[..., 2, 0], matrix[..., 2, 1] = -1j * modes.coupling * cosine, -1j * modes.coupling * sine
    return matrix


def _over(numerator: FloatArray, y: FloatArray) -> FloatArray:
    """Quotient, 0 at y = 0."""
    quotient: FloatArray = np.divide(numerator, y, out=np.zeros_like(y), where=y > 0.0)
    return quotient


def _sinh_excess(y: FloatArray, reach: FloatArray) -> FloatArray:
    """Value of 2e^{−2y} (sinh 2y − 2y)/y without the cancellation of small y and the overflow of large y."""
    series = np.ones_like(y)
    small = 2.0 * np.minimum(y, REFERENCE.series_below)
    for k in range(10, 1, -1):  # 1 + z²/(4·5)·(1 + z²/(6·7)·(…)): the rest is below 1e-20 for z up to 1
        series = 1.0 + small**2 / (2 * k * (2 * k + 1)) * series
    direct = _over(-np.expm1(-4.0 * reach) - 4.0 * reach * np.exp(-2.0 * reach), y)
    return np.where(small < REFERENCE.series_below, small**2 / 3.0 * 2.0 * series * np.exp(-small), direct)
