"""The benchmark of what accuracy costs in contact: its errors, orders and tables."""

import numpy as np
import pytest

from benchmarks.contact.accuracy import (
    CLOSED,
    FORCE,
    FRICTION,
    HERTZ,
    RADIUS,
    SLIDING,
    YOUNG,
    SceneRun,
    hertz_grid,
    order_table,
    passes,
    plan_of,
    run_table,
    scene_run,
    timed,
)
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import HalfSpace
from slipcore.contact.elasticity.operator import Operators
from slipcore.contact.solver.normal import solve_normal
from slipcore.contact.tiers.boundary_elements import Fidelity, run

TOLERANCE = 1e-6


def scene(cells: int, error: float) -> SceneRun:
    return SceneRun("press", cells, 1, 60, 5.0 * error, error, error**2, 0.0, 0.25)


@pytest.mark.parametrize("case", ["Hertz", "Cattaneo–Mindlin", "torsion"])
def test_stress_errs_half_as_much_on_cells_of_half_the_size(case: str) -> None:
    coarse, fine = (timed(CLOSED[case], cells, TOLERANCE)[0] for cells in (32, 64))
    assert 1.7 < coarse / fine < 2.4


def test_an_area_within_its_front_is_nearer_than_cells_counted() -> None:
    def area(grid: Grid, tolerance: float) -> float:
        x, y = grid.points()
        operators = Operators((HalfSpace.from_young(YOUNG, 0.0),))
        solved = solve_normal(operators, grid, (x**2 + y**2) / (2.0 * RADIUS), force=FORCE, tolerance=tolerance)
        return (solved.pressure > 0.0).sum() * grid.cell_area / (np.pi * HERTZ.contact_radius**2) - 1.0

    (within, _), (counted, _) = timed(CLOSED["Hertz, contact area"], 32, TOLERANCE), timed(area, 32, TOLERANCE)
    assert within < 0.3 * counted


def test_a_grid_is_as_wide_as_said_in_contact_radii() -> None:
    grid = hertz_grid(20, 2.2)
    assert grid.shape[0] * grid.pitch[0] == pytest.approx(2.2 * HERTZ.contact_radius, rel=1e-12)
    assert SLIDING == FRICTION * FORCE


def test_orders_are_those_between_the_first_row_and_the_last() -> None:
    rows = [scene(10, 0.1), scene(20, 0.9), scene(40, 0.1 / 4**1.5)]
    assert order_table(rows, "cells").splitlines()[2:] == ["| press | 3.00 |  | 1.50 |"]


def test_a_table_has_a_row_for_each_run() -> None:
    lines = run_table([scene(10, 0.01)], "cells").splitlines()
    assert lines[0].startswith("| scene | cells |")
    assert lines[2:] == ["| press | 10 | 0.0500 | 0.01000 | 1.0e-04 | 0.0e+00 | 0.25 |"]


def test_a_scene_is_held_against_a_finer_run_of_it() -> None:
    plan, name = plan_of("lifting_07N"), "lifting_07N"
    fine = run(plan, Fidelity(24, aligned=False))
    same, coarse = (scene_run(name, plan, Fidelity(cells, aligned=False), fine) for cells in (24, 12))
    assert (same.stick_ratio, same.mean_stick_ratio, same.displacement, same.force) == (0.0, 0.0, 0.0, 0.0)
    assert (coarse.scene, coarse.cells, coarse.substeps, coarse.steps) == (name, 12, 1, same.steps)
    assert 0.0 < coarse.mean_stick_ratio <= coarse.stick_ratio < 0.2
    assert 0.0 < coarse.displacement < coarse.force < 0.1


def test_the_stick_ratio_passes_a_level_between_two_frames() -> None:
    log = run(plan_of("lifting_07N", 2), Fidelity(12))
    assert log.truth is not None
    assert len(log.time) == 2 * len(run(plan_of("lifting_07N"), Fidelity(12)).time) - 1
    (time,) = passes(log, [0.5])
    before = np.searchsorted(log.time, time) - 1
    low, high = log.truth.stick_ratio[before + 1], log.truth.stick_ratio[before]
    assert low < 0.5 <= high
    assert np.interp(time, log.time, log.truth.stick_ratio) == pytest.approx(0.5, abs=1e-12)
    assert len(passes(log, [-1.0])) == 0
