"""What the force sensors say while nothing touches: their offset, and its drift."""

from dataclasses import dataclass

import numpy as np

from slipcore.calibration.defaults import ESTIMATE
from slipcore.calibration.estimate import PressEstimate, PressResult, error_of_mean
from slipcore.frames import BoolArray, FloatArray, GraspLog

NO_ZERO = "no frames without contact, which show its zero: begin before the touch"
"""Why forces of a log say nothing of quantities that an offset would look like."""


@dataclass(frozen=True, slots=True, eq=False)
class Zero:
    """``offset`` [n, m, 3] N of each element in the first frame, and the ``drift`` [3] N/s that all have in common.

    ``offset_error``, ``drift_error`` [3]: standard errors of what the elements have in common; ``frames``: how many
    were free, at ``middle`` s in the mean; ``around``: whether some were so before the press and some after it, between
    which drift is known.
    """

    offset: FloatArray
    drift: FloatArray
    offset_error: FloatArray
    drift_error: FloatArray
    frames: int
    middle: float
    around: bool

    def taken_from(self, log: GraspLog) -> FloatArray:
        """Forces of its own log without it, [t, n, m, 3] N; drift is not extrapolated."""
        assert log.force is not None
        drift = self.drift if self.around else np.zeros(3)
        free: FloatArray = log.force - self.offset - elapsed(log)[:, None, None, None] * drift
        return free

    def strayed(self, time: float) -> FloatArray:
        """How far an element's zero may be at that time, s, from where it is taken to be, [3] N: where free frames on
        one side alone leave its drift open, as far as they seem to drift.
        """
        if self.around:
            return np.zeros(3)
        return np.asarray(abs(time - self.middle) * np.hypot(self.drift, self.drift_error))


def elapsed(log: GraspLog) -> FloatArray:
    """Time since the first frame, [t] s."""
    since: FloatArray = log.time - log.time[0]
    return since


def find_zero(log: GraspLog, free: BoolArray) -> Zero | None:
    """From the ``free`` frames [t]; None where they, or forces, are missing."""
    if log.force is None or np.count_nonzero(free) < 2:
        return None
    force, time = log.force[free], elapsed(log)[free]
    common, centred = force.mean(axis=(1, 2)), time - time.mean()
    slope = centred @ common / (centred @ centred)
    residual = common - common.mean(axis=0) - centred[:, None] * slope
    error = np.array([error_of_mean(axis) for axis in residual.T])
    touched = np.flatnonzero(~free)
    around = bool(len(touched) and free[: touched[0]].any() and free[touched[-1] :].any())
    drift = slope if around else np.zeros(3)
    return Zero(
        offset=force.mean(axis=0) - time.mean() * drift,
        drift=slope,
        offset_error=error * np.hypot(1.0, time.mean() / time.std() if around else 0.0),
        drift_error=error / time.std(),
        frames=len(time),
        middle=float(time.mean()),
        around=around,
    )


def offsets(zero: Zero | None) -> list[PressResult]:
    """The offset along each axis that the elements have in common, N."""
    if zero is None or zero.frames < ESTIMATE.free_frames:
        return [_too_few(zero)] * 3
    parts = zip(zero.offset.mean(axis=(0, 1)), zero.offset_error, zero.strayed(0.0), strict=True)
    return [PressEstimate(*map(float, each)) for each in parts]


def drifts(zero: Zero | None) -> list[PressResult]:
    """Its drift along each axis, N/s; known where there are free frames before the press and after it."""
    if zero is None or zero.frames < ESTIMATE.free_frames:
        return [_too_few(zero)] * 3
    if not zero.around:
        return ["no frames without contact both before the press and after it: lift the body before the log ends"] * 3
    return [
        PressEstimate(float(value), float(error)) for value, error in zip(zero.drift, zero.drift_error, strict=True)
    ]


def _too_few(zero: Zero | None) -> str:
    frames = 0 if zero is None else zero.frames
    return f"{frames} frames without contact; {ESTIMATE.free_frames} are needed: begin before the touch"
