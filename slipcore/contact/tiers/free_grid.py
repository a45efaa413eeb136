"""A grid of any pitch below a sensor: what its points and elements see is interpolated, or shared by area."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.plan.plan import SamplingPlan
from slipcore.contact.solver.state import StepResult
from slipcore.contact.tiers import fronts
from slipcore.frames import BoolArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Along:
    """A sensor's points along one direction of a grid.

    ``weights`` [points, cells] of cubic interpolation at the points; ``shares`` [points, cells]: part of each cell
    that lies in the element around a point; ``nearest`` [points]: the cell in which, or next to which, a point lies.
    """

    weights: FloatArray
    shares: FloatArray
    nearest: NDArray[np.int64]

    @classmethod
    def of(cls, cells: FloatArray, points: FloatArray, pitch: float) -> "Along":
        """For cell centres and points m in ascending order, points ``pitch`` m apart."""
        size = cells[1] - cells[0]
        low, high = cells - 0.5 * size, cells + 0.5 * size
        overlap = np.minimum(high, points[:, None] + 0.5 * pitch) - np.maximum(low, points[:, None] - 0.5 * pitch)
        nearest = np.clip(np.rint((points - cells[0]) / size), 0, len(cells) - 1).astype(np.int64)
        return cls(_cubic(cells, points), np.clip(overlap / size, 0.0, 1.0), nearest)


def _cubic(cells: FloatArray, points: FloatArray) -> FloatArray:
    """Weights [points, cells] of the polynomial through the four cells around each point (Lagrange)."""
    size, width = cells[1] - cells[0], min(4, len(cells))
    first = np.clip(np.floor((points - cells[0]) / size) - 1, 0, len(cells) - width).astype(np.int64)
    weights = np.zeros((len(points), len(cells)))
    for k in range(width):
        here = np.ones(len(points))
        for other in range(width):
            if other != k:
                here *= (points - cells[first + other]) / ((k - other) * size)
        weights[np.arange(len(points)), first + k] = here
    return weights


@dataclass(frozen=True, slots=True, eq=False)
class FreeSensorGrid:
    """Sensor points ``pitch`` m apart anywhere on a grid."""

    grid: Grid
    points: tuple[int, int]
    pitch: float
    along_x: Along
    along_y: Along

    def at_points(self, field: FloatArray) -> FloatArray:
        """Values [..., n, m] of a smooth field [..., ny, nx] at the points, x along the first axis."""
        return np.asarray(np.swapaxes(self.along_y.weights @ field @ self.along_x.weights.T, -1, -2))

    def holds_at_points(self, mask: BoolArray) -> BoolArray:
        """Whether a mask [..., ny, nx] holds at the points [..., n, m]: that of the cell in which each lies."""
        return np.swapaxes(mask[..., self.along_y.nearest[:, None], self.along_x.nearest], -1, -2)

    def over_elements(self, field: FloatArray) -> FloatArray:
        """Sums [..., n, m] of a field [..., ny, nx] over the elements around the points, of cells by their share."""
        return np.asarray(np.swapaxes(self.along_y.shares @ field @ self.along_x.shares.T, -1, -2))

    def position(self) -> FloatArray:
        """Rest positions [n, m, 3] m."""
        x, y = np.meshgrid(*(_centred(count, self.pitch) for count in self.points), indexing="ij")
        return np.stack((x, y, np.zeros_like(x)), axis=-1)

    def stick_ratio(self, result: StepResult) -> float:
        """Stick area over contact area within their fronts."""
        return fronts.stick_ratio(result)


def free_grid(sampling: SamplingPlan, reach: float, cells_across: int) -> FreeSensorGrid:
    """Points, and a grid with that many cells across a contact that reaches ``reach`` m from the centre."""
    size, (nx, ny) = 2.0 * reach / cells_across, sides(sampling, reach, cells_across)
    grid = Grid((ny, nx), (size, size))
    x, y = (_centred(count, sampling.pitch) for count in sampling.points)
    along_x, along_y = Along.of(grid.x, x, sampling.pitch), Along.of(grid.y, y, sampling.pitch)
    return FreeSensorGrid(grid, sampling.points, sampling.pitch, along_x, along_y)


def sides(sampling: SamplingPlan, reach: float, cells_across: int) -> tuple[int, int]:
    """Cells of such a grid along x and y: they cover the contact and the sensor.

    They are even or odd in number as ``cells_across`` is, so that the centre lies alike in them.
    """
    size = 2.0 * reach / cells_across
    needed = (max(cells_across, int(np.ceil(count * sampling.pitch / size))) for count in sampling.points)
    nx, ny = (cells + (cells - cells_across) % 2 for cells in needed)
    return nx, ny


def _centred(count: int, pitch: float) -> FloatArray:
    return np.asarray((np.arange(count) - 0.5 * (count - 1)) * pitch, dtype=np.float64)
