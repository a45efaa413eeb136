"""Friction that changes with the sliding velocity (the paper's β₁)."""

from dataclasses import dataclass, replace
from typing import ClassVar

from slipcore.contact.plan.plan import Plan
from slipcore.frames import FloatArray


@dataclass(frozen=True, slots=True)
class VelocityFriction:
    """μ changes by ``slope`` s/m times the tangential velocity of the cell against the object."""

    slope: float

    why: ClassVar[str] = "friction rises or falls once a point moves; the paper's friction model has it"
    cost: ClassVar[str] = "a fixed point: 4 to 40 tangential solutions a step, most near full sliding"

    @property
    def absent(self) -> bool:
        """Whether friction does not depend on velocity."""
        return self.slope == 0.0

    def extend(self, plan: Plan) -> Plan:
        """Add a law of velocity, and β₁ to the scene's friction law."""
        slope = self.slope

        def law(velocity: FloatArray) -> FloatArray:
            return slope * velocity

        b0, b1, b2 = plan.law.coefficients
        problem = replace(plan.problem, velocity_laws=(*plan.problem.velocity_laws, law))
        return replace(plan, problem=problem, law=replace(plan.law, coefficients=(b0, b1 + slope, b2)))
