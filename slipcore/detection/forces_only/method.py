"""Stick and slip from forces alone, for taxels and pillars without displacement; no friction coefficient is given.

As the load grows, an element that slips takes ever less of it, until its force ratio stands at the friction
coefficient, while its neighbours take over (Cattaneo, 1938; between pillars: Khamis et al., 2018). Which friction the
contact has is not known: its probability is followed on a grid, by how well each value explains which elements take
less at what force ratio, and that none stands above it. Everything goes by changes of the load: what is held changes
nothing.
"""

from typing import Any

import numpy as np

from slipcore.defaults import ForcesOnlyOptions
from slipcore.detection.forces_only.step import ForcesState, MeasuredForces, step_forces
from slipcore.detection.forces_only.tuning import considered, prior
from slipcore.detection.shared.interface import Method, ObservedFrame
from slipcore.detection.shared.records import Decision, read_only
from slipcore.surface.strain import Lattice


def init(lattice: Lattice, options: ForcesOnlyOptions) -> ForcesState:
    """Nothing touches yet."""
    nothing, vectors = np.zeros(lattice.position.shape[:2]), np.zeros(lattice.position.shape)
    return ForcesState(nothing, vectors, nothing, vectors, nothing > 0.0, nothing, prior(options), nothing)


def step(
    state: ForcesState, lattice: Lattice, seen: ObservedFrame, options: ForcesOnlyOptions
) -> tuple[ForcesState, Decision]:
    """Follow the forces, and look at them once the load has changed by more than noise."""
    shape = seen.contact.shape
    if seen.force.size == 0:
        return state, Decision(np.zeros(shape, bool), np.full(shape, 0.5))
    after, decision = ForcesState._make(map(np.empty_like, state)), Decision(np.empty(shape, bool), np.empty(shape))
    frame = MeasuredForces(
        float(seen.interval),
        read_only(lattice.position),
        read_only(seen.force),
        seen.pressing,
        seen.normal,
        seen.contact,
        seen.stays,
        float(seen.force_noise),
    )
    plain: list[Any] = [tuple(part) for part in (state, frame, considered(options), after, decision)]
    step_forces(*plain)  # numba is slow at named tuples from Python
    return after, decision


METHOD = Method(ForcesOnlyOptions, init, step)
