"""Tractions that change little from frame to frame: Kalman filter and smoother on a known support.

The prior of tractions in space is that of each single frame; in time they forget themselves exponentially (Ornstein and
Uhlenbeck), so that one frame alone is what it is without others. With the whitened response R L = U s Vᵀ the singular
directions are independent of each other at all times, and each is filtered and smoothed as one number (Rauch, Tung and
Striebel, AIAA J. 3 (1965) 1445): exact, and no condition number is squared. What differs between data and traction is
in part the same in all frames (what bilinear tractions cannot follow), which no averaging takes away: it lasts, too.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from slipcore.forces.defaults import OVER_TIME
from slipcore.forces.inverse.fit import ObservationModel, TractionFit, times
from slipcore.frames import FloatArray


class Smoothed(NamedTuple):
    """Mean and variance [t, r] of each mode in each frame, by all frames."""

    mean: FloatArray
    variance: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Modes:
    """Directions of traction that data show independently: ``components`` [r, m] of data, in their noise, with the
    singular values ``s`` [r], and the tractions ``root`` [3 j, r] of each. ``white``: share of the noise's variance
    that is another in each frame.
    """

    components: FloatArray
    s: FloatArray
    root: FloatArray
    white: float

    @classmethod
    def of(cls, observation: ObservationModel, fit: TractionFit, white: float) -> "Modes":
        """Of a fit's support and prior."""
        q, r = observation.on(fit.support)
        unknown = 3 * fit.prior_root.shape[1]
        filled = np.zeros((max(unknown - len(r), 0), unknown))
        whitened = np.concatenate((times(r, fit.prior_root), filled))  # data fewer than tractions leave some unseen
        u, s, v = np.linalg.svd(whitened, full_matrices=False)
        root = [part @ rows for part, rows in zip(fit.prior_root, np.split(v.T, 3), strict=True)]
        return cls((q @ u[: len(r)]).T / observation.noise, s, np.concatenate(root), white)

    @property
    def lasting(self) -> FloatArray:
        """Variance [r] of what lasts of the data before any are seen: that of tractions, and of what is no traction."""
        return np.asarray(self.s**2 + (1.0 - self.white))

    def memory(self, seen: FloatArray, time: FloatArray) -> "Persistence":
        """That which makes components ``seen`` [t, r] of frames at ``time`` [t] s most probable."""
        steps = np.diff(time)
        frame = float(np.median(steps))
        grid = np.log(frame) + np.linspace(np.log(OVER_TIME.shortest), np.log(OVER_TIME.longest), OVER_TIME.grid)

        def price(logarithm: float) -> float:
            return -_Filtered.of(seen, self, Persistence.over(steps, float(np.exp(logarithm)))).log_evidence

        best = int(np.argmin([price(at) for at in grid]))
        around = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
        found = minimize_scalar(price, bounds=around, method="bounded", options={"xatol": OVER_TIME.settled}).x
        return Persistence.over(steps, float(np.exp(found)))

    def smoothed(self, seen: FloatArray, memory: "Persistence") -> Smoothed:
        """What lasts of the components ``seen`` [t, r]."""
        filtered = _Filtered.of(seen, self, memory)
        mean, variance = filtered.mean.copy(), filtered.variance.copy()
        for k in range(len(seen) - 2, -1, -1):
            gain = memory.kept[k + 1] * variance[k] / filtered.variance_before[k + 1]
            mean[k] += gain * (mean[k + 1] - filtered.mean_before[k + 1])
            own = variance[k] * (memory.new[k + 1] * self.lasting / filtered.variance_before[k + 1])
            variance[k] = own + gain**2 * variance[k + 1]  # both positive: nothing is subtracted
        return Smoothed(mean, variance)

    def tractions(self, lasts: Smoothed) -> Smoothed:
        """As numbers of each mode's ``root``, the tractions by which that ``lasts`` of the data."""
        share = self.s / self.lasting
        return Smoothed(share * lasts.mean, (1.0 - self.white) / self.lasting + share**2 * lasts.variance)


class Persistence(NamedTuple):
    """What is ``kept`` [t] of a frame in the next one, and the share ``new`` [t] of the variance; nothing is kept from
    before the first.
    """

    kept: FloatArray
    new: FloatArray

    @classmethod
    def over(cls, steps: FloatArray, lasts: float) -> "Persistence":
        """For frames that are ``steps`` [t - 1] s apart."""
        past = -steps / lasts
        return cls(np.concatenate(([0.0], np.exp(past))), np.concatenate(([1.0], -np.expm1(2.0 * past))))


@dataclass(frozen=True, slots=True, eq=False)
class _Filtered:
    """Mean and variance [t, r] of each mode by the frames until then, the same before the own frame, and the log
    probability of all.
    """

    mean: FloatArray
    variance: FloatArray
    mean_before: FloatArray
    variance_before: FloatArray
    log_evidence: float

    @classmethod
    def of(cls, seen: FloatArray, modes: Modes, memory: Persistence) -> "_Filtered":
        """By components ``seen`` [t, r]."""
        mean, variance, mean_before, variance_before = (np.zeros_like(seen) for _ in range(4))
        last, spread = np.zeros_like(modes.s), modes.lasting
        for k, (kept, new) in enumerate(zip(*memory, strict=True)):
            mean_before[k], variance_before[k] = kept * last, kept**2 * spread + new * modes.lasting
            total = variance_before[k] + modes.white
            last = mean_before[k] + variance_before[k] / total * (seen[k] - mean_before[k])
            spread = variance_before[k] * (modes.white / total)
            mean[k], variance[k] = last, spread
        total = variance_before + modes.white
        evidence = -0.5 * float(np.sum((seen - mean_before) ** 2 / total + np.log(total)))
        return cls(mean, variance, mean_before, variance_before, evidence)
