"""How the cells along an edge differ from its root: `python -m benchmarks.contact.edge_cells [--output FILE]`.

Solves Hertz's sphere on fine grids that lie anywhere, and takes of every cell near the edge how far from it the cell
seems to be, by the square of pressure over the slope of that, less how far it is. Writes that as the table which
``slipcore/contact/tiers/edges.py`` reads, by root of the distance (rows) and angle to the grid (columns); prints what
scatters around it. Takes a minute.
"""

import argparse
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.linalg import lsqr

from slipcore.contact import reference
from slipcore.contact.defaults import EDGES
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import HalfSpace
from slipcore.contact.elasticity.operator import Operators
from slipcore.contact.solver.normal import solve_normal
from slipcore.frames import FloatArray

FINE = (260, 300, 340, 380, 420)
"""Cells across grids; those that accuracy is reported on are coarser."""
GRIDS = 6
"""Of each, their cells elsewhere on the edge."""
ROWS, COLUMNS = 29, 9
FARTHEST = 8.0
"""Cells from the edge; beyond the table the difference falls with the distance."""
HERTZ = reference.HertzContact(15e-3, 10.0, reference.half_space(1e6, 0.0))


def cells_along_edge(grid: Grid) -> FloatArray:
    """How far from the edge cells seem to be and are, in cells, and its angle to the grid, up to 45°: [3, k]."""
    x, y = grid.points()
    operators = Operators((HalfSpace.from_young(1e6, 0.0),))
    pressure = solve_normal(operators, grid, (x**2 + y**2) / 30e-3, force=10.0, tolerance=1e-7).pressure
    share, reach = (x**2 + y**2) / HERTZ.contact_radius**2, HERTZ.contact_radius / grid.pitch[0]
    slope = 2.0 * np.sqrt(share) / reach
    seems, lies = (pressure / HERTZ.peak_pressure) ** 2 / slope, (1.0 - share) / slope
    low, high = np.sort(np.abs((x, y)), axis=0)
    near = (pressure > 0.0) & (seems < FARTHEST)
    return np.stack((seems, lies, np.arctan2(low, high)))[:, near]


def table_of(cells: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Table [rows, columns] whose interpolation is nearest to the difference (least squares), and what is left [k]."""
    seems, lies, angle = cells
    beyond = np.minimum(EDGES.table_reach**2 / seems, 1.0)
    along = np.sqrt(seems * beyond) / EDGES.table_reach * (ROWS - 1), angle / (np.pi / 4.0) * (COLUMNS - 1)
    first = [np.minimum(at.astype(int), count - 2) for at, count in zip(along, (ROWS, COLUMNS), strict=True)]
    shares = [at - low for at, low in zip(along, first, strict=True)]
    places, weights = [], []
    for i in (0, 1):
        for j in (0, 1):
            places.append((first[0] + i) * COLUMNS + first[1] + j)
            weights.append(beyond * (shares[0] if i else 1.0 - shares[0]) * (shares[1] if j else 1.0 - shares[1]))
    entries = (np.concatenate(weights), (np.tile(np.arange(len(seems)), 4), np.concatenate(places)))
    interpolation = coo_array(entries, shape=(len(seems), ROWS * COLUMNS)).tocsr()
    found = lsqr(interpolation, seems - lies)[0]
    return found.reshape(ROWS, COLUMNS), seems - lies - interpolation @ found


def main() -> None:
    """Solve, fit, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("benchmark-output/edge_cells.csv"))
    options = parser.parse_args()
    generator, solved = np.random.default_rng(19), []
    for count in FINE:
        for _ in range(GRIDS):
            pitch = generator.uniform(2.1, 2.2) * HERTZ.contact_radius / count
            centre = tuple(float(part) for part in generator.uniform(-0.5, 0.5, 2) * pitch)
            solved.append(cells_along_edge(Grid((count, count), (pitch, pitch), (centre[0], centre[1]))))
    cells = np.concatenate(solved, axis=1)
    table, left = table_of(cells)
    options.output.parent.mkdir(parents=True, exist_ok=True)
    np.savetxt(options.output, table, delimiter=",", fmt="%.4f")
    print(f"{cells.shape[1]} cells: differences {np.std(cells[0] - cells[1]):.4f}, beside the table {left.std():.4f}")


if __name__ == "__main__":
    main()
