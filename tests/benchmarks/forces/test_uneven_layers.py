"""Finite elements of gels that are not alike thick."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.forces import uneven, uneven_layers
from benchmarks.forces.scenes import CELL, CONTACTS, LATTICES, PROGRESS, SIDE, press, traction
from slipcore.forces import Gel

FLAT = uneven.Shape("dome", 0.0)


def test_around_an_axis_a_flat_layer_moves_as_its_kernels_say() -> None:
    ((_, found),) = uneven.presses(FLAT)
    kernels = press("sphere", Gel(1e6, 0.49, 5e-3), uneven.LATTICE)
    away = np.abs(found.log.displacement - kernels.log.displacement).max()
    assert away < 2.5e-3 * np.abs(kernels.log.displacement).max()


def test_along_a_line_it_does_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in (("SHORTEST", 24), ("LAYERS", 8), ("FINE", 0.6e-3)):
        monkeypatch.setattr(uneven_layers, name, value)
    lattice, centre = LATTICES["10 × 7"], (1e-3, -0.5e-3)
    columns, rows = (CELL * (index - SIDE // 2) for index in lattice.indices())
    loads = traction(CONTACTS["two contacts"], *PROGRESS[1], centre)[None]
    layer = replace(FLAT.layer(), ring=False)
    moved = uneven_layers.moved_by_cells(layer, loads, CELL, (columns, rows))[0]
    kernels = press("two contacts", Gel(1e6, 0.49, 5e-3), lattice, centre, PROGRESS[1:]).log.displacement[0]
    away = np.abs(moved - (kernels * [1.0, 1.0, -1.0]).transpose(2, 1, 0)).max()
    assert away < 0.02 * np.abs(kernels).max()


def test_a_row_tells_the_gel_and_how_well() -> None:
    parts = ((0.01, 0.02), (0.1, 0.2), ((5, 10), (3, 4)))
    row = uneven.uneven_table([uneven.Outcome("dome − 7 %", "with z", 3e-3, uneven.BY_MAP, *parts)]).splitlines()[-1]
    assert [cell.strip() for cell in row.strip("|").split("|")] == [
        "dome − 7 %", "with z", "3", "its map", "1 / 2", "10 / 20", "50% / 75%",
    ]  # fmt: skip
