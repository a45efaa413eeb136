"""A finger that creeps."""

from dataclasses import dataclass, replace
from typing import ClassVar

from slipcore.contact.plan.entries import check_own_types
from slipcore.contact.plan.plan import Plan
from slipcore.contact.solver.problem import MaxwellBranch
from slipcore.errors import InvalidInput


@dataclass(frozen=True, slots=True)
class Viscoelasticity:
    """Prony series of the creep compliance, J(t) = J₀ [1 + Σ strength (1 − exp(−t / time))], at constant ν.

    ``strength`` [k] and ``time`` [k] s; the finger's modulus is the one of fast loads.
    """

    strength: tuple[float, ...]
    time: tuple[float, ...]

    why: ClassVar[str] = "gels creep: contact grows and points move while loads stand still"
    cost: ClassVar[str] = "two applications a step and one kept field a branch"

    def __post_init__(self) -> None:
        check_own_types(self)
        if len(self.strength) != len(self.time):
            raise InvalidInput("strength and time", f"{len(self.strength)} and {len(self.time)}", "as many of each")

    @property
    def absent(self) -> bool:
        """Whether nothing creeps."""
        return not any(self.strength)

    def extend(self, plan: Plan) -> Plan:
        """Add a branch for each term."""
        branches = tuple(MaxwellBranch(*pair) for pair in zip(self.strength, self.time, strict=True) if pair[0] > 0.0)
        return replace(plan, problem=replace(plan.problem, creep=(*plan.problem.creep, *branches)))
