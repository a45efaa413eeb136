"""How far two logs of a scene are apart."""

from dataclasses import dataclass

import numpy as np

from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray, GraspLog


@dataclass(frozen=True, slots=True)
class Difference:
    """How far two logs of a scene are apart.

    ``stick_ratio``: largest absolute difference over time; ``displacement``, ``force``: relative L2 over time at the
    sensor's points.
    """

    stick_ratio: float
    displacement: float
    force: float

    def times(self, factor: float) -> "Difference":
        """All three multiplied."""
        return Difference(factor * self.stick_ratio, factor * self.displacement, factor * self.force)

    def plus(self, other: "Difference") -> "Difference":
        """All three added."""
        return Difference(
            self.stick_ratio + other.stick_ratio, self.displacement + other.displacement, self.force + other.force
        )

    @property
    def largest(self) -> float:
        """The largest of the three: what ``accuracy`` means."""
        return max(self.stick_ratio, self.displacement, self.force)


def difference(log: GraspLog, reference: GraspLog) -> Difference:
    """Difference of a log from a reference at the same points and frames; both with truth, before observation."""
    if log.truth is None or reference.truth is None or log.force is None or reference.force is None:
        raise InvalidInput("log", "without truth or forces", "a simulated log")
    ratios = np.abs(log.truth.stick_ratio - reference.truth.stick_ratio)
    return Difference(
        stick_ratio=float(np.nanmax(ratios, initial=0.0)),
        displacement=_relative(log.displacement, reference.displacement),
        force=_relative(log.force, reference.force),
    )


def _relative(values: FloatArray, reference: FloatArray) -> float:
    size = float(np.sqrt(np.sum(reference**2)))
    return float(np.sqrt(np.sum((values - reference) ** 2))) / size if size > 0.0 else 0.0
