"""Spheres of the paper's fingertip on grids, and what the solvers need to know of them."""

from dataclasses import dataclass

import numpy as np
import pytest

from slipcore.contact.elasticity.grid import Grid, bounding_box
from slipcore.contact.elasticity.influence import HalfSpace
from slipcore.contact.elasticity.operator import Operators
from slipcore.contact.reference.elastic_pair import half_space
from slipcore.contact.reference.hertz import HertzContact
from slipcore.contact.solver.normal import solve_normal
from slipcore.frames import FloatArray

YOUNG, RADIUS, FORCE, FRICTION = 1e6, 15e-3, 10.0, 0.4


@dataclass(frozen=True)
class Sphere:
    """A sphere pressed with FORCE on a grid a little wider than the contact, and its closed form."""

    hertz: HertzContact
    grid: Grid
    operators: Operators
    height: FloatArray

    @property
    def exact_pressure(self) -> FloatArray:
        return self.hertz.pressure(np.hypot(*self.grid.points()))

    def limit(self, friction: float = FRICTION) -> tuple[Grid, FloatArray]:
        """Box of the contact and μp on it, for the pressure of this grid."""
        pressure = solve_normal(self.operators, self.grid, self.height, force=FORCE).pressure
        box = bounding_box(pressure > 0.0)
        return self.grid.part(box), friction * pressure[box]


@pytest.fixture(scope="session")
def sphere():
    """Maker of spheres: (cells a side, Poisson's ratio, width of the grid in contact radii)."""

    def make(cells: int, poisson: float = 0.0, width: float = 2.1) -> Sphere:
        hertz = HertzContact(RADIUS, FORCE, half_space(YOUNG, poisson))
        grid = Grid.square(cells, width * hertz.contact_radius)
        x, y = grid.points()
        operators = Operators((HalfSpace.from_young(YOUNG, poisson),))
        return Sphere(hertz, grid, operators, (x**2 + y**2) / (2.0 * RADIUS))

    return make
