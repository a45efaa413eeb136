"""A scene in, a log with truth out."""

import zlib
from dataclasses import replace

import numpy as np

from slipcore.contact import boundary_elements
from slipcore.contact.boundary_elements import Fidelity
from slipcore.contact.plan import Plan
from slipcore.contact.scene import Scene
from slipcore.frames import GraspLog


def simulate(scene: Scene, fidelity: Fidelity | None = None, seed: int = 0) -> GraspLog:
    """Simulate a scene; ``seed`` draws its random fields and its noise.

    Raises ``InfeasibleLoad`` where friction cannot carry a load, ``NotConverged`` and ``InvalidInput``.
    """
    plan = scene.plan(seed)
    log = boundary_elements.run(plan, fidelity)
    return observe(plan, replace(log, metadata={"scene": scene.name, **log.metadata}))


def observe(plan: Plan, log: GraspLog) -> GraspLog:
    """The log as the plan's observation effects let it be seen; each has a random generator of its own."""
    for effect in sorted(plan.observations, key=lambda effect: (effect.stage, type(effect).__name__, repr(effect))):
        own = zlib.crc32(type(effect).__name__.encode())
        log = effect.observe(log, np.random.default_rng([plan.seed, own]))
    return log
