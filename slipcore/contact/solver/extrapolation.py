"""What stresses come to if the load goes on as it did: where the next step's equations start.

Traction itself cannot be extrapolated: its growth has a spike at the front of the stick zone, which moves on. Where a
contact slips from its edge, (1 − |q|/μp)² = (c² − r²)/(a² − r²) within the stick radius c (Cattaneo–Mindlin): linear
in c², and zero at the front. So this is extrapolated, along the traction; across it traction goes on as it did.
"""

from typing import NamedTuple

import numpy as np

from slipcore.compilation import compiled
from slipcore.contact.defaults import STEP
from slipcore.frames import FloatArray


class Stress(NamedTuple):
    """``pressure`` [ny, nx], ``traction`` [2, ny, nx] and Coulomb ``limit`` [ny, nx], all Pa."""

    pressure: FloatArray
    traction: FloatArray
    limit: FloatArray


def continuation(before: FloatArray, drive: FloatArray) -> float:
    """How far the last step's change of stress goes on in this one: along the same drive, never backward."""
    size = float(before @ before)
    return min(max(float(before @ drive) / size, 0.0), STEP.longest_extrapolation) if size > 0.0 else 0.0


def extrapolated(now: Stress, before: Stress, share: float) -> Stress:
    """Stresses after ``share`` of the change from ``before`` to ``now`` once more."""
    pressure = _continued(now.pressure.reshape(-1), before.pressure.reshape(-1), share).reshape(now.pressure.shape)
    limit = _continued(now.limit.reshape(-1), before.limit.reshape(-1), share).reshape(now.limit.shape)
    traction = np.empty_like(now.traction)
    _extrapolate_traction(
        now.traction.reshape(2, -1),
        before.traction.reshape(2, -1),
        now.limit.reshape(-1),
        before.limit.reshape(-1),
        limit.reshape(-1),
        share,
        traction.reshape(2, -1),
    )
    return Stress(pressure, traction, limit)


@compiled
def _continued(now: FloatArray, before: FloatArray, share: float) -> FloatArray:
    """Values [n] after ``share`` of their change once more, never below zero."""
    following = np.empty_like(now)
    for i in range(now.size):
        value = now[i] + share * (now[i] - before[i])
        following[i] = value if value > 0.0 else 0.0
    return following


@compiled
def _extrapolate_traction(
    traction: FloatArray,
    earlier: FloatArray,
    limit: FloatArray,
    earlier_limit: FloatArray,
    next_limit: FloatArray,
    share: float,
    following: FloatArray,
) -> None:
    """Fill ``following`` [2, n] from tractions [2, n] and limits [n], as the module's text has it."""
    for i in range(limit.size):
        qx, qy, ex, ey = traction[0, i], traction[1, i], earlier[0, i], earlier[1, i]
        cx, cy = qx + share * (qx - ex), qy + share * (qy - ey)
        size = np.sqrt(qx * qx + qy * qy)
        if size > 0.0 and limit[i] > 0.0 and earlier_limit[i] > 0.0:
            nx, ny = qx / size, qy / size
            left = 1.0 - min(size / limit[i], 1.0)
            left_before = 1.0 - min((ex * nx + ey * ny) / earlier_limit[i], 1.0)
            square = left * left + share * (left * left - left_before * left_before)
            along = next_limit[i] * (1.0 - np.sqrt(max(square, 0.0))) - (cx * nx + cy * ny)
            cx, cy = cx + along * nx, cy + along * ny
        following[0, i], following[1, i] = cx, cy
