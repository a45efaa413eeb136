"""Frames that never arrive."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from slipcore.contact.plan.entries import check_own_types
from slipcore.contact.plan.plan import Observed
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog


@dataclass(frozen=True, slots=True)
class DroppedFrames(Observed):
    """Each frame but the first and the last is lost with ``probability``."""

    probability: float

    why: ClassVar[str] = "a gap changes the time step, and must not change what a detector finds"
    cost: ClassVar[str] = "nothing"
    stage: ClassVar[int] = 1

    def __post_init__(self) -> None:
        check_own_types(self)
        if not 0.0 <= self.probability < 1.0:
            raise InvalidInput("probability of a lost frame", self.probability, "0 to below 1")

    @property
    def absent(self) -> bool:
        """Whether all frames arrive."""
        return self.probability == 0.0

    def observe(self, log: GraspLog, rng: np.random.Generator) -> GraspLog:
        """The log without the lost frames; a point that moved in a lost frame moved before the next one kept."""
        kept = rng.random(len(log)) >= self.probability
        kept[[0, -1]] = True
        left = log.take(kept)
        if log.truth is None or left.truth is None:
            return left
        first = np.concatenate(([0], np.flatnonzero(kept)[:-1] + 1))
        moved = np.logical_or.reduceat(log.truth.slip_kinematic, first, axis=0)
        return replace(left, truth=replace(left.truth, slip_kinematic=moved))
