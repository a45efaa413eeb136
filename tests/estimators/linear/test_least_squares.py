"""The least-squares core on hard problems, against 120-digit solutions and closed forms."""

import csv
from dataclasses import replace
from pathlib import Path

import mpmath
import numpy as np
import pytest

from estimators.defaults import LINEAR
from estimators.linear.least_squares import (
    Factor,
    condition_number,
    factorise,
    merge,
    solve,
    triangular_inverse,
    upper_triangle,
)

STRD = Path(__file__).parents[4] / "shared" / "data" / "strd"
DEGREE = {"filip": 10, "norris": 1, "pontius": 2} | {f"wampler{k}": 5 for k in range(1, 6)}

# Fewest right digits (coefficients, standard errors): with the powers as doubles, and in extended precision.
DIGITS = {
    "longley": ((12.0, 12.0), (14.0, 14.0)),
    "filip": ((7.0, 7.0), (10.0, 10.0)),
    "norris": ((12.0, 13.0), (14.0, 14.0)),
    "pontius": ((12.0, 12.0), (14.0, 14.0)),
    "noint1": ((14.0, 14.0), (14.0, 14.0)),
    "noint2": ((14.0, 14.0), (14.0, 14.0)),
    "wampler1": ((12.0, 12.0), (12.0, 12.0)),
    "wampler2": ((12.0, 12.0), (12.0, 12.0)),
    "wampler3": ((12.0, 14.0), (12.0, 14.0)),
    "wampler4": ((11.0, 14.0), (11.0, 14.0)),
    "wampler5": ((9.0, 14.0), (9.0, 14.0)),
}
EXTENDED = np.finfo(np.longdouble).nmant >= 63

Matrix = list[list[mpmath.mpf]]


def read(name: str) -> tuple[Matrix, list[mpmath.mpf]]:
    """Regressors without the constant, and response, to 120 digits."""
    if not STRD.is_dir():
        pytest.skip("the NIST StRD sets are not beside the project (../shared/data/strd)")
    with (STRD / f"{name}.csv").open() as file:
        rows = [[mpmath.mpf(cell) for cell in row] for row in list(csv.reader(file))[1:]]
    if name in DEGREE:
        return [[row[1] ** k for k in range(1, DEGREE[name] + 1)] for row in rows], [row[0] for row in rows]
    return [row[1:] for row in rows], [row[0] for row in rows]


def certificate(x: Matrix, y: list[mpmath.mpf], intercept: bool) -> tuple[list[mpmath.mpf], list[mpmath.mpf]]:
    """Coefficients and standard errors by the normal equations, which 120 digits can afford."""
    design, response = mpmath.matrix([[1] * intercept + row for row in x]), mpmath.matrix(y)
    inverse = (design.T * design) ** -1
    beta = inverse * (design.T * response)
    residual = response - design * beta
    variance = (residual.T * residual)[0] / (design.rows - design.cols)
    return list(beta), [mpmath.sqrt(variance * inverse[k, k]) for k in range(design.cols)]


def as_doubles(name: str, x: Matrix, y: list[mpmath.mpf]) -> np.ndarray:
    if name not in DEGREE:
        return np.array([[float(cell) for cell in [*row, t]] for row, t in zip(x, y, strict=True)])
    first = np.array([float(row[0]) for row in x])
    powers = [first**k for k in range(1, DEGREE[name] + 1)]
    return np.column_stack([*powers, [float(t) for t in y]])


def as_long_doubles(x: Matrix, y: list[mpmath.mpf]) -> np.ndarray:
    rows = [[*row, t] for row, t in zip(x, y, strict=True)]
    high = np.array([[float(cell) for cell in row] for row in rows])
    low = np.array([[float(cell - mpmath.mpf(float(cell))) for cell in row] for row in rows])
    return high.astype(np.longdouble) + low


def digits(found: np.ndarray, certified: list[mpmath.mpf]) -> float:
    """Fewest right digits; a certified zero counts absolutely."""
    fewest = 15.0
    for value, truth in zip(found, certified, strict=True):
        exact = mpmath.mpf(float(value)) + mpmath.mpf(float(value - np.longdouble(float(value))))
        error = abs(exact - truth) / (abs(truth) if abs(truth) > mpmath.mpf(10) ** -60 else 1)
        fewest = min(fewest, float(-mpmath.log10(error)) if error > 0 else 15.0)
    return fewest


@pytest.mark.parametrize("extended", [False, True], ids=["double", "extended"])
@pytest.mark.parametrize("name", DIGITS)
def test_nist_sets_are_solved_to_the_digits_asked_for(name: str, extended: bool) -> None:
    if extended and not EXTENDED:
        pytest.skip("this platform's long double has no more digits than a double")
    intercept = not name.startswith("noint")
    with mpmath.workdps(120):
        x, y = read(name)
        beta, errors = certificate(x, y, intercept)
        columns = as_long_doubles(x, y) if extended else as_doubles(name, x, y)
        fit = solve(factorise(columns, intercept=intercept))
        scale = fit.residual_norm / np.sqrt(len(y) - len(beta))
        found = digits(fit.coefficients, beta), digits(scale * np.sqrt(np.sum(fit.root**2, axis=1)), errors)
    wanted = DIGITS[name][extended]
    assert found[0] >= wanted[0], found
    assert found[1] >= wanted[1], found


def test_weights_act_as_repeated_rows() -> None:
    rng = np.random.default_rng(0)
    columns, times = rng.standard_normal((30, 3)), rng.integers(1, 5, 30)
    weighted, repeated = factorise(columns, times.astype(float)), factorise(np.repeat(columns, times, axis=0))
    np.testing.assert_allclose(weighted.triangle, repeated.triangle, rtol=1e-12, atol=1e-13)
    assert weighted.weight == repeated.weight == times.sum()


def test_chunks_do_not_show(monkeypatch: pytest.MonkeyPatch) -> None:
    columns = np.random.default_rng(0).standard_normal((1000, 3)) + 5.0
    whole = factorise(columns)
    monkeypatch.setattr("estimators.linear.least_squares.LINEAR", replace(LINEAR, chunk=7))
    np.testing.assert_allclose(factorise(columns).triangle, whole.triangle, rtol=1e-12, atol=1e-13)


def test_merged_factors_keep_the_sum_of_squares() -> None:
    rng = np.random.default_rng(0)
    parts = [rng.standard_normal((k + 1, 3)) + k for k in range(6)]
    merged = merge(factorise(part) for part in parts)
    rows = np.concatenate(parts)
    centred = rows - rows.mean(axis=0)
    np.testing.assert_allclose(merged.triangle.T @ merged.triangle, centred.T @ centred, rtol=1e-12)
    np.testing.assert_allclose(merged.mean, rows.mean(axis=0), rtol=1e-14)


def test_condition_number_is_that_of_scaled_columns() -> None:
    triangle = np.array([[1e9, 0.6e-5], [0.0, 0.8e-5]])
    np.testing.assert_allclose(condition_number(triangle), np.sqrt(1.6 / 0.4), rtol=1e-12)


def test_input_is_left_as_it_was() -> None:
    columns = np.asfortranarray(np.random.default_rng(0).standard_normal((50, 3)))
    before = columns.copy()
    factor = factorise(columns, intercept=False)
    np.testing.assert_array_equal(columns, before)
    kept = Factor(factor.weight, factor.mean.copy(), factor.triangle.copy())
    solve(factor)
    np.testing.assert_array_equal(factor.triangle, kept.triangle)


@pytest.mark.parametrize("dtype", [np.float64, np.longdouble])
def test_a_triangle_has_a_diagonal_of_0_or_more_and_the_rows_sum_of_squares(dtype: type) -> None:
    rows = np.random.default_rng(3).standard_normal((7, 3)).astype(dtype)
    for some in (rows, rows[:2]):
        upper = upper_triangle(some.copy())
        assert (np.diag(upper) >= 0.0).all()
        np.testing.assert_array_equal(upper, np.triu(upper))
        np.testing.assert_allclose((upper.T @ upper).astype(float), (some.T @ some).astype(float), atol=1e-14)
    whole = np.triu(rows[:3]) + 3.0 * np.eye(3)
    np.testing.assert_allclose((triangular_inverse(whole) @ whole).astype(float), np.eye(3), atol=1e-14)


def test_variance_inflation_is_one_over_what_other_columns_leave() -> None:
    """Columns of correlation 0.6: 1/(1 − 0.36)."""
    x = np.array([[1.0, 0.6], [0.0, 0.8], [-1.0, -0.6], [0.0, -0.8]])
    fit = solve(factorise(np.column_stack([x, x @ [2.0, 3.0]])))
    np.testing.assert_allclose(fit.inflation, [1.0 / 0.64] * 2, rtol=1e-12)
    np.testing.assert_allclose(fit.coefficients.astype(float), [0.0, 2.0, 3.0], atol=1e-12)
    assert (fit.rank, fit.residual_norm) == (2, pytest.approx(0.0, abs=1e-12))
    assert fit.condition == pytest.approx(np.sqrt(1.6 / 0.4))


def test_of_columns_that_are_alike_the_slopes_are_the_smallest_by_their_spans() -> None:
    """x and 2x with a response of 10x: of b₁ + 2 b₂ = 10 the least (b₁ s₁)² + (b₂ s₂)² has b₁ s₁² = b₂ s₂²/2."""
    x = np.array([-1.0, 0.0, 1.0, 2.0])
    factor = factorise(np.column_stack([x, 2.0 * x, 10.0 * x + 1.0]))
    for spans, slopes in (((1.0, 1.0), (2.0, 4.0)), ((1.0, 2.0), (10.0 / 2.0, 10.0 / 4.0))):
        fit = solve(factor, np.array(spans))
        assert fit.rank == 1
        np.testing.assert_allclose(fit.coefficients.astype(float), [1.0, *slopes], rtol=1e-9, atol=1e-9)
        unseen = np.array([0.0, 2.0, -1.0])
        assert unseen @ fit.prior_covariance @ unseen > 0.0
        seen = np.array([0.0, 1.0, 2.0])
        assert seen @ fit.prior_covariance @ seen == pytest.approx(0.0, abs=1e-12)


def test_a_column_that_is_constant_but_for_rounding_says_nothing() -> None:
    x, flat = np.array([1.0, 2.0, 4.0, 9.0]), np.array([1e3, 1e3 + 1e-13, 1e3, 1e3])
    fit = solve(factorise(np.column_stack([x, flat, 3.0 * x])), np.ones(2))
    assert fit.rank == 1
    np.testing.assert_allclose(fit.coefficients.astype(float)[1:], [3.0, 0.0], atol=1e-9)
