"""A gel that has not come back to rest."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from slipcore.contact.plan.plan import Observed
from slipcore.frames import GraspLog


@dataclass(frozen=True, slots=True)
class GelDrift(Observed):
    """Offset of all points that grows at ``velocity`` (x, y, z) m/s from the first frame on."""

    velocity: tuple[float, float, float]

    why: ClassVar[str] = "gels drift with temperature and creep: an offset is not a slip"
    cost: ClassVar[str] = "nothing"
    stage: ClassVar[int] = 2

    @property
    def absent(self) -> bool:
        """Whether nothing drifts."""
        return not any(self.velocity)

    def observe(self, log: GraspLog, rng: np.random.Generator) -> GraspLog:  # noqa: ARG002 - nothing random here
        """The log with the offset on its displacements."""
        offset = np.multiply.outer(log.time - log.time[0], self.velocity)
        return replace(log, displacement=log.displacement + offset[:, None, None, :])
