"""Friction that changes with the normal force (the paper's β₂)."""

from dataclasses import dataclass, replace
from typing import ClassVar

from slipcore.contact.plan.entries import check_own_types
from slipcore.contact.plan.plan import Plan
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray


@dataclass(frozen=True, slots=True)
class PressureFriction:
    """μ changes by ``slope`` 1/N times the normal force on a sensor element of ``element_area`` m²."""

    slope: float
    element_area: float

    why: ClassVar[str] = "soft materials rub less under more pressure; the paper's friction model has it"
    cost: ClassVar[str] = "nothing: the limit is known before the tangential step"

    def __post_init__(self) -> None:
        check_own_types(self)
        if not self.element_area > 0.0:
            raise InvalidInput("element_area", self.element_area, "above 0 m²")

    @property
    def absent(self) -> bool:
        """Whether friction does not depend on pressure."""
        return self.slope == 0.0

    def extend(self, plan: Plan) -> Plan:
        """Add a law of pressure, and β₂ to the scene's friction law."""
        per_pascal = self.slope * self.element_area

        def law(pressure: FloatArray) -> FloatArray:
            return per_pascal * pressure

        b0, b1, b2 = plan.law.coefficients
        problem = replace(plan.problem, pressure_laws=(*plan.problem.pressure_laws, law))
        return replace(plan, problem=problem, law=replace(plan.law, coefficients=(b0, b1, b2 + self.slope)))
