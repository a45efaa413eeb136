"""A force along the surface."""

from dataclasses import dataclass, replace
from typing import ClassVar

from slipcore.contact.plan.plan import Plan, ramp


@dataclass(frozen=True, slots=True)
class TangentialLoad:
    """``force`` (F_x, F_y) N on the finger, reached from ``start`` s within ``duration`` s, then held."""

    force: tuple[float, float]
    start: float = 1.0
    duration: float = 1.0

    why: ClassVar[str] = "shears the contact: slip starts at its edge"
    cost: ClassVar[str] = "the tangential solver: 10 to 30 applications a step"

    @property
    def absent(self) -> bool:
        """Whether there is no force."""
        return self.force[0] == 0.0 and self.force[1] == 0.0

    def extend(self, plan: Plan) -> Plan:
        """Add a ramp of each component."""
        along_x = ramp("force_x", self.force[0], self.start, self.duration)
        along_y = ramp("force_y", self.force[1], self.start, self.duration)
        added = tuple(history for history in (along_x, along_y) if history.value[-1] != 0.0)
        return replace(plan, histories=(*plan.histories, *added))
