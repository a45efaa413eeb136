"""Active sets in plain Python, on operators whose solutions are known: springs side by side, and small dense ones."""

from collections.abc import Iterator

import numpy as np
import pytest
from scipy.optimize import nnls

from slipcore.contact.solver import active_sets
from slipcore.contact.solver.active_sets import Relaxed
from tests.slipcore.plain_kernels import as_plain_python

HEIGHT = np.array([[[0.0, 1.0, 3.0], [2.0, 0.5, np.inf]]])
"""m; no surface in the last cell."""
SPRINGS = np.diag(np.full(6, 0.5))
"""Displacement, m, by pressure, Pa."""
STIFF = np.linalg.inv(SPRINGS)
SET = (1e-3, 10)


@pytest.fixture(autouse=True)
def plain() -> Iterator[None]:
    def convolve(field: np.ndarray, image: np.ndarray, operator: np.ndarray) -> None:
        image[:] = (operator @ field.ravel()).reshape(field.shape)

    with pytest.MonkeyPatch.context() as patched:
        as_plain_python(patched, active_sets)
        patched.setattr(active_sets, "convolve", convolve)
        yield


def solved(
    given: tuple[bool, float, float],
    operator: np.ndarray = SPRINGS,
    height: np.ndarray = HEIGHT,
    start: np.ndarray | None = None,
    most: int = 50,
) -> Relaxed:
    guess = np.zeros_like(height) if start is None else start
    by, bounds = (operator, np.linalg.inv(operator)), (1e-9, most, 4, 1e-12)
    return active_sets.relaxed(guess, height, given, by, bounds, SET)


@pytest.mark.parametrize("approach", [0.25, 1.5, 5.0])
def test_springs_press_by_what_they_are_pressed_in_and_never_pull(approach: float) -> None:
    found = solved((False, approach, 0.0))
    expected = 2.0 * np.maximum(approach - HEIGHT, 0.0)
    np.testing.assert_allclose(found.pressure, expected, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(found.displacement, 0.5 * expected, rtol=0.0, atol=1e-8)
    assert found.approach == approach
    assert found.residual <= 1e-9


@pytest.mark.parametrize(("total", "approach"), [(0.5, 0.25), (3.0, 1.0), (10.0, 2.125), (26.0, 3.9)])
def test_a_sum_of_pressures_is_met_at_the_approach_that_makes_it(total: float, approach: float) -> None:
    """Springs of 2 Pa/m at 0, 0.5, 1, 2 and 3 m: 2 Σ (δ − h) over those that touch."""
    found = solved((True, total, 0.0))
    assert found.pressure.sum() == pytest.approx(total, rel=1e-12)
    assert found.approach == pytest.approx(approach, rel=1e-6)
    np.testing.assert_allclose(found.pressure, 2.0 * np.maximum(approach - HEIGHT, 0.0), rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_cells_that_press_one_another_in_solve_the_quadratic_programme(seed: int) -> None:
    """min ½ pᵀCp + pᵀ(h − δ) over p ≥ 0, by an independent solver of non-negative least squares."""
    rng = np.random.default_rng(seed)
    apart = np.abs(np.subtract.outer(np.arange(8.0), np.arange(8.0)))
    compliance, height = 1.0 / (1.0 + apart) ** 1.5, rng.uniform(0.0, 1.0, (1, 2, 4))
    root = np.linalg.cholesky(compliance)
    expected, _ = nnls(root.T, np.linalg.solve(root, 0.6 - height.ravel()))
    found = solved((False, 0.6, float(height.min())), compliance, height)
    np.testing.assert_allclose(found.pressure.ravel(), expected, rtol=0.0, atol=1e-7)
    assert 0 < np.count_nonzero(expected) < 8
    again = solved((True, float(expected.sum()), float(height.min())), compliance, height)
    np.testing.assert_allclose(again.pressure, found.pressure, rtol=0.0, atol=1e-6)
    assert again.approach == pytest.approx(0.6, rel=1e-6)


def test_a_solution_is_known_at_once_and_what_it_took_is_counted() -> None:
    solution = solved((False, 1.5, 0.0))
    again = solved((False, 1.5, 0.0), start=solution.pressure)
    assert (again.iterations, again.applications) == (0, 1)
    assert solution.iterations > 0
    assert solution.applications > solution.iterations


def test_no_more_sets_are_tried_than_are_allowed() -> None:
    found = solved((False, 1.5, 0.0), most=0)
    assert (found.iterations, found.applications, found.residual) == (0, 1, np.inf)
    one = solved((False, 1.5, 0.0), most=1)
    assert one.iterations == 1
    assert one.residual == pytest.approx(1.0, rel=1e-12)  # before it: all 1.5 m of 1.5 m are left


def test_the_energy_counts_pressed_cells_alone() -> None:
    pressure, displacement = np.array([[[2.0, 0.0], [1.0, 0.0]]]), np.array([[[1.0, 9.0], [3.0, 9.0]]])
    height = np.array([[[0.5, 1.0], [0.25, np.inf]]])
    assert active_sets._energy(pressure, displacement, height, (True, 7.0, 0.0)) == 2.0 * 1.0 + 1.0 * 1.75
    assert active_sets._energy(pressure, displacement, height, (False, 7.0, 0.0)) == 3.75 - 3.0 * 7.0


def test_the_approach_closes_the_gap_on_average_under_pressure() -> None:
    pressure, displacement = np.array([[[2.0, 0.0, 1.0]]]), np.array([[[1.0, 9.0, 3.0]]])
    assert active_sets._mean_under(pressure, displacement, np.array([[[0.5, 1.0, 0.25]]])) == 4.75 / 2.0


@pytest.mark.parametrize(
    ("gap", "worst"),
    [
        ([0.1, 5.0, 0.2], 0.2),
        ([-0.3, 5.0, 0.2], 0.3),
        ([0.1, -0.7, 0.2], 0.7),
        ([0.0, 5.0, 0.0], 0.0),
        ([0.1, np.nan, 0.2], np.nan),
        ([np.nan, 0.0, 0.2], np.nan),
    ],
)
def test_a_gap_under_pressure_or_penetration_beside_it_is_wrong(gap: list[float], worst: float) -> None:
    found = active_sets._violation(np.array([[[1.0, 0.0, 2.0]]]), np.array([[gap]]))
    np.testing.assert_array_equal(found, worst)


def test_pressure_is_clipped_at_zero_and_scaled_to_its_sum() -> None:
    pressure = np.array([[[3.0, -1.0, 1.0]]])
    assert active_sets._make_feasible(pressure, np.zeros((1, 1, 3)), (True, 8.0, 0.0))
    np.testing.assert_array_equal(pressure, [[[6.0, 0.0, 2.0]]])
    assert not active_sets._make_feasible(pressure, np.zeros((1, 1, 3)), (False, 1.0, 0.0))
    np.testing.assert_array_equal(pressure, [[[6.0, 0.0, 2.0]]])


def test_an_empty_contact_fills_where_the_height_is_lowest() -> None:
    pressure, height = np.array([[[-1.0, 0.0, -2.0, 0.0]]]), np.array([[[0.5, 0.1, 0.1, np.inf]]])
    assert active_sets._make_feasible(pressure, height, (True, 3.0, 0.1))
    np.testing.assert_array_equal(pressure, [[[0.0, 1.5, 1.5, 0.0]]])
    nothing = np.zeros((1, 1, 4))
    assert not active_sets._make_feasible(nothing, height, (False, 3.0, 0.1))
    assert not nothing.any()


def test_a_field_is_restricted_to_active_cells_and_to_no_sum() -> None:
    active = np.array([[[True, False, True, True]]])
    field = np.array([[[1.0, 7.0, 2.0, 6.0]]])
    active_sets._restrict(field, active, balanced=False)
    np.testing.assert_array_equal(field, [[[1.0, 0.0, 2.0, 6.0]]])
    active_sets._restrict(field, active, balanced=True)
    np.testing.assert_array_equal(field, [[[-2.0, 0.0, -1.0, 3.0]]])
    active_sets._restrict(field, np.zeros_like(active), balanced=True)
    assert not field.any()


def test_a_step_goes_along_its_direction_and_its_image() -> None:
    change, response, residual = (np.full((1, 1, 2), value) for value in (1.0, 2.0, 3.0))
    direction, image = np.array([[[1.0, -1.0]]]), np.array([[[4.0, 2.0]]])
    active_sets._advance(change, response, residual, direction, image, 0.5)
    np.testing.assert_array_equal(change, [[[1.5, 0.5]]])
    np.testing.assert_array_equal(response, [[[4.0, 3.0]]])
    np.testing.assert_array_equal(residual, [[[5.0, 4.0]]])
    active_sets._turn(direction, image, 0.25)
    np.testing.assert_array_equal(direction, [[[-3.75, -2.25]]])
    assert active_sets._inner(change, image) == 7.0


@pytest.mark.parametrize("balanced", [False, True])
def test_a_relaxed_set_closes_its_gap_alike_and_moves_no_other_cell(balanced: bool) -> None:
    rng = np.random.default_rng(3)
    root = rng.standard_normal((6, 6))
    operator, gap = root @ root.T + 6.0 * np.eye(6), rng.standard_normal((1, 2, 3))
    active = np.array([[[True, True, False], [True, False, True]]])
    by = (operator, np.linalg.inv(operator))
    change, response, count = active_sets._relax(active, gap, balanced, by, (1e-12, 20))
    np.testing.assert_allclose(response.ravel(), operator @ change.ravel(), rtol=1e-9, atol=1e-12)
    assert not change[~active].any()
    left = (gap + response)[active]
    np.testing.assert_allclose(left, left.mean() if balanced else 0.0, rtol=0.0, atol=1e-9)
    assert change.sum() == pytest.approx(0.0, abs=1e-12) or not balanced
    assert 1 <= count <= 6


def test_a_set_that_is_closed_takes_no_operator_and_a_bound_is_kept() -> None:
    active, gap = np.ones((1, 2, 3), bool), np.full((1, 2, 3), 0.5)
    change, _, count = active_sets._relax(active, gap, True, (SPRINGS, STIFF), SET)
    assert count == 0
    assert not change.any()
    operator = np.diag(np.arange(1.0, 7.0))
    uneven = np.arange(6.0).reshape(1, 2, 3) + 1.0
    assert active_sets._relax(active, uneven, False, (operator, np.eye(6)), (1e-12, 2))[2] == 2
    assert active_sets._relax(active, uneven, False, (operator, np.linalg.inv(operator)), (1e-6, 9))[2] == 1


def test_a_descent_ends_at_the_lowest_point_of_its_way() -> None:
    """Of springs the projected gradient at their mean stiffness: of an even pressure all but the last gap closes."""
    pressure = np.array([[[1.0, 1.0, 0.0]]])
    operator, height = 0.5 * np.eye(3), np.array([[[0.0, 0.25, 0.4]]])
    displacement = 0.5 * pressure
    gap = displacement + height - 1.0
    np.testing.assert_allclose(gap, [[[-0.5, -0.25, -0.6]]], rtol=1e-12)
    given = (False, 1.0, 0.0)
    found, moved = active_sets._descend(pressure, displacement, gap, (1.0, height, given, operator))
    way = np.array([0.5, 0.25, 0.6])  # stiffness: mean pressure 1 over a depth of 1
    np.testing.assert_allclose(found.ravel(), pressure.ravel() + way, rtol=1e-12)  # at most the whole way
    np.testing.assert_allclose(moved.ravel(), 0.5 * found.ravel(), rtol=1e-12)
    stiff = 4.0 * operator
    found, moved = active_sets._descend(pressure, displacement, gap, (1.0, height, given, stiff))
    np.testing.assert_allclose(found.ravel(), pressure.ravel() + 0.5 * way, rtol=1e-12)  # w·w/(w·2w)
    np.testing.assert_allclose(moved.ravel(), displacement.ravel() + way, rtol=1e-12)


def test_a_descent_from_no_contact_starts_at_a_stiffness_of_one_and_leaves_what_has_no_surface() -> None:
    nothing, gap = np.zeros((1, 1, 3)), np.array([[[-0.5, 0.2, np.inf]]])
    height = np.array([[[0.0, 0.7, np.inf]]])
    found, _ = active_sets._descend(nothing, nothing, gap, (0.5, height, (False, 0.5, 0.0), 2.0 * np.eye(3)))
    np.testing.assert_allclose(found, [[[0.25, 0.0, 0.0]]], rtol=1e-12)  # half of 0.5, at twice the compliance
