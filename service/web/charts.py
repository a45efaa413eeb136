"""Pictures of lines with bands, as the numbers that an SVG is drawn from."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from service.formatting import MINUS

WIDTH, HEIGHT = 480.0, 300.0
LEFT, RIGHT, TOP, BOTTOM = 62.0, 12.0, 12.0, 48.0
"""Of the picture and of the margins around its axes, in units of the SVG."""

MOST_TICKS = 6


@dataclass(frozen=True, slots=True)
class Tick:
    """A mark on an axis: where it stands, and what is written there."""

    place: float
    text: str


@dataclass(frozen=True, slots=True)
class Curve:
    """What is to be drawn: a line ``y`` [n] over ``x`` [n], between ``low`` and ``high`` [n]; ``seen`` is the range of
    ``x`` in which data lie, ``marked`` a value of ``x``.
    """

    x: Sequence[float]
    y: Sequence[float]
    low: Sequence[float]
    high: Sequence[float]
    seen: tuple[float, float]
    marked: float
    x_label: str
    y_label: str
    title: str


@dataclass(frozen=True, slots=True)
class Chart:
    """The numbers of an SVG: points as its polygons and lines take them."""

    title: str
    x_label: str
    y_label: str
    line: str
    band: str
    seen: tuple[float, float]
    marked: float
    x_ticks: Sequence[Tick]
    y_ticks: Sequence[Tick]

    width, height, left, right, top, bottom = WIDTH, HEIGHT, LEFT, WIDTH - RIGHT, TOP, HEIGHT - BOTTOM


@dataclass(frozen=True, slots=True)
class ManyChart:
    """The same of several curves, each with its line and band."""

    title: str
    x_label: str
    y_label: str
    lines: Sequence[str]
    bands: Sequence[str]
    marked: float
    x_ticks: Sequence[Tick]
    y_ticks: Sequence[Tick]

    width, height, left, right, top, bottom = WIDTH, HEIGHT, LEFT, WIDTH - RIGHT, TOP, HEIGHT - BOTTOM


def ticks(low: float, high: float, most: int = MOST_TICKS) -> list[float]:
    """Round numbers from ``low`` to ``high``, 1, 2 or 5 times a power of ten apart, at most so many."""
    raw = max((high - low) / max(most - 1, 1), 1e-300)
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= raw * (1.0 - 1e-9))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [count * step for count in range(first, last + 1)]


@dataclass(frozen=True, slots=True)
class Axis:
    """Values from ``low`` to ``high``, drawn from the place ``begin`` to ``end``; what lies outside is cut off."""

    low: float
    high: float
    begin: float
    end: float

    def place(self, value: float) -> float:
        """Where a value stands."""
        part = (value - self.low) / (self.high - self.low)
        return self.begin + (self.end - self.begin) * min(max(part, 0.0), 1.0)

    def ticks(self, most: int = MOST_TICKS) -> list[Tick]:
        """Marks at round values."""
        found = rounded(ticks(self.low, self.high, most))
        return [Tick(self.place(value), f"{value:g}".replace("-", MINUS)) for value in found]


class _Axes:
    """From 0 up to what has to be seen on both axes; what lies below 0, no friction does, is cut off."""

    def __init__(self, curves: Sequence[Curve]) -> None:
        x_most = max(1e-12, *(x for curve in curves for x in curve.x))
        y_most = 1.05 * max(1e-12, *(y for curve in curves for y in (*curve.high, *curve.y)))
        self.x, self.y = Axis(0.0, x_most, LEFT, WIDTH - RIGHT), Axis(0.0, y_most, HEIGHT - BOTTOM, TOP)

    def across(self, x: float) -> float:
        return self.x.place(x)

    def line(self, curve: Curve) -> str:
        return points(self.x, self.y, curve.x, curve.y)

    def band(self, curve: Curve) -> str:
        there, back = (curve.x, curve.high), (curve.x[::-1], curve.low[::-1])
        return f"{points(self.x, self.y, *there)} {points(self.x, self.y, *back)}"

    def x_ticks(self) -> list[Tick]:
        return self.x.ticks()

    def y_ticks(self) -> list[Tick]:
        return self.y.ticks()


def points(x: Axis, y: Axis, xs: Sequence[float], ys: Sequence[float]) -> str:
    """Points as lines and polygons of an SVG take them."""
    return " ".join(f"{x.place(a):.1f},{y.place(b):.1f}" for a, b in zip(xs, ys, strict=True))


def draw(curve: Curve) -> Chart:
    """A chart of one curve."""
    axes = _Axes([curve])
    return Chart(
        title=curve.title,
        x_label=curve.x_label,
        y_label=curve.y_label,
        line=axes.line(curve),
        band=axes.band(curve),
        seen=(axes.across(curve.seen[0]), axes.across(curve.seen[1])),
        marked=axes.across(curve.marked),
        x_ticks=axes.x_ticks(),
        y_ticks=axes.y_ticks(),
    )


def draw_together(curves: Sequence[Curve]) -> ManyChart:
    """A chart of one or more curves over the same axes, marked at the same value; the first one's labels count."""
    axes, first = _Axes(curves), curves[0]
    return ManyChart(
        title=first.title,
        x_label=first.x_label,
        y_label=first.y_label,
        lines=[axes.line(curve) for curve in curves],
        bands=[axes.band(curve) for curve in curves],
        marked=axes.across(first.marked),
        x_ticks=axes.x_ticks(),
        y_ticks=axes.y_ticks(),
    )


def rounded(values: Sequence[float]) -> list[float]:
    """Without what binary fractions leave behind."""
    return [float(f"{value:.10g}") for value in values]
