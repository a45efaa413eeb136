"""A gel that is not thick against the contact."""

from dataclasses import dataclass, replace
from typing import ClassVar

from slipcore.contact.elasticity.bonded_layer import LayerBase
from slipcore.contact.plan.entries import check_own_types
from slipcore.contact.plan.plan import Plan
from slipcore.errors import InvalidInput


@dataclass(frozen=True, slots=True)
class FiniteLayer:
    """Gel of ``thickness`` m (inf is a half-space) bonded to a rigid base."""

    thickness: float

    why: ClassVar[str] = "the base stiffens a gel not thick against the contact, and pressing shears it at any ν"
    cost: ClassVar[str] = "influence functions, made once a grid; nothing a step"

    def __post_init__(self) -> None:
        check_own_types(self)
        if not self.thickness > 0.0:
            raise InvalidInput("thickness of the layer", self.thickness, "above 0 m, inf for a half-space")

    @property
    def absent(self) -> bool:
        """Whether there is no base."""
        return self.thickness == float("inf")

    def extend(self, plan: Plan) -> Plan:
        """Take from the finger's compliance what the base holds back; a finger has one base."""
        problem = plan.problem
        if any(isinstance(body, LayerBase) for body in problem.finger):
            raise InvalidInput("finite layers", "two", "one")
        base = LayerBase(self.thickness, plan.young_modulus, plan.poisson_ratio)
        return replace(plan, problem=replace(problem, finger=(*problem.finger, base)))
