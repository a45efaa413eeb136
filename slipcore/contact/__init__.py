"""Contact mechanics with known truth: closed-form references and the contact simulator."""

from slipcore.contact import reference
from slipcore.contact.errors import InfeasibleLoad, NotConverged
from slipcore.contact.scene import Finger, Press, Scene, library, simulate
from slipcore.contact.tiers.boundary_elements import Fidelity
from slipcore.contact.tiers.ramp import RampSchedule, tangential_ramp

__all__ = [
    "Fidelity",
    "Finger",
    "InfeasibleLoad",
    "NotConverged",
    "Press",
    "RampSchedule",
    "Scene",
    "library",
    "reference",
    "simulate",
    "tangential_ramp",
]
