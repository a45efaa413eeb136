"""The strength of a Gaussian prior that is most probable, from one that nearly is: for contacts and priors that differ
little, at a fraction of the cost of singular values, which show all strengths at once.

With d = g W c + e, e and c standard normal, data have the covariance S = 1 + g² W Wᵀ and, but for what no W changes,
the log probability ½ dᵀv - ½ log det S, with u = S⁻¹d and v = d - u. By the logarithm of g its derivatives are

    uᵀv - tr(1 - S⁻¹)   and   2 uᵀw - 2 vᵀw - 2 tr S⁻¹ + 2 |S⁻¹|²,   with w = S⁻¹v

(Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, §5.4.1), by which Newton's method finds it in
one to three steps, each by QR of two triangles.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.linalg
from scipy.linalg import lapack

from slipcore.forces.defaults import STRENGTH
from slipcore.forces.inverse.covariance import solve_root, triangles_root
from slipcore.frames import FloatArray


class StrengthEvidence(NamedTuple):
    """Log probability of data by one strength, and its ``slope`` and ``curvature`` along the strength's logarithm."""

    log_probability: float
    slope: float
    curvature: float

    def step(self, room: float) -> tuple[float, float]:
        """Newton's, of the logarithm, or uphill where there is no maximum: up to the ``room`` there is and by a factor
        of e at most; and what is gained by it.
        """
        newton = -self.slope / self.curvature if self.curvature < 0.0 else np.copysign(1.0, self.slope)
        step = min(float(np.clip(newton, -1.0, 1.0)), room)
        return step, self.slope * step + 0.5 * min(self.curvature, 0.0) * step**2


@dataclass(frozen=True, slots=True, eq=False)
class TriangularResponse:
    """``upper`` U [r, r] of a whitened response W [m, p], with UᵀU for W Wᵀ in the space that W reaches or in that of
    data, whichever is less, and ``data`` [r] there.
    """

    upper: FloatArray
    data: FloatArray

    @classmethod
    def of(cls, whitened: FloatArray, data: FloatArray) -> "TriangularResponse":
        """Of a response [m, p] and data [m] that are already divided by the noise of these."""
        m, p = whitened.shape
        if m <= p:
            return cls(_triangle(whitened.T)[:m], data)
        return cls(*transposed_triangle(whitened, data))

    def times(self, root: FloatArray) -> "TriangularResponse":
        """Of W times a factor made of lower triangles, block by block [n, j, j]: triangular again."""
        blocks = self.upper.reshape(len(root), -1, len(self.data))
        return TriangularResponse((root.transpose(0, 2, 1) @ blocks).reshape(self.upper.shape), self.data)

    def evidence(self, strength: float) -> StrengthEvidence:
        """Of one strength."""
        root = triangles_root(strength * self.upper)
        u = _solved(root, self.data)
        v = self.data - u
        inverse, _ = lapack.dpotri(root)  # its upper triangle, above zeros
        diagonal = np.diag(inverse)
        trace, squared = float(diagonal.sum()), 2.0 * float(np.vdot(inverse, inverse)) - float(diagonal @ diagonal)
        log_determinant = 2.0 * float(np.log(np.abs(np.diag(root))).sum())
        return StrengthEvidence(
            0.5 * (float(self.data @ v) - log_determinant),
            float(u @ v) - (len(u) - trace),
            2.0 * (float(_solved(root, v) @ (u - v)) - trace + squared),
        )

    def best(self, near: float, worth: float = -np.inf) -> tuple[float, float]:
        """The most probable strength up to ``STRENGTH.largest``, from one ``near`` it, and the log probability by it.

        The last step is not evaluated: it gains less than ``STRENGTH.settled``, or twice as much would not be ``worth``
        it.
        """
        strength = min(near, STRENGTH.largest)
        for _ in range(STRENGTH.steps):
            found = self.evidence(strength)
            step, gain = found.step(float(np.log(STRENGTH.largest / strength)))
            strength *= float(np.exp(step))
            is_worse = abs(step) < 1.0 and found.log_probability + 2.0 * gain < worth
            if gain < STRENGTH.settled or is_worse:
                break
        return strength, found.log_probability + gain


def transposed_triangle(response: FloatArray, data: FloatArray) -> tuple[FloatArray, FloatArray]:
    """U [p, p], upper triangular, and y [p] of a response A = Q Uᵀ [m, p] with m ≥ p, and data d [m] with y = Qᵀd."""
    p = response.shape[1]
    both = _triangle(np.column_stack((response[:, ::-1], data)))
    return np.asfortranarray(both[:p, :p][::-1, ::-1].T), both[:p, p][::-1]


def _triangle(matrix: FloatArray) -> FloatArray:
    return np.asarray(scipy.linalg.qr(matrix, mode="r", check_finite=False)[0])


def _solved(root: FloatArray, data: FloatArray) -> FloatArray:
    """(RᵀR)⁻¹ d."""
    return solve_root(root, solve_root(root, data, transposed=True))
