"""The mechanics of a sensor's gel, as far as forces follow from displacement by them."""

import math
from collections.abc import Mapping
from dataclasses import MISSING, asdict, dataclass, fields
from typing import Any

from slipcore.arguments import number, shown
from slipcore.errors import InvalidInput
from slipcore.forces.defaults import GEL


@dataclass(frozen=True, slots=True)
class Gel:
    """Gel of ``young_modulus`` Pa and ``poisson_ratio``, bonded to a rigid base ``thickness`` m below its surface (inf
    or None: a half-space), with markers ``marker_depth`` m below the surface. Raises ``InvalidInput``.

    ``relative_thickness``: of a gel that is not alike thick everywhere, at each marker [n, m], over ``thickness``.
    """

    young_modulus: float
    poisson_ratio: float
    thickness: float = math.inf
    marker_depth: float = 0.0
    relative_thickness: tuple[tuple[float, ...], ...] | None = None

    def __post_init__(self) -> None:
        for each in fields(self):
            object.__setattr__(self, each.name, _read(each.name, getattr(self, each.name)))
        softest, stiffest = GEL.young_modulus
        inside = softest <= self.young_modulus <= stiffest
        _check("young_modulus", self.young_modulus, inside, f"{softest:g} to {stiffest:g} Pa")
        _check("poisson_ratio", self.poisson_ratio, 0.0 <= self.poisson_ratio <= 0.5, "0 to 0.5")
        thick = self.thickness >= GEL.thickness
        _check("thickness", self.thickness, thick, f"{GEL.thickness:g} m or more, inf for a half-space")
        inside = 0.0 <= self.marker_depth < min(self.thickness, GEL.marker_depth)
        _check("marker_depth", self.marker_depth, inside, f"0 m to less than the thickness, {self.thickness:g} m")
        if self.relative_thickness is not None:
            self._check_map(self.relative_thickness)

    def _check_map(self, rows: tuple[tuple[float, ...], ...]) -> None:
        least, most = GEL.relative_thickness
        _check("thickness", self.thickness, math.isfinite(self.thickness), "finite, beside relative_thickness")
        widths, name = {len(row) for row in rows}, "relative_thickness"
        is_lattice = len(rows) > 1 and len(widths) == 1 and widths.pop() > 1
        if not is_lattice:
            raise InvalidInput(name, f"{len(rows)} rows", "as many numbers in each, one a marker, 2 × 2 or more")
        for value in (each for row in rows for each in row):
            _check(name, value, least <= value <= most, f"{least:g} to {most:g}")
        inside = self.marker_depth < self.thinnest
        _check("marker_depth", self.marker_depth, inside, f"less than {self.thinnest:g} m, the least")

    @property
    def thinnest(self) -> float:
        """Its least thickness, m."""
        rows = self.relative_thickness
        return self.thickness if rows is None else self.thickness * min(map(min, rows))

    def check_beside(self, pitch: float) -> None:
        """Raises ``InvalidInput`` where the gel is too thin for markers ``pitch`` m apart, or the pitch not above 0."""
        apart = number("pitch", pitch)
        _check("pitch", apart, 0.0 < apart < math.inf, "above 0 m, finite")
        least = GEL.thinness * apart
        allowed = f"{least:.3g} m or more, {GEL.thinness:g} of the distance between markers (is it in m?)"
        _check("thickness", self.thinnest, self.thinnest >= least, allowed)

    @classmethod
    def from_json(cls, properties: Mapping[str, Any]) -> "Gel":
        """As the service gives the gel of a sensor: a ``thickness`` of None is a half-space's. Raises ``InvalidInput``
        for what is no number, another name or a missing modulus or ratio.
        """
        names = [each.name for each in fields(cls)]
        needed = [each.name for each in fields(cls) if each.default is MISSING]
        allowed = f"numbers named {', '.join(names)}"
        if not isinstance(properties, Mapping):
            raise InvalidInput("gel", repr(properties)[:120], allowed)
        wrong = [f"with the unknown {name!r}"[:120] for name in properties if name not in names]
        wrong += [f"without {name}" for name in needed if name not in properties]
        if wrong:
            raise InvalidInput("gel", wrong[0], allowed)
        return cls(**properties)

    def to_json(self) -> dict[str, float | None]:
        """As ``from_json`` reads it."""
        return asdict(self) | {"thickness": self.thickness if math.isfinite(self.thickness) else None}


def _read(name: str, given: Any) -> Any:
    if name == "thickness" and given is None:
        return math.inf
    if name != "relative_thickness":
        return number(name, given)
    try:
        return None if given is None else tuple(tuple(number(name, value) for value in row) for row in given)
    except TypeError as error:
        raise InvalidInput(name, shown(given), "rows of one number a marker") from error


def _check(name: str, value: float, allowed: bool, what: str) -> None:
    if not allowed:
        raise InvalidInput(name, value, what)
