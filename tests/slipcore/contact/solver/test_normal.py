"""Normal contact against closed forms, and what it refuses."""

import numpy as np
import pytest

from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import HalfSpace
from slipcore.contact.elasticity.operator import Operators
from slipcore.contact.reference.elastic_pair import half_space
from slipcore.contact.reference.flat_punch import FlatPunch
from slipcore.contact.solver.normal import solve_normal
from slipcore.errors import InvalidInput

FORCE = 10.0
WIDTHS = (2.06, 2.1, 2.17)
"""How cells lie on the contact's edge scatters errors by half; means over some widths show the order."""


def l2(got: np.ndarray, exact: np.ndarray) -> float:
    return float(np.sqrt(((got - exact) ** 2).sum() / (exact**2).sum()))


def test_hertz_converges_at_first_order_in_pressure_and_second_in_approach(sphere) -> None:
    errors = []
    for cells in (32, 64, 128, 256):
        for width in WIDTHS:
            case = sphere(cells, width=width)
            solved = solve_normal(case.operators, case.grid, case.height, force=FORCE, tolerance=1e-8)
            assert solved.force == pytest.approx(FORCE, rel=1e-14)
            approach = abs(solved.approach / case.hertz.approach - 1.0)
            errors.append((l2(solved.pressure, case.exact_pressure), approach))
    pressure, approach = np.array(errors).reshape(4, len(WIDTHS), 2).mean(axis=1).T
    assert pressure[1] <= 0.01
    assert approach[1] <= 1e-4
    assert np.log2(pressure[0] / pressure[-1]) / 3 >= 0.9
    assert np.log2(approach[0] / approach[-1]) / 3 >= 1.8


def test_a_given_approach_gives_back_its_force(sphere) -> None:
    case = sphere(64, 0.49)
    pressed = solve_normal(case.operators, case.grid, case.height, force=FORCE, tolerance=1e-9)
    moved = solve_normal(case.operators, case.grid, case.height, approach=pressed.approach, tolerance=1e-9)
    assert moved.force == pytest.approx(FORCE, rel=1e-7)
    np.testing.assert_allclose(moved.pressure, pressed.pressure, rtol=0.0, atol=1e-6 * pressed.pressure.max())


def test_complementarity_holds(sphere) -> None:
    case = sphere(64)
    solved = solve_normal(case.operators, case.grid, case.height, force=FORCE, tolerance=1e-9)
    loaded = solved.pressure > 0.0
    depth = solved.approach
    assert solved.pressure.min() == 0.0
    assert np.abs(solved.gap[loaded]).max() <= 1e-9 * depth
    assert solved.gap[~loaded].min() >= -1e-9 * depth


def test_applications_hardly_grow_with_the_grid(sphere) -> None:
    for cells in (32, 64, 128, 256):
        case = sphere(cells)
        solved = solve_normal(case.operators, case.grid, case.height, force=FORCE, tolerance=1e-6)
        assert solved.iterations <= 14
        assert case.operators.count.normal <= 45  # on all grids together; a quarter of them on the finest


def test_flat_punch_has_its_approach_despite_infinite_edges() -> None:
    compliance = half_space(1e6, 0.3)
    exact = FlatPunch(4e-3, FORCE, compliance)
    error = []
    for cells in (64, 128):
        grid = Grid.square(cells, 10e-3)
        x, y = grid.points()
        height = np.where(np.hypot(x, y) <= 4e-3, 0.0, np.inf)
        solved = solve_normal(Operators((HalfSpace.from_young(1e6, 0.3),)), grid, height, force=FORCE)
        error.append(abs(solved.approach / exact.approach - 1.0))
    assert error[1] < 0.01
    assert error[1] < error[0]


def test_contacts_apart_are_both_found() -> None:
    grid = Grid.square(64, 40e-3)
    x, y = grid.points()
    height = np.minimum((x - 12e-3) ** 2, (x + 12e-3) ** 2) / 30e-3 + y**2 / 30e-3
    solved = solve_normal(Operators((HalfSpace.from_young(1e6, 0.49),)), grid, height, force=FORCE)
    left = solved.pressure[:, :32].sum() * grid.cell_area
    assert left == pytest.approx(FORCE / 2, rel=1e-6)
    assert not solved.pressure[:, 30:34].any()


def test_a_start_that_misses_the_contact_does_no_harm(sphere) -> None:
    case = sphere(64)
    wrong = np.zeros(case.grid.shape)
    wrong[:4, :4] = 1e5
    solved = solve_normal(case.operators, case.grid, case.height, force=FORCE, start=wrong)
    right = solve_normal(case.operators, case.grid, case.height, force=FORCE)
    np.testing.assert_allclose(solved.pressure, right.pressure, rtol=0.0, atol=1e-5 * right.pressure.max())


def test_bodies_apart_have_no_pressure_and_no_nan(sphere) -> None:
    case = sphere(32)
    for given in ({"force": 0.0}, {"approach": 0.0}, {"approach": -1e-3}):
        solved = solve_normal(case.operators, case.grid, case.height, **given)
        assert not solved.pressure.any()
        assert np.isfinite(solved.gap).all()
        assert (solved.force, solved.residual, solved.iterations) == (0.0, 0.0, 0)


@pytest.mark.parametrize(
    "given",
    [{}, {"force": 1.0, "approach": 1e-3}, {"force": -1.0}, {"force": np.nan}, {"force": np.inf}, {"approach": np.nan}],
)
def test_impossible_loads_are_refused(sphere, given: dict[str, float]) -> None:
    case = sphere(32)
    with pytest.raises(InvalidInput):
        solve_normal(case.operators, case.grid, case.height, **given)


def test_impossible_heights_are_refused(sphere) -> None:
    case = sphere(32)
    for height in (np.full(case.grid.shape, np.nan), np.full(case.grid.shape, np.inf), np.zeros((3, 3))):
        with pytest.raises(InvalidInput, match="height"):
            solve_normal(case.operators, case.grid, height, force=1.0)
