"""Noise of tracked markers."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from slipcore.contact.plan.plan import Plan
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog


@dataclass(frozen=True, slots=True)
class MarkerNoise:
    """Independent normal noise of ``scale`` m on each coordinate of each point in each frame."""

    scale: float

    why: ClassVar[str] = "markers are tracked to a few micrometres, as large as micro-slip"
    cost: ClassVar[str] = "nothing"
    stage: ClassVar[int] = 3

    def __post_init__(self) -> None:
        if not 0.0 <= self.scale < float("inf"):
            raise InvalidInput("scale of marker noise", self.scale, "at least 0 m")

    @property
    def absent(self) -> bool:
        """Whether there is no noise."""
        return self.scale == 0.0

    def extend(self, plan: Plan) -> Plan:
        """Add an observation."""
        return replace(plan, observations=(*plan.observations, self))

    def observe(self, log: GraspLog, rng: np.random.Generator) -> GraspLog:
        """The log with noise on its displacements."""
        return replace(log, displacement=log.displacement + self.scale * rng.standard_normal(log.displacement.shape))
