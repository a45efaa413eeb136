"""Contact mechanics with known truth: closed-form references and the contact simulator."""

from slipcore.contact import reference
from slipcore.contact.boundary_elements import Fidelity
from slipcore.contact.errors import InfeasibleLoad, NotConverged
from slipcore.contact.ramp import RampSchedule, tangential_ramp
from slipcore.contact.scene import Finger, Press, Scene, library
from slipcore.contact.simulate import simulate

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
