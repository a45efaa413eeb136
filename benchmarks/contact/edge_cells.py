"""What even cells leave along an edge of stress: `python -m benchmarks.contact.edge_cells [--output FILE]`.

Solves, on fine grids that lie anywhere, stress on a circle that ends as a root does, of bodies of several Poisson's
ratios, where slip is at one angle to the radius everywhere. It has a closed form, pressure among it, as that of ν = 0.
Takes of every cell near the edge how far from it the cell seems to be, by the square of stress over the slope of that,
less how far it is; and what stress there is across the direction of slip besides what should be. Writes these as the
tables which ``slipcore/contact/tiers/edges.py`` reads, by root of the distance (rows) and angle to the grid (columns);
prints what scatters around them. Takes three minutes.
"""

import argparse
from dataclasses import astuple, dataclass
from itertools import product
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array, hstack
from scipy.sparse.linalg import lsqr

from slipcore.contact.defaults import EDGES
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import HalfSpace
from slipcore.contact.elasticity.operator import ElasticOperator
from slipcore.contact.tiers.edges import weights_of
from slipcore.frames import BoolArray, FloatArray

FINE = (260, 300, 340, 380, 420)
"""Cells across grids; those that accuracy is reported on are coarser."""
ANISOTROPIES = (0.0, 0.11, 0.22, 1.0 / 3.0)
"""Of bodies, ν/(2 − ν): up to ν = 0.5."""
SLIPS = np.radians((0.0, 22.5, 45.0, 67.5, 90.0))
"""Angles of slip to the radius; the edge's other quarters see them from the other side."""
ROWS, COLUMNS = 29, 9
FARTHEST, BEYOND = 8.0, 4.0
"""Cells from the edge, within and beyond; past the tables what is left falls with the distance."""
TOLERANCE, ROUNDS = 1e-7, 30


@dataclass(frozen=True, slots=True)
class Spiral:
    """Stress on a circle of radius 1, r √(1 − r²) along slip at the angle ``slip`` to the radius, on a shear modulus of
    1, where no point moves across slip.

    Along circles the body responds to fields of axial symmetry as 1/|k|, along radii as (1 − ν)/|k| (Hankel transforms
    of order 1; Johnson 1985, eq. 3.75), so that stress is (s_r/(1 − ν), s_t)/D times the above, and moves the circle by
    (π/8) r (1 − ¾ r²)/D along s, D = s_r²/(1 − ν) + s_t². So it is near an edge of stick: cells that slide move along
    slip, and stress across it, of the size of K√cell, is small beside friction.
    """

    grid: Grid
    slip: float
    anisotropy: float

    @property
    def poisson(self) -> float:
        """Poisson's ratio."""
        return 2.0 * self.anisotropy / (1.0 + self.anisotropy)

    @property
    def radius(self) -> FloatArray:
        """Distance from the middle [ny, nx]."""
        return np.hypot(*self.grid.points())

    @property
    def along(self) -> FloatArray:
        """Direction of slip [2, ny, nx]."""
        x, y = self.grid.points()
        angle = np.arctan2(y, x) + self.slip
        return np.stack((np.cos(angle), np.sin(angle)))

    @property
    def divisor(self) -> float:
        """The above D."""
        return float(np.cos(self.slip) ** 2 / (1.0 - self.poisson) + np.sin(self.slip) ** 2)

    def stress(self) -> tuple[FloatArray, FloatArray]:
        """Along slip and across it, a quarter turn on, [ny, nx]."""
        along = self.radius * np.sqrt(np.maximum(1.0 - self.radius**2, 0.0))
        turned = self.poisson / (1.0 - self.poisson) * np.cos(self.slip) * np.sin(self.slip) / self.divisor
        return along, -turned * along

    def solved(self) -> tuple[FloatArray, FloatArray]:
        """Stress of even cells, as above: along slip ≥ 0, and moved by no less than the circle where it is 0."""
        operator = ElasticOperator((HalfSpace(1.0, self.poisson),), self.grid)
        along, radius = self.along, self.radius
        across, near = np.stack((-along[1], along[0])), radius < 1.0 + (FARTHEST + 4.0) * self.grid.pitch[0]
        right = np.pi / 8.0 * radius * (1.0 - 0.75 * radius**2) / self.divisor * along
        found, free = np.zeros_like(along), radius < 1.0
        for _ in range(ROUNDS):
            found = conjugate_gradients(operator, right, found, (along * free, across * near))
            stress = (found * along).sum(axis=0)
            slip = ((operator.tangential(found) - right) * along).sum(axis=0)
            changed = np.where(free, stress < 0.0, near & (slip < -TOLERANCE * np.abs(right).max()))
            if not changed.any():
                return np.where(free, stress, 0.0), (found * across).sum(axis=0)
            free = free ^ changed
        raise RuntimeError(f"{self}: cells still change after {ROUNDS} rounds")


def conjugate_gradients(
    operator: ElasticOperator, right: FloatArray, start: FloatArray, parts: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """Stress [2, ny, nx] along the fields of directions ``parts`` that moves cells as ``right`` does, along these."""

    def projected(field: FloatArray) -> FloatArray:
        return sum(((field * part).sum(axis=0) * part for part in parts), start=np.zeros_like(field))

    found = projected(start)
    left, goal = projected(right - operator.tangential(found)), TOLERANCE * float(np.linalg.norm(projected(right)))
    ahead, size = np.zeros_like(found), np.inf
    while np.linalg.norm(left) > goal:
        turned = projected(operator.tangential_inverse(left))
        before, size = size, float((left * turned).sum())
        ahead = turned + size / before * ahead
        moved = projected(operator.tangential(ahead))
        step = size / float((ahead * moved).sum())
        found, left = found + step * ahead, left - step * moved
    return found


@dataclass(frozen=True, slots=True)
class EdgeCells:
    """Cells [k] near an edge: how far from it each ``seems`` to be and ``lies``, in cells, below zero beyond it; its
    ``angle`` to the grid, up to 45°; ``weights`` [6, k] of the tables there; stress ``across`` slip that should not be,
    over the root of the slope of the square along slip; those ``within``, by their stress along slip.
    """

    seems: FloatArray
    lies: FloatArray
    angle: FloatArray
    weights: FloatArray
    across: FloatArray
    within: BoolArray


def cells_along_edge(spiral: Spiral) -> EdgeCells:
    """Those of one grid."""
    (along, across), (right, besides) = spiral.solved(), spiral.stress()
    radius, pitch = spiral.radius, spiral.grid.pitch[0]
    slope = np.where(radius < 1.0, np.maximum(4.0 * radius**3 - 2.0 * radius, 0.5), 2.0) * pitch  # 0.756 at 0.85
    lies = np.where(radius < 1.0, right**2 / slope, (1.0 - radius) / pitch)
    near = (lies < FARTHEST) & (lies > -BEYOND) & (radius > 0.85)
    directions = np.stack(spiral.grid.points())[:, near], spiral.along[:, near]
    weights, turned = weights_of(*directions, spiral.anisotropy)
    low, high = np.sort(np.abs(directions[0]), axis=0)
    seems, left = (along**2 / slope)[near], turned * ((across - besides) / np.sqrt(slope))[near]
    return EdgeCells(seems, lies[near], np.arctan2(low, high), weights, left, along[near] > 0.0)


def table_of(
    distance: FloatArray, angle: FloatArray, weights: FloatArray, values: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Tables [tables, rows, columns] by distance and angle [k] whose interpolation, by ``weights`` [tables, k], is
    nearest to values (least squares), and what is left of these [k].
    """
    beyond = np.minimum(EDGES.table_reach**2 / np.maximum(distance, EDGES.table_reach**2), 1.0)
    along = np.sqrt(distance * beyond) / EDGES.table_reach * (ROWS - 1), angle / (np.pi / 4.0) * (COLUMNS - 1)
    first = [np.minimum(at.astype(int), count - 2) for at, count in zip(along, (ROWS, COLUMNS), strict=True)]
    shares = [at - low for at, low in zip(along, first, strict=True)]
    places, parts = [], []
    for i in (0, 1):
        for j in (0, 1):
            places.append((first[0] + i) * COLUMNS + first[1] + j)
            parts.append(beyond * (shares[0] if i else 1.0 - shares[0]) * (shares[1] if j else 1.0 - shares[1]))
    entries = (np.concatenate(parts), (np.tile(np.arange(len(values)), 4), np.concatenate(places)))
    one = coo_array(entries, shape=(len(values), ROWS * COLUMNS)).tocsr()
    interpolation = hstack([one.multiply(weight[:, None]) for weight in weights]).tocsr()
    found = lsqr(interpolation, values, iter_lim=300)[0]
    return found.reshape(len(weights), ROWS, COLUMNS), values - interpolation @ found


def main() -> None:
    """Solve, fit, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("benchmark-output/edge_cells.csv"))
    options = parser.parse_args()
    generator, solved = np.random.default_rng(19), []
    for count, slip, anisotropy in product(FINE, SLIPS, ANISOTROPIES):
        pitch = generator.uniform(2.24, 2.34) / count
        x, y = (float(part) for part in generator.uniform(-0.5, 0.5, 2) * pitch)
        solved.append(cells_along_edge(Spiral(Grid((count, count), (pitch, pitch), (x, y)), slip, anisotropy)))
    cells = EdgeCells(*(np.concatenate(parts, axis=-1) for parts in zip(*map(astuple, solved), strict=True)))
    tables = []
    for name, chosen, distance, weights, values in (
        ("excess", cells.within, cells.seems, cells.weights, cells.seems - cells.lies),
        ("across, within", cells.within, cells.seems, cells.weights[1:], cells.across),
        ("across, beyond", ~cells.within, np.maximum(-cells.lies, 0.0), cells.weights[1:], cells.across),
    ):
        table, left = table_of(distance[chosen], cells.angle[chosen], weights[:, chosen], values[chosen])
        tables.append(table)
        print(f"{name}: {len(left)} cells, {np.std(values[chosen]):.4f}, beside the tables {left.std():.4f}")
    options.output.parent.mkdir(parents=True, exist_ok=True)
    np.savetxt(options.output, np.concatenate(tables).reshape(-1, COLUMNS), delimiter=",", fmt="%.4f")


if __name__ == "__main__":
    main()
