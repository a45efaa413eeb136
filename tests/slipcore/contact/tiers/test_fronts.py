"""Areas within fronts, against closed forms."""

import numpy as np
import pytest

from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import HalfSpace
from slipcore.contact.solver.problem import ContactProblem, StepLoad
from slipcore.contact.solver.quasi_static import QuasiStatic
from slipcore.contact.solver.state import StepResult
from slipcore.contact.tiers.fronts import shares_within, stick_ratio

FORCE, FRICTION, RADIUS = 10.0, 0.4, 15e-3
REACH = (0.75 * FORCE * RADIUS / 1e6) ** (1.0 / 3.0)  # Hertz, ν = 0


def sheared(share: float, cells: int) -> StepResult:
    heights = (lambda x, y: (x**2 + y**2) / (2.0 * RADIUS),)
    problem = ContactProblem((HalfSpace.from_young(1e6, 0.0),), FRICTION, heights=heights)
    loads = [StepLoad(FORCE, tangential=np.array([part * FRICTION * FORCE, 0.0, 0.0])) for part in (0.0, share)]
    return list(QuasiStatic(problem, Grid.square(cells, 2.2 * REACH), 1e-4, 1e-6).run(loads))[-1]


@pytest.mark.parametrize("cells", range(20, 40, 3))
def test_the_area_of_a_disc_is_met_to_a_fraction_of_what_counting_misses(cells: int) -> None:
    x, y = Grid.square(cells, 2.3).points()
    field = 1.0 - x**2 - y**2  # the square of Hertz's pressure
    area = shares_within(field, field > 0.0).sum() * (2.3 / cells) ** 2
    assert area == pytest.approx(np.pi, rel=1.2e-2)


def test_fields_that_end_without_falling_count_whole_cells() -> None:
    inside = np.zeros((8, 9), dtype=bool)
    inside[2:6, 3:8] = True
    np.testing.assert_array_equal(shares_within(np.where(inside, 3.0, 0.0), inside), inside)
    lone = np.zeros((5, 5), dtype=bool)
    lone[2, 2] = True
    np.testing.assert_array_equal(shares_within(lone * 1.0, lone), lone)


def test_the_stick_ratio_nears_cattaneos_where_counting_cells_scatters() -> None:
    within, counted = [], []
    for share in (0.5, 0.7, 0.9):
        exact = (1.0 - share) ** (2.0 / 3.0)
        for cells in range(20, 42, 4):
            result = sheared(share, cells)
            within.append(stick_ratio(result) - exact)
            counted.append(result.stick_ratio - exact)
    assert np.sqrt(np.mean(np.square(within))) < 0.6 * np.sqrt(np.mean(np.square(counted)))
    assert np.abs(within).max() < 0.015


def test_all_sticks_without_shear_and_nothing_in_sliding() -> None:
    assert stick_ratio(sheared(0.0, 20)) == 1.0
    assert stick_ratio(sheared(1.0, 20)) == 0.0
