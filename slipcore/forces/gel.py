"""The mechanics of a sensor's gel, as far as forces follow from displacement by them."""

import math
from dataclasses import dataclass

from slipcore.errors import InvalidInput
from slipcore.forces.defaults import GEL


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
        softest, stiffest = GEL.young_modulus
        inside = softest <= self.young_modulus <= stiffest
        _check("young_modulus", self.young_modulus, inside, f"{softest:g} to {stiffest:g} Pa")
        _check("poisson_ratio", self.poisson_ratio, 0.0 <= self.poisson_ratio <= 0.5, "0 to 0.5")
        thick = self.thickness >= GEL.thickness
        _check("thickness", self.thickness, thick, f"{GEL.thickness:g} m or more, inf for a half-space")
        inside = 0.0 <= self.marker_depth < min(self.thickness, GEL.marker_depth)
        _check("marker_depth", self.marker_depth, inside, f"0 m to less than the thickness, {self.thickness:g} m")


def _check(name: str, value: float, allowed: bool, what: str) -> None:
    if not allowed:
        raise InvalidInput(name, value, what)
