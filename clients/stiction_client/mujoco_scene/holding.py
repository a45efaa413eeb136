"""How much a bench holds, and how fast it creeps before it slips."""

import copy
import math
from dataclasses import dataclass, replace

import mujoco

from stiction_client.exports.mujoco import IMPRATIO, NOSLIP_ITERATIONS
from stiction_client.mujoco_scene.bench import Bench

DIRECTIONS = (0.0, 0.25 * math.pi, 0.5 * math.pi, 0.75 * math.pi)
"""rad to the first tangent: a pyramid holds least between its edges."""

CREEP_SHARE = 0.95
"""Of the load that the written friction holds, under which creep is measured."""

LEAST_LOAD = 1e-3
"""N; where to look first for a contact without friction."""


@dataclass(frozen=True, slots=True)
class Held:
    """Effective ``friction``: the least tangential load over the normal force at which the pair slips, of four
    directions. ``creep`` m/s in that direction under 95 % of what its written friction holds; infinite if it slips.
    """

    friction: float
    creep: float


def held(bench: Bench, capacity: float) -> Held:
    """Bisect and measure; ``capacity`` N: what the written friction holds."""
    loads = {angle: bench.slip_load(angle, max(capacity, LEAST_LOAD)) for angle in DIRECTIONS}
    weakest = min(loads, key=lambda angle: loads[angle])
    creep = bench.speed(CREEP_SHARE * capacity, weakest)
    return Held(loads[weakest] / bench.normal_force, max(creep, 0.0))


def advised(bench: Bench) -> Bench | None:
    """The same with ``HOLDING_OPTION``; None where the scene has that already."""
    option = bench.model.opt
    elliptic = option.cone == mujoco.mjtCone.mjCONE_ELLIPTIC
    if elliptic and option.impratio >= IMPRATIO and option.noslip_iterations >= NOSLIP_ITERATIONS:
        return None
    model = copy.deepcopy(bench.model)
    model.opt.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    model.opt.impratio = max(option.impratio, IMPRATIO)
    model.opt.noslip_iterations = max(option.noslip_iterations, NOSLIP_ITERATIONS)
    return replace(bench, model=model)
