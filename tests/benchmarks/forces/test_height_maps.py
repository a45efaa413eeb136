"""How maps of height are made, read and scored."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from benchmarks.forces.height_maps import CELL, LOADS, PIXELS, height_table, heights, on_elements, outcome, read
from benchmarks.forces.scenes import press
from slipcore.forces import Gel

GEL = Gel(1e6, 0.49, 5e-3)


def test_each_place_shows_the_height_of_the_point_that_came_there() -> None:
    truth = press("sphere", GEL, PIXELS, steps=((1.0, 1.0),) * 2)
    rest, shown, _ = heights(truth, 0.0, np.random.default_rng(1))
    moved = truth.log.displacement[0].transpose(2, 1, 0)
    assert not rest.any()
    assert np.abs(moved[:2]).max() > CELL
    rows, columns = np.indices(shown.shape)[:, 20:-20, 20:-20]
    came_to = rows + moved[1, 20:-20, 20:-20] / CELL, columns + moved[0, 20:-20, 20:-20] / CELL
    seen = map_coordinates(shown, came_to, order=1)
    assert np.abs(seen - moved[2, 20:-20, 20:-20]).max() < 0.01 * np.abs(moved[2]).max()


@pytest.mark.parametrize("side", [20, 33])
def test_elements_bear_what_their_cells_do(side: int) -> None:
    truth = press("ring", GEL, PIXELS, steps=((1.0, 0.5),) * 2)
    force = on_elements(truth, side)
    assert force[0].sum() == pytest.approx(truth.total[0, 2], rel=1e-9)
    assert truth.log.force is not None
    log = read(heights(truth, 0.0, np.random.default_rng(1)), side)
    for axis in (0, 1):
        of_cells = np.average(truth.log.position[..., axis], weights=truth.log.force[0, ..., 2])
        of_elements = np.average(log.position[..., axis], weights=force[0])
        assert of_elements == pytest.approx(of_cells - 0.5 * CELL, abs=0.1 * CELL)  # from the middle of the map


def test_a_press_on_a_half_space_is_found_and_a_row_tells_how_well() -> None:
    found = outcome("half-space", "sphere", 10, 0.0)
    assert found.force["straight"] < 0.02
    assert set(found.held) == set(LOADS)
    assert [count for _, count in found.held.values()] == [5, 10]
    row = [cell.strip() for cell in height_table([found]).splitlines()[-1].strip("|").split("|")]
    assert row[:4] == ["half-space", "sphere", "10 × 10", "0"]
