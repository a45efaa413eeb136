"""A moment about the surface's normal."""

from dataclasses import dataclass, replace
from typing import ClassVar

from slipcore.contact.plan.plan import Plan, ramp


@dataclass(frozen=True, slots=True)
class Torsion:
    """``moment`` N·m on the finger about the outward normal, reached from ``start`` s within ``duration`` s, then
    held.
    """

    moment: float
    start: float = 1.0
    duration: float = 1.0

    why: ClassVar[str] = "twists the contact: slip starts at its edge all around"
    cost: ClassVar[str] = "nothing beside a tangential load: one more unknown of the projection"

    @property
    def absent(self) -> bool:
        """Whether there is no moment."""
        return self.moment == 0.0

    def extend(self, plan: Plan) -> Plan:
        """Add a ramp of the moment."""
        added = ramp("moment", self.moment, self.start, self.duration)
        return replace(plan, histories=(*plan.histories, added))
