"""A place that rubs more or less than the rest."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from slipcore.contact.plan.entries import check_own_types
from slipcore.contact.plan.plan import Plan
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray


@dataclass(frozen=True, slots=True)
class FrictionPatch:
    """μ changes by ``change`` within ``radius`` m of ``centre`` (x, y) m on the sensor: a label, a wet spot, a seam."""

    change: float
    centre: tuple[float, float]
    radius: float

    why: ClassVar[str] = "objects are not made of one material: slip starts in the slippery place"
    cost: ClassVar[str] = "nothing: one field, made before the first step"

    def __post_init__(self) -> None:
        check_own_types(self)
        if not self.radius > 0.0:
            raise InvalidInput("radius of the friction patch", self.radius, "above 0 m")

    @property
    def absent(self) -> bool:
        """Whether the place is like the rest."""
        return self.change == 0.0

    def extend(self, plan: Plan) -> Plan:
        """Add the field."""
        (x0, y0), radius, change = self.centre, self.radius, self.change

        def field(x: FloatArray, y: FloatArray) -> FloatArray:
            return np.where(np.hypot(x - x0, y - y0) <= radius, change, 0.0)

        return replace(plan, problem=replace(plan.problem, friction_fields=(*plan.problem.friction_fields, field)))
