"""The solver's grid of equal rectangular cells."""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from slipcore.errors import InvalidInput
from slipcore.frames import BoolArray, FloatArray

Number = TypeVar("Number", bound=np.generic)
Box = tuple[slice, slice]
"""Rows and columns of a part of a grid."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Cells [ny, nx] of ``pitch`` (hx, hy) m, centred on ``centre`` (x, y) m."""

    shape: tuple[int, int]
    pitch: tuple[float, float]
    centre: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        if min(self.shape) < 1:
            raise InvalidInput("grid shape", self.shape, "at least one cell a direction")
        if not (np.isfinite(self.pitch).all() and min(self.pitch) > 0.0):
            raise InvalidInput("grid pitch", self.pitch, "finite and above 0 m")

    @classmethod
    def square(cls, cells: int, width: float) -> "Grid":
        """A grid of ``cells`` by ``cells`` over ``width`` by ``width`` m."""
        return cls((cells, cells), (width / cells, width / cells))

    @property
    def cell_area(self) -> float:
        """Area of one cell, m²."""
        return self.pitch[0] * self.pitch[1]

    @property
    def x(self) -> FloatArray:
        """Cell centres along x, [nx] m."""
        return _centres(self.shape[1], self.pitch[0], self.centre[0])

    @property
    def y(self) -> FloatArray:
        """Cell centres along y, [ny] m."""
        return _centres(self.shape[0], self.pitch[1], self.centre[1])

    def points(self) -> tuple[FloatArray, FloatArray]:
        """Cell centres x and y, each [ny, nx] m."""
        points = np.empty((2, *self.shape))
        points[0], points[1] = self.x, self.y[:, None]
        return points[0], points[1]

    def part(self, box: Box) -> "Grid":
        """The grid of the cells inside a box."""
        x, y = self.x[box[1]], self.y[box[0]]
        return Grid((len(y), len(x)), self.pitch, (float(x[0] + x[-1]) / 2, float(y[0] + y[-1]) / 2))


def _centres(count: int, pitch: float, centre: float) -> FloatArray:
    return centre + pitch * (np.arange(count, dtype=np.float64) - (count - 1) / 2)


def on_whole(grid: Grid, box: Box, part: NDArray[Number]) -> NDArray[Number]:
    """A field [..., rows, columns] of the cells in a box, on the whole grid: zero elsewhere."""
    if part.shape[-2:] == grid.shape:
        return part
    whole = np.zeros((*part.shape[:-2], *grid.shape), dtype=part.dtype)
    whole[..., *box] = part
    return whole


def bounding_box(mask: BoolArray, multiple: int = 1) -> Box:
    """The smallest box around the true cells of [ny, nx], its sides rounded up to a multiple where there is room."""
    return _span(np.any(mask, axis=1), multiple), _span(np.any(mask, axis=0), multiple)


def _span(occupied: BoolArray, multiple: int) -> slice:
    first, last = int(occupied.argmax()), len(occupied) - int(occupied[::-1].argmax())
    size = min(-(-(last - first) // multiple) * multiple, len(occupied))
    first = min(first, len(occupied) - size)
    return slice(first, first + size)
