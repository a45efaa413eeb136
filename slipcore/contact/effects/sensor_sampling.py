"""Where and when a sensor looks."""

from dataclasses import dataclass, replace
from typing import ClassVar

from slipcore.contact.defaults import RAMP
from slipcore.contact.plan.entries import check_own_types
from slipcore.contact.plan.plan import Plan, SamplingPlan
from slipcore.defaults import LIMITS
from slipcore.errors import InvalidInput


@dataclass(frozen=True, slots=True)
class SensorSampling:
    """``points`` (along x, along y) at ``pitch`` m about the centre, ``frame_rate`` 1/s.

    Displacement is that of the point; force is that on the square of ``pitch`` around it.
    """

    points: tuple[int, int] = (RAMP.points, RAMP.points)
    pitch: float = RAMP.pitch
    frame_rate: float = RAMP.frame_rate

    why: ClassVar[str] = "a sensor sees points and frames, not fields: an element mixes stick and slip"
    cost: ClassVar[str] = "nothing: points are cell centres, elements are sums of cells"

    def __post_init__(self) -> None:
        check_own_types(self)
        if min(self.points) < 2:
            raise InvalidInput("points of the sensor", self.points, "at least 2 each way")
        if not (self.pitch > 0.0 and self.frame_rate > 0.0):
            raise InvalidInput("sensor", self, "pitch above 0 m and frame rate above 0 1/s")
        across, (low, high) = (max(self.points) - 1) * self.pitch, LIMITS.extent
        if not across <= high:
            raise InvalidInput("sensor", f"{across:.3g} m across, by its points and pitch", f"{low:g} to {high:g} m")

    @property
    def absent(self) -> bool:
        """Never: its absence is a log of every cell and step."""
        return False

    def extend(self, plan: Plan) -> Plan:
        """Set the sampling; a scene has one sensor."""
        if plan.sampling is not None:
            raise InvalidInput("sensor samplings", "two", "one")
        return replace(plan, sampling=SamplingPlan(self.points, self.pitch, self.frame_rate))
