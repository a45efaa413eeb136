"""The mechanics of a sensor's gel, as far as forces follow from displacement by them."""

import math
from dataclasses import dataclass

from slipcore.errors import InvalidInput


@dataclass(frozen=True, slots=True)
class Gel:
    """Gel of ``young_modulus`` Pa and ``poisson_ratio``, bonded to a rigid base ``thickness`` m below its surface (inf:
    a half-space), with markers ``marker_depth`` m below the surface. Raises ``InvalidInput``.
    """

    young_modulus: float
    poisson_ratio: float
    thickness: float = math.inf
    marker_depth: float = 0.0

    def __post_init__(self) -> None:
        _check("young_modulus", self.young_modulus, 1e2 <= self.young_modulus <= 1e12, "100 to 1e12 Pa")
        _check("poisson_ratio", self.poisson_ratio, 0.0 <= self.poisson_ratio <= 0.5, "0 to 0.5")
        _check("thickness", self.thickness, self.thickness >= 1e-6, "1e-6 m or more, inf for a half-space")
        inside = 0.0 <= self.marker_depth < min(self.thickness, 1.0)
        _check("marker_depth", self.marker_depth, inside, f"0 m to less than the thickness, {self.thickness:g} m")


def _check(name: str, value: float, allowed: bool, what: str) -> None:
    if not allowed:
        raise InvalidInput(name, value, what)
