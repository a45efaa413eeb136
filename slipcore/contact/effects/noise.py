"""What noise of markers and of forces have in common."""

from dataclasses import dataclass
from typing import ClassVar

from slipcore.contact.plan.entries import check_own_types
from slipcore.contact.plan.plan import Observed
from slipcore.errors import InvalidInput


@dataclass(frozen=True, slots=True)
class Noise(Observed):
    """Independent normal noise of standard deviation ``scale`` on each component of some field in each frame."""

    scale: float

    of: ClassVar[str]
    unit: ClassVar[str]
    cost: ClassVar[str] = "nothing"
    stage: ClassVar[int] = 3

    def __post_init__(self) -> None:
        check_own_types(self)
        if not 0.0 <= self.scale < float("inf"):
            raise InvalidInput(f"scale of {self.of} noise", self.scale, f"at least 0 {self.unit}")

    @property
    def absent(self) -> bool:
        """Whether there is no noise."""
        return self.scale == 0.0
