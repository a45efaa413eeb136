"""Frames that never arrive."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from slipcore.contact.plan.plan import Observed
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog, GroundTruth


@dataclass(frozen=True, slots=True)
class DroppedFrames(Observed):
    """Each frame but the first and the last is lost with ``probability``."""

    probability: float

    why: ClassVar[str] = "a gap changes the time step, and must not change what a detector finds"
    cost: ClassVar[str] = "nothing"
    stage: ClassVar[int] = 1

    def __post_init__(self) -> None:
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
        return replace(
            log,
            time=log.time[kept],
            displacement=log.displacement[kept],
            force=None if log.force is None else log.force[kept],
            normal=None if log.normal is None else log.normal[kept],
            object_pose=None if log.object_pose is None else log.object_pose[kept],
            truth=None if log.truth is None else _kept_truth(log.truth, kept),
        )


def _kept_truth(truth: GroundTruth, kept: np.ndarray) -> GroundTruth:
    first = np.concatenate(([0], np.flatnonzero(kept)[:-1] + 1))
    moved = np.logical_or.reduceat(truth.slip_kinematic, first, axis=0)
    return replace(
        truth,
        contact=truth.contact[kept],
        slip_kinematic=moved,
        slip_contact_factor=truth.slip_contact_factor[kept],
        stick_ratio=truth.stick_ratio[kept],
    )
