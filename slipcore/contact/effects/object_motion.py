"""An object that is moved, whatever force that takes."""

from dataclasses import dataclass
from typing import ClassVar

from slipcore.contact.effects.load_path import check_path, with_paths
from slipcore.contact.plan.plan import MOTIONS, Plan

COORDINATES = ("x", "y", "yaw")


@dataclass(frozen=True, slots=True)
class ObjectMotion:
    """Pose of the object relative to the sensor, piecewise linear between ``time`` s, empty for what is not held.

    ``x``, ``y`` m and ``yaw`` rad, each of the length of ``time`` or empty; the part after the first time is gone
    through ``cycles`` times. What is not given here moves as its load wants.
    """

    time: tuple[float, ...]
    x: tuple[float, ...] = ()
    y: tuple[float, ...] = ()
    yaw: tuple[float, ...] = ()
    cycles: int = 1

    why: ClassVar[str] = "a stage or a robot moves the object; the contact may slide as a whole"
    cost: ClassVar[str] = "less than a load: no balance to meet"

    def __post_init__(self) -> None:
        check_path(self, COORDINATES)

    @property
    def absent(self) -> bool:
        """Whether nothing is held; an object held still is not."""
        return not any(len(getattr(self, name)) for name in COORDINATES)

    def extend(self, plan: Plan) -> Plan:
        """Add a history of each coordinate that is held."""
        return with_paths(plan, self, MOTIONS, COORDINATES)
