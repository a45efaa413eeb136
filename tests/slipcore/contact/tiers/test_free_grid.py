"""Grids of any pitch: what points and elements of a sensor see of them."""

import numpy as np
import pytest

from slipcore.contact.effects import SensorSampling, TangentialLoad
from slipcore.contact.plan.plan import SamplingPlan
from slipcore.contact.scene import Scene
from slipcore.contact.tiers.accuracy import difference
from slipcore.contact.tiers.boundary_elements import Fidelity, grid_of, run
from slipcore.contact.tiers.free_grid import FreeSensorGrid, free_grid
from slipcore.contact.tiers.probe import probe

SENSOR = SamplingPlan((7, 4), 1e-3, 10.0)


@pytest.mark.parametrize("cells", [9, 16, 31])
def test_a_grid_has_the_cells_asked_for_and_covers_sensor_and_contact(cells: int) -> None:
    where = free_grid(SENSOR, 3e-3, cells)
    assert where.grid.pitch == pytest.approx((6e-3 / cells, 6e-3 / cells))
    assert where.grid.shape[1] * where.grid.pitch[0] >= 7e-3 * (1 - 1e-12)
    assert where.grid.shape[0] * where.grid.pitch[1] >= 6e-3 * (1 - 1e-12)
    assert {side % 2 for side in where.grid.shape} == {cells % 2}


@pytest.mark.parametrize("cells", [9, 16, 31])
def test_cubics_are_met_at_points_and_masks_by_the_cell_around_each(cells: int) -> None:
    where = free_grid(SENSOR, 3e-3, cells)
    (x, y), position = (1e3 * axis for axis in where.grid.points()), 1e3 * where.position()
    found = where.at_points(np.stack((x**3 - 2.0 * x * y**2, y**3 + x)))
    px, py = position[..., 0], position[..., 1]
    exact = np.stack((px**3 - 2.0 * px * py**2, py**3 + px))
    np.testing.assert_allclose(found, exact, rtol=0.0, atol=1e-10)  # rounding of sums of about 100
    half = 500.0 * where.grid.pitch[0]
    east = where.holds_at_points(x > 1.0)
    assert east.shape == (7, 4)
    assert east[px > 1.0 + half].all()
    assert not east[px < 1.0 - half].any()


def test_elements_share_cells_by_area_and_lose_no_force() -> None:
    where = free_grid(SamplingPlan((8, 8), 1e-3, 10.0), 3e-3, 22)
    x, y = where.grid.points()
    force = np.where(np.hypot(x, y) < 3e-3, np.random.default_rng(0).random(where.grid.shape), 0.0)
    assert where.over_elements(force).sum() == pytest.approx(force.sum(), rel=1e-12)
    even = np.full(where.grid.shape, where.grid.cell_area)
    np.testing.assert_allclose(where.over_elements(even), 1e-6, rtol=1e-12)  # rounding


def test_a_run_on_a_free_grid_comes_near_a_fine_aligned_one() -> None:
    plan = Scene("shear", (TangentialLoad((3.2, 0.0)), SensorSampling((12, 12), 1e-3, 6.0))).plan()
    assert isinstance(grid_of(plan, Fidelity(30, aligned=False), probe(plan)), FreeSensorGrid)
    fine = run(plan, Fidelity(70))
    free = [difference(run(plan, Fidelity(cells, aligned=False)), fine) for cells in (16, 40)]
    for measure in ("stick_ratio", "displacement", "force"):
        assert getattr(free[1], measure) < 0.5 * getattr(free[0], measure)
    assert free[1].largest < 0.012
