"""An object that gives way too."""

from dataclasses import dataclass, replace
from typing import ClassVar

from slipcore.contact.defaults import SCENE
from slipcore.contact.elasticity.influence import HalfSpace, MirroredBody
from slipcore.contact.plan.entries import check_own_types
from slipcore.contact.plan.plan import Plan
from slipcore.errors import InvalidInput


@dataclass(frozen=True, slots=True)
class ElasticObject:
    """Object of ``young_modulus`` Pa (inf is rigid) and ``poisson_ratio``, with the compliance of a half-space."""

    young_modulus: float
    poisson_ratio: float = SCENE.object_poisson_ratio

    why: ClassVar[str] = "a soft object makes the contact larger and the finger's share of the motion smaller"
    cost: ClassVar[str] = "two applications a step, to separate the finger's displacement from the object's"

    def __post_init__(self) -> None:
        check_own_types(self)
        if not self.young_modulus > 0.0:
            raise InvalidInput("Young's modulus of the object", self.young_modulus, "above 0 Pa, inf for a rigid one")

    @property
    def absent(self) -> bool:
        """Whether the object is rigid."""
        return self.young_modulus == float("inf")

    def extend(self, plan: Plan) -> Plan:
        """Add the object's compliance."""
        body = MirroredBody(HalfSpace.from_young(self.young_modulus, self.poisson_ratio))
        return replace(plan, problem=replace(plan.problem, obstacle=(*plan.problem.obstacle, body)))
