"""Noise of reconstructed element forces."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from slipcore.contact.plan.plan import Plan
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog


@dataclass(frozen=True, slots=True)
class ForceNoise:
    """Independent normal noise of ``scale`` N on each component of each element's force in each frame."""

    scale: float

    why: ClassVar[str] = "noise in f_n biases the friction law: it stands on both sides of the fit"
    cost: ClassVar[str] = "nothing"
    stage: ClassVar[int] = 3

    def __post_init__(self) -> None:
        if not 0.0 <= self.scale < float("inf"):
            raise InvalidInput("scale of force noise", self.scale, "at least 0 N")

    @property
    def absent(self) -> bool:
        """Whether there is no noise."""
        return self.scale == 0.0

    def extend(self, plan: Plan) -> Plan:
        """Add an observation."""
        return replace(plan, observations=(*plan.observations, self))

    def observe(self, log: GraspLog, rng: np.random.Generator) -> GraspLog:
        """The log with noise on its forces."""
        if log.force is None:
            return log
        return replace(log, force=log.force + self.scale * rng.standard_normal(log.force.shape))
