"""Where traction is sought: a lattice of nodes under the markers and a margin around them."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import binary_dilation

from slipcore.contact.elasticity.grid import Grid
from slipcore.errors import InvalidInput
from slipcore.forces.defaults import NODES
from slipcore.frames import BoolArray, FloatArray


@dataclass(frozen=True, slots=True)
class Nodes:
    """Nodes [ny, nx] of a traction that is bilinear between them; numbered along x first, k = ny·nx."""

    grid: Grid

    @classmethod
    def around(cls, position: FloatArray, element_area: float) -> "Nodes":
        """Nodes one to an element of markers at ``position`` [j, 2] m, and ``NODES.margin`` rows more on every side.

        Raises ``InvalidInput`` where elements are far smaller than the markers lie apart.
        """
        pitch = float(np.sqrt(element_area))
        low, high = position.min(axis=0), position.max(axis=0)
        with np.errstate(over="ignore"):  # too many are too many
            along = np.rint((high - low) / pitch) + 1 + 2 * NODES.margin
        if not along.prod() <= NODES.most:
            raise InvalidInput(
                "element_area", f"{element_area:.3g} m²", f"an area that needs at most {NODES.most} nodes"
            )
        nx, ny = map(int, along)
        x, y = 0.5 * (low + high)
        return cls(Grid((ny, nx), (pitch, pitch), (float(x), float(y))))

    @property
    def between(self) -> "Nodes":
        """In the middle of each four: where a traction that is bilinear between nodes has none of its own."""
        ny, nx = self.grid.shape
        return Nodes(replace(self.grid, shape=(ny - 1, nx - 1)))

    def __len__(self) -> int:
        return self.grid.shape[0] * self.grid.shape[1]

    @property
    def area(self) -> float:
        """Integral of one node's hat function, m²."""
        return self.grid.cell_area

    def places(self) -> FloatArray:
        """Of the nodes, [k, 2] m."""
        return np.stack([axis.ravel() for axis in self.grid.points()], axis=-1)

    def beside(self, support: BoolArray) -> BoolArray:
        """Nodes [k] that are not of a ``support`` [k], but next to it along x or y."""
        whole = support.reshape(self.grid.shape)
        return np.asarray((binary_dilation(whole) & ~whole).ravel())

    def over_elements(self, position: FloatArray) -> FloatArray:
        """Force (N) on the square elements around ``position`` [j, 2] by 1 Pa at each node, [j, k].

        A hat function integrated over a square of its own width is a quadratic B-spline along each axis.
        """
        away = np.abs(position[:, None, :] - self.places()[None]) / self.grid.pitch[0]
        return self.area * np.asarray(_spline(away[..., 0]) * _spline(away[..., 1]))

    def smoothed(self) -> FloatArray:
        """Force (N) on the square element around each node by 1 Pa at each node, [k, k]."""
        return self.over_elements(self.places())


def _spline(away: FloatArray) -> FloatArray:
    return np.where(away < 0.5, 0.75 - away**2, 0.5 * np.maximum(1.5 - away, 0.0) ** 2)
