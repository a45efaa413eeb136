"""Contact mechanics with known truth: closed-form references and the contact simulator."""

from slipcore.contact import reference
from slipcore.contact.ramp import RampSchedule, tangential_ramp

__all__ = ["RampSchedule", "reference", "tangential_ramp"]
