"""Lateral displacement by pressing, without its way back into the pressure."""

from dataclasses import dataclass, replace
from typing import ClassVar

from slipcore.contact.plan.plan import Plan


@dataclass(frozen=True, slots=True)
class PressingSpread:
    """Pressure moves the surface sideways (in proportion to 1 − 2ν on a half-space), but traction does not move it
    in.
    """

    why: ClassVar[str] = "pressing alone strains the surface, which a strain threshold takes for slip"
    cost: ClassVar[str] = "one or two applications a step"

    @property
    def absent(self) -> bool:
        """Never: its strength is the material's."""
        return False

    def extend(self, plan: Plan) -> Plan:
        """Let tangential contact know of the pressure."""
        return replace(plan, problem=replace(plan.problem, spread=True))
