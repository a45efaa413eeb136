"""Right digits on the NIST StRD linear sets: this package beside statsmodels, NumPy and SciPy."""

import csv
import warnings
from pathlib import Path

import mpmath
import numpy as np
import scipy.linalg

from estimators.linear.least_squares import factorise, solve

FOLDER = Path(__file__).parents[3] / "shared" / "data" / "strd"
DEGREE = {"filip": 10, "norris": 1, "pontius": 2} | {f"wampler{k}": 5 for k in range(1, 6)}
SETS = ["norris", "pontius", "noint1", "noint2", "longley", "filip", *(f"wampler{k}" for k in range(1, 6))]
Matrix = list[list[mpmath.mpf]]


def digits_table() -> list[dict[str, float | str]]:
    """Fewest right digits of coefficients and standard errors, a row a set; empty where the sets are not at hand."""
    if not FOLDER.is_dir():
        return []
    with mpmath.workdps(120):
        return [_row(name) for name in SETS]


def _row(name: str) -> dict[str, float | str]:
    x, y = _read(name)
    constant = not name.startswith("noint")
    certified = _certificate(x, y, constant)
    doubles = _as_doubles(name, x)
    response = np.array([float(t) for t in y])
    design = np.column_stack([np.ones(len(y)), doubles]) if constant else doubles
    extended = np.column_stack([_as_long(x), _as_long([[t] for t in y])])
    answers = {
        "ours": _ours(np.column_stack([doubles, response]), constant),
        "ours, design in extended precision": _ours(extended, constant),
        "statsmodels pinv": _statsmodels(design, response, "pinv"),
        "statsmodels qr": _statsmodels(design, response, "qr"),
        "numpy lstsq": (np.linalg.lstsq(design, response)[0], None),
        "scipy lstsq": (scipy.linalg.lstsq(design, response)[0], None),
    }
    return {"set": name} | {solver: _score(answer, certified) for solver, answer in answers.items()}


def _score(answer: tuple[np.ndarray, np.ndarray | None], certified: tuple[list[mpmath.mpf], list[mpmath.mpf]]) -> str:
    return " / ".join(
        f"{_digits(found, truth):.1f}" for found, truth in zip(answer, certified, strict=True) if found is not None
    )


def _digits(found: np.ndarray, certified: list[mpmath.mpf]) -> float:
    fewest = 15.0
    for value, truth in zip(found, certified, strict=True):
        if not np.isfinite(value):
            return 0.0
        exact = mpmath.mpf(float(value)) + mpmath.mpf(float(value - np.longdouble(float(value))))
        error = abs(exact - truth) / (abs(truth) if abs(truth) > mpmath.mpf(10) ** -60 else 1)
        fewest = min(fewest, float(-mpmath.log10(error)) if error > 0 else 15.0)
    return max(fewest, 0.0)


def _ours(columns: np.ndarray, constant: bool) -> tuple[np.ndarray, np.ndarray]:
    fit = solve(factorise(columns, intercept=constant))
    scale = fit.residual_norm / np.sqrt(len(columns) - len(fit.coefficients))
    return fit.coefficients, scale * np.sqrt(np.sum(fit.root**2, axis=1))


def _statsmodels(design: np.ndarray, response: np.ndarray, method: str) -> tuple[np.ndarray, np.ndarray]:
    from statsmodels.regression.linear_model import OLS

    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that it warns is no help to a caller who wants digits
        fit = OLS(response, design).fit(method=method)
        return fit.params, fit.bse


def _read(name: str) -> tuple[Matrix, list[mpmath.mpf]]:
    with (FOLDER / f"{name}.csv").open() as file:
        rows = [[mpmath.mpf(cell) for cell in row] for row in list(csv.reader(file))[1:]]
    if name in DEGREE:
        return [[row[1] ** k for k in range(1, DEGREE[name] + 1)] for row in rows], [row[0] for row in rows]
    return [row[1:] for row in rows], [row[0] for row in rows]


def _certificate(x: Matrix, y: list[mpmath.mpf], constant: bool) -> tuple[list[mpmath.mpf], list[mpmath.mpf]]:
    design, response = mpmath.matrix([[1] * constant + row for row in x]), mpmath.matrix(y)
    inverse = (design.T * design) ** -1
    beta = inverse * (design.T * response)
    left = response - design * beta
    variance = (left.T * left)[0] / (design.rows - design.cols)
    return list(beta), [mpmath.sqrt(variance * inverse[k, k]) for k in range(design.cols)]


def _as_doubles(name: str, x: Matrix) -> np.ndarray:
    if name not in DEGREE:
        return np.array([[float(cell) for cell in row] for row in x])
    first = np.array([float(row[0]) for row in x])
    return np.column_stack([first**k for k in range(1, DEGREE[name] + 1)])


def _as_long(rows: Matrix) -> np.ndarray:
    high = np.array([[float(cell) for cell in row] for row in rows])
    low = np.array([[float(cell - mpmath.mpf(float(cell))) for cell in row] for row in rows])
    return high.astype(np.longdouble) + low
