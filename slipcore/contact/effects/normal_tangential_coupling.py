"""Pressure that moves the surface sideways, and traction that moves it in and out."""

from dataclasses import dataclass, replace
from typing import ClassVar

from slipcore.contact.plan.plan import Plan


@dataclass(frozen=True, slots=True)
class NormalTangentialCoupling:
    """Both directions of the coupling, which a half-space has in proportion to 1 − 2ν and a layer at any ν."""

    why: ClassVar[str] = "pressing alone makes traction where materials differ or the gel is thin"
    cost: ClassVar[str] = "a fixed point of normal and tangential contact: 3 to 8 times a step"

    @property
    def absent(self) -> bool:
        """Never: its strength is the material's."""
        return False

    def extend(self, plan: Plan) -> Plan:
        """Let normal and tangential contact know of each other."""
        return replace(plan, problem=replace(plan.problem, coupled=True))
