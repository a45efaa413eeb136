"""Shapes of the object's surface, each added to that of the finger; several add up (a wavy cylinder)."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from scipy import interpolate

from slipcore.contact.plan.entries import check_own_types
from slipcore.contact.plan.plan import Plan
from slipcore.contact.solver.problem import HeightField
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray

WHY = "where the bodies touch, and how the pressure is spread, follows from the gap between them"
COST = "nothing: the gap is one field, made before the first step"


def with_height(plan: Plan, height: HeightField) -> Plan:
    """The plan with one more part of the gap."""
    return replace(plan, problem=replace(plan.problem, heights=(*plan.problem.heights, height)))


@dataclass(frozen=True, slots=True)
class SphereSurface:
    """``curvature`` 1/m of the object at the contact, above 0 where it bulges towards the finger."""

    curvature: float
    why: ClassVar[str] = WHY
    cost: ClassVar[str] = COST

    @property
    def absent(self) -> bool:
        """Whether the object is flat."""
        return self.curvature == 0.0

    def extend(self, plan: Plan) -> Plan:
        """Add a paraboloid."""
        half = 0.5 * self.curvature

        def height(x: FloatArray, y: FloatArray) -> FloatArray:
            return half * (x**2 + y**2)

        return with_height(plan, height)


@dataclass(frozen=True, slots=True)
class CylinderSurface:
    """``curvature`` 1/m across an axis at ``angle`` rad from x."""

    curvature: float
    angle: float = 0.0
    why: ClassVar[str] = WHY
    cost: ClassVar[str] = COST

    @property
    def absent(self) -> bool:
        """Whether the object is flat."""
        return self.curvature == 0.0

    def extend(self, plan: Plan) -> Plan:
        """Add a parabolic cylinder."""
        half, sine, cosine = 0.5 * self.curvature, np.sin(self.angle), np.cos(self.angle)

        def height(x: FloatArray, y: FloatArray) -> FloatArray:
            return half * (cosine * y - sine * x) ** 2  # type: ignore[no-any-return]

        return with_height(plan, height)


@dataclass(frozen=True, slots=True)
class FlatSurface:
    """A face of ``width`` (x, y) m about ``centre`` (x, y) m, nothing beyond its edges."""

    width: tuple[float, float]
    centre: tuple[float, float] = (0.0, 0.0)
    why: ClassVar[str] = WHY
    cost: ClassVar[str] = COST

    def __post_init__(self) -> None:
        check_own_types(self)
        if not min(self.width) > 0.0:
            raise InvalidInput("width of the face", self.width, "above 0 m")

    @property
    def absent(self) -> bool:
        """Whether the face has no edges."""
        return min(self.width) == float("inf")

    def extend(self, plan: Plan) -> Plan:
        """Add an infinite gap beyond the edges."""
        (half_x, half_y), (x0, y0) = (0.5 * self.width[0], 0.5 * self.width[1]), self.centre

        def height(x: FloatArray, y: FloatArray) -> FloatArray:
            return np.where((np.abs(x - x0) <= half_x) & (np.abs(y - y0) <= half_y), 0.0, np.inf)

        return with_height(plan, height)


@dataclass(frozen=True, slots=True)
class RingSurface:
    """A ring of ``radius`` m whose section has ``tube_radius`` m: the rim of a cup."""

    radius: float
    tube_radius: float
    why: ClassVar[str] = WHY
    cost: ClassVar[str] = COST

    def __post_init__(self) -> None:
        check_own_types(self)
        if not (self.radius > 0.0 and self.tube_radius > 0.0):
            raise InvalidInput("ring", self, "radii above 0 m")

    @property
    def absent(self) -> bool:
        """Whether the section is flat."""
        return self.tube_radius == float("inf")

    def extend(self, plan: Plan) -> Plan:
        """Add a parabolic ring."""
        radius, half = self.radius, 0.5 / self.tube_radius

        def height(x: FloatArray, y: FloatArray) -> FloatArray:
            return half * (np.hypot(x, y) - radius) ** 2

        return with_height(plan, height)


@dataclass(frozen=True, slots=True)
class WavySurface:
    """Waves of ``amplitude`` m, ``wavelength`` m and ``angle`` rad from x; a crest at the centre."""

    amplitude: float
    wavelength: float
    angle: float = 0.0
    why: ClassVar[str] = WHY
    cost: ClassVar[str] = COST

    def __post_init__(self) -> None:
        check_own_types(self)
        if not self.wavelength > 0.0:
            raise InvalidInput("wavelength", self.wavelength, "above 0 m")

    @property
    def absent(self) -> bool:
        """Whether there are no waves."""
        return self.amplitude == 0.0

    def extend(self, plan: Plan) -> Plan:
        """Add the waves, zero at their crests."""
        number, sine, cosine = 2.0 * np.pi / self.wavelength, np.sin(self.angle), np.cos(self.angle)
        amplitude = self.amplitude

        def height(x: FloatArray, y: FloatArray) -> FloatArray:
            return amplitude * (1.0 - np.cos(number * (cosine * x + sine * y)))  # type: ignore[no-any-return]

        return with_height(plan, height)


@dataclass(frozen=True, slots=True)
class MeasuredSurface:
    """Heights m of the object's surface, rows along y, at ``pitch`` m about the centre; a gap, larger where it is
    further.

    Interpolated bilinearly; beyond the map there is no surface.
    """

    heights: tuple[tuple[float, ...], ...]
    pitch: float
    why: ClassVar[str] = WHY
    cost: ClassVar[str] = COST

    def __post_init__(self) -> None:
        check_own_types(self)
        if min(len(self.heights), len(self.heights[0])) < 2:
            raise InvalidInput("measured heights", "too small", "a rectangle of at least 2 × 2")
        if not np.isfinite(self.heights).all():
            raise InvalidInput("measured heights", "not finite", "finite heights, m")
        if not self.pitch > 0.0:
            raise InvalidInput("pitch of the map", self.pitch, "above 0 m")

    @property
    def absent(self) -> bool:
        """Never: even a flat map has edges."""
        return False

    def extend(self, plan: Plan) -> Plan:
        """Add the map."""
        heights = np.asarray(self.heights)
        y, x = ((np.arange(n) - 0.5 * (n - 1)) * self.pitch for n in heights.shape)
        table = interpolate.RegularGridInterpolator((y, x), heights, bounds_error=False, fill_value=np.inf)

        def height(x: FloatArray, y: FloatArray) -> FloatArray:
            return np.asarray(table(np.stack((y, x), axis=-1)))

        return with_height(plan, height)
