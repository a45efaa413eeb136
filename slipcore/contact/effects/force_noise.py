"""Noise of reconstructed element forces."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from slipcore.contact.effects.noise import Noise
from slipcore.frames import GraspLog


@dataclass(frozen=True, slots=True)
class ForceNoise(Noise):
    """Independent normal noise of ``scale`` N on each component of each element's force in each frame."""

    why: ClassVar[str] = "noise in f_n biases the friction law: it stands on both sides of the fit"
    of: ClassVar[str] = "force"
    unit: ClassVar[str] = "N"

    def observe(self, log: GraspLog, rng: np.random.Generator) -> GraspLog:
        """The log with noise on its forces."""
        if log.force is None:
            return log
        return replace(log, force=log.force + self.scale * rng.standard_normal(log.force.shape))
