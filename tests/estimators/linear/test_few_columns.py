"""Algebra of a few columns, against NumPy's."""

import numpy as np
import pytest

from estimators.linear.few_columns import from_one, power, spanned, times, turned_apart

ALONE = 1e-8
ROWS = np.random.default_rng(0).standard_normal((50, 2))
ALIKE = np.column_stack([ROWS[:, 0], 3.0 * ROWS[:, 0] + 1e-6 * ROWS[:, 1]])


@pytest.mark.parametrize("rows", [ROWS, ALIKE, ROWS * [1e-9, 1.0], ROWS[:, :1]], ids=["any", "alike", "small", "one"])
def test_columns_are_turned_into_singular_vectors(rows: np.ndarray) -> None:
    columns = rows.copy()
    parts = turned_apart(columns)
    np.testing.assert_allclose(np.sort(parts)[::-1], np.linalg.svd(rows, compute_uv=False), rtol=1e-12, atol=1e-14)
    unit = columns / parts
    np.testing.assert_allclose(unit.T @ unit, np.eye(rows.shape[1]), atol=1e-14)


@pytest.mark.parametrize(
    ("rows", "rank"), [(ROWS, 2), (ROWS * [1e-9, 0.0], 1), (ROWS[:, [0, 0]], 1), (0.0 * ROWS, 0)],
    ids=["two", "one", "twice the same", "none"],
)  # fmt: skip
def test_axes_span_the_columns_that_are_not_zero(rows: np.ndarray, rank: int) -> None:
    rows = np.ascontiguousarray(rows)
    axes = spanned(rows, ALONE)
    assert axes.shape == (len(rows), rank)
    np.testing.assert_allclose(axes.T @ axes, np.eye(rank), atol=1e-14)
    np.testing.assert_allclose(axes @ (axes.T @ rows), rows, rtol=1e-12, atol=1e-16)


def test_powers_of_a_matrix_leave_what_is_zero() -> None:
    square = np.outer([3.0, 4.0], [3.0, 4.0])
    np.testing.assert_allclose(power(square, 0.5, ALONE) @ power(square, 0.5, ALONE), square, rtol=1e-12)
    np.testing.assert_allclose(power(square, -1.0, ALONE), np.linalg.pinv(square), rtol=1e-9)
    np.testing.assert_array_equal(power(np.zeros((2, 2)), -0.5, ALONE), 0.0)


@pytest.mark.parametrize("least", [0.1, 1.5, 100.0])
@pytest.mark.parametrize("exponent", [1.0, -0.5])
def test_parts_of_a_matrix_up_to_a_limit_become_one(least: float, exponent: float) -> None:
    square = np.array([[3.0, 1.0], [1.0, 0.5]])
    parts, directions = np.linalg.eigh(square)
    expected = directions * np.where(parts > least, parts**exponent, 1.0) @ directions.T
    np.testing.assert_allclose(from_one(square, least, exponent), expected, rtol=1e-12, atol=1e-14)


def test_a_product_is_that_of_numpy() -> None:
    np.testing.assert_allclose(times(ROWS[:2].copy(), ROWS[2:4].copy()), ROWS[:2] @ ROWS[2:4], rtol=1e-14)
