"""The paper's method as printed, for comparison: unsigned rate of sorted principal strains, counted in frames."""

from dataclasses import dataclass

import numpy as np

from slipcore.defaults import StrainRateLiteralOptions
from slipcore.detection.shared.interface import Method, ObservedFrame
from slipcore.detection.shared.records import Decision
from slipcore.detection.strain_rate.lagged_score import LaggedScore, init_lagged_score, step_lagged_score
from slipcore.frames import BoolArray, FloatArray
from slipcore.surface.strain import (
    Lattice,
    displacement_gradient,
    green_lagrange,
    inclination_factor,
    lattice_steps,
    literal_rate,
    principal_strains,
)


@dataclass(frozen=True, slots=True, eq=False)
class LiteralState:
    """Principal ``strains`` [2, n, m] of the last frame, lagged ``score``, and ``slip`` [n, m]."""

    strains: FloatArray
    score: LaggedScore
    slip: BoolArray


def init(lattice: Lattice, options: StrainRateLiteralOptions) -> LiteralState:
    """Start at rest."""
    shape = lattice.position.shape[:2]
    return LiteralState(np.zeros((2, *shape)), init_lagged_score(shape, options.lag), np.zeros(shape, bool))


def step(
    state: LiteralState, lattice: Lattice, seen: ObservedFrame, options: StrainRateLiteralOptions
) -> tuple[LiteralState, Decision]:
    """A positive extreme of δ above "0.1 × strain / Δt" begins slip, a negative one ends it (paper, section II-D)."""
    strains = _strains(lattice, seen)
    if np.isinf(seen.interval):  # the first frame has no rate
        return LiteralState(strains, state.score, state.slip), Decision(state.slip, state.slip.astype(float))
    rate = literal_rate(state.strains, strains, seen.interval)
    score, events = step_lagged_score(
        state.score, rate, options.rate_floor, threshold=options.threshold, influence=options.influence
    )
    onset = (events > 0) & (rate > options.growth_share * np.hypot(*strains) / seen.interval)
    slip = (state.slip | onset) & ~(events < 0) & seen.stays
    return LiteralState(strains, score, slip), Decision(slip, slip.astype(float))


def _strains(lattice: Lattice, seen: ObservedFrame) -> FloatArray:
    strain = green_lagrange(displacement_gradient(lattice, lattice_steps(seen.displacement)))
    return principal_strains(strain) * inclination_factor(seen.normal)


METHOD = Method(StrainRateLiteralOptions, init, step)
