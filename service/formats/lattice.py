"""What the rest positions of a lattice of markers tell."""

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
