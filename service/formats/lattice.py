"""What follows from the rest positions of a lattice of markers."""

import numpy as np

from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray


def element_area(name: str, position: FloatArray) -> float:
    """Mean area of the cells between four neighbouring markers [n, m, 3], on the curved surface at rest, m².

    Raises ``InvalidInput`` named ``name`` where there are no cells.
    """
    if position.ndim != 3 or position.shape[-1] != 3 or min(position.shape[:2]) < 2:
        raise InvalidInput(name, f"of shape {list(position.shape)}", "at least 2 markers a side")
    diagonal = position[1:, 1:] - position[:-1, :-1]
    other_diagonal = position[1:, :-1] - position[:-1, 1:]
    return float(0.5 * np.linalg.norm(np.cross(diagonal, other_diagonal), axis=-1).mean())


def flat_lattice(grid: tuple[int, int], pitch: float) -> FloatArray:
    """Positions [n, m, 3] m of a flat lattice, x along its first axis, with its middle at the origin."""
    x, y = (pitch * (np.arange(side) - 0.5 * (side - 1)) for side in grid)
    return np.stack(np.broadcast_arrays(x[:, None], y[None, :], 0.0), axis=-1)


def lattice_axes(position: FloatArray) -> FloatArray:
    """Directions [2, 2], x and y of each in a column, in which columns and rows of a lattice [n, m, 3] are counted."""
    along = [np.diff(position[..., :2], axis=axis).reshape(-1, 2).sum(axis=0) for axis in (1, 0)]
    return np.stack([step / (float(np.hypot(*step)) or 1.0) for step in along], axis=1)


def cell_size(position: FloatArray) -> FloatArray:
    """Mean distance [2] m between neighbouring columns and between neighbouring rows of a lattice [n, m, 3]."""
    steps = (np.diff(position, axis=axis) for axis in (1, 0))
    return np.array([float(np.linalg.norm(step, axis=-1).mean()) for step in steps])


def columns_and_rows(position: FloatArray, points: FloatArray) -> FloatArray:
    """Where points [k, 2] m lie on a lattice [n, m, 3]: columns and rows [k, 2] from its first element's centre."""
    return np.asarray((points - position[0, 0, :2]) @ lattice_axes(position) / cell_size(position))
