"""Noise of tracked markers."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from slipcore.contact.effects.noise import Noise
from slipcore.frames import GraspLog


@dataclass(frozen=True, slots=True)
class MarkerNoise(Noise):
    """Independent normal noise of ``scale`` m on each coordinate of each point in each frame."""

    why: ClassVar[str] = "markers are tracked to a few micrometres, as large as micro-slip"
    of: ClassVar[str] = "marker"
    unit: ClassVar[str] = "m"

    def observe(self, log: GraspLog, rng: np.random.Generator) -> GraspLog:
        """The log with noise on its displacements."""
        return replace(log, displacement=log.displacement + self.scale * rng.standard_normal(log.displacement.shape))
