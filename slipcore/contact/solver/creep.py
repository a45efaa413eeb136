"""Creep of a viscoelastic finger, one internal displacement a Maxwell branch (Prony series of the creep compliance).

With J(t) = J_0 [1 + Σ c (1 − exp(−t/τ))] a branch follows ẇ = (c e − w)/τ, where e is the displacement that the loads
of the moment would make at once. Within a step e is taken to change linearly, for which the update is exact.
"""

from collections.abc import Sequence

import numpy as np

from slipcore.contact.solver.problem import MaxwellBranch
from slipcore.frames import FloatArray


def _weights(branch: MaxwellBranch, duration: float) -> tuple[float, float, float]:
    """Factors of w, of e at the begin and of e at the end of a step, in w at its end."""
    ratio = duration / branch.time
    decayed = -float(np.expm1(-ratio))
    late = 1.0 - decayed / ratio
    return 1.0 - decayed, branch.strength * (decayed - late), branch.strength * late


def creep_compliance(branches: Sequence[MaxwellBranch], duration: float) -> float:
    """How much softer the finger is to what is applied within a step of ``duration`` s."""
    return 1.0 + sum(_weights(branch, duration)[2] for branch in branches)


def creep_recalled(
    branches: Sequence[MaxwellBranch], creep: Sequence[FloatArray], elastic: FloatArray, duration: float
) -> FloatArray | None:
    """Displacement [3, ny, nx] m at the end of a step that what came before it makes; None without branches."""
    parts = [
        kept * w + early * elastic
        for w, (kept, early, _) in zip(creep, (_weights(branch, duration) for branch in branches), strict=True)
    ]
    return sum(parts[1:], start=parts[0]) if parts else None


def creep_step(
    branches: Sequence[MaxwellBranch],
    creep: Sequence[FloatArray],
    before: FloatArray,
    after: FloatArray,
    duration: float,
) -> tuple[FloatArray, ...]:
    """The branches' displacements after a step in which the elastic one went from ``before`` to ``after``."""
    return tuple(
        kept * w + early * before + late * after
        for w, (kept, early, late) in zip(creep, (_weights(b, duration) for b in branches), strict=True)
    )
