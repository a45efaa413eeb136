"""Areas and places of lattices."""

import numpy as np
import pytest

from service.formats.lattice import cell_size, columns_and_rows, element_area, flat_lattice, lattice_axes
from slipcore import InvalidInput


@pytest.mark.parametrize("grid", [(2, 2), (2, 5), (7, 3)])
def test_a_flat_element_has_the_area_of_its_cell(grid: tuple[int, int]) -> None:
    assert element_area("position", flat_lattice(grid, 2e-3)) == pytest.approx(4e-6)


def test_a_surface_that_is_inclined_is_larger() -> None:
    lattice = flat_lattice((4, 6), 1e-3)
    lattice[..., 2] = lattice[..., 0]
    assert element_area("position", lattice) == pytest.approx(np.sqrt(2.0) * 1e-6)


@pytest.mark.parametrize("shape", [(1, 5, 3), (5, 1, 3), (5, 5, 2), (25, 3)])
def test_without_cells_there_is_no_area(shape: tuple[int, ...]) -> None:
    with pytest.raises(InvalidInput, match="places is of shape"):
        element_area("places", np.zeros(shape))


def test_a_lattice_stands_about_the_origin_with_x_along_its_first_axis() -> None:
    lattice = flat_lattice((3, 2), 4.0)
    assert lattice[:, 0, 0].tolist() == [-4.0, 0.0, 4.0]
    assert lattice[0, :, 1].tolist() == [-2.0, 2.0]
    assert not lattice[..., 2].any()


def turned(by: float, grid: tuple[int, int] = (3, 4), pitches: tuple[float, float] = (2.0, 3.0)) -> np.ndarray:
    """Columns 3 m and rows 2 m apart, columns along an angle, from (5, 7)."""
    row, column = np.meshgrid(*(np.arange(side) for side in grid), indexing="ij")
    along = np.array([np.cos(by), np.sin(by), 0.0])
    across = np.array([-np.sin(by), np.cos(by), 0.0])
    return np.array([5.0, 7.0, 1.0]) + pitches[1] * column[..., None] * along + pitches[0] * row[..., None] * across


@pytest.mark.parametrize("by", [0.0, 0.4, 2.0])
def test_points_are_told_in_columns_and_rows_of_a_lattice_that_is_turned(by: float) -> None:
    lattice = turned(by)
    np.testing.assert_allclose(lattice_axes(lattice), [[np.cos(by), -np.sin(by)], [np.sin(by), np.cos(by)]], atol=1e-12)
    np.testing.assert_allclose(cell_size(lattice), [3.0, 2.0])
    points = np.array([lattice[0, 0, :2], lattice[2, 1, :2], lattice[0, 3, :2]])
    np.testing.assert_allclose(columns_and_rows(lattice, points), [[0.0, 0.0], [1.0, 2.0], [3.0, 0.0]], atol=1e-12)


def test_cells_of_a_curved_lattice_are_as_large_along_the_surface() -> None:
    lattice = turned(0.0)
    lattice[..., 2] = 4.0 * np.arange(4)
    np.testing.assert_allclose(cell_size(lattice), [5.0, 2.0])


def test_a_lattice_in_one_place_has_axes_of_no_length() -> None:
    assert not lattice_axes(np.zeros((2, 2, 3))).any()
