"""Areas and places of lattices."""

import numpy as np
import pytest

from service.formats.lattice import element_area, flat_lattice
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
