"""The data that coverage is counted on, and how it is counted."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import estimators
from benchmarks.estimators import coverage
from benchmarks.estimators.__main__ import SIGMA, TRUTH, heteroscedastic, make, noisy_forces, outliers
from benchmarks.estimators.coverage import ELEMENTS, GRASPS, KINDS, METHODS, N, compact, covered, plane
from slipcore.samples import FrictionSamples


def parts(kind: str, seed: int) -> list[FrictionSamples]:
    made = KINDS[kind](seed)
    return made if isinstance(made, list) else [made]


def errors(kind: str, seed: int) -> np.ndarray:
    """Of friction, in standard deviations, [grasps, samples]."""
    return np.array([(part.friction_coefficient - plane(part)) / SIGMA for part in parts(kind, seed)])


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_is_of_its_seed_and_its_columns_agree(kind: str) -> None:
    for part, again in zip(parts(kind, 3), parts(kind, 3), strict=True):
        np.testing.assert_array_equal(part.friction_coefficient, again.friction_coefficient)
        expected = part.friction_coefficient * part.normal_force
        np.testing.assert_allclose(part.tangential_force, expected, rtol=1e-12, atol=1e-15)
    assert not np.array_equal(errors(kind, 3), errors(kind, 4))


def test_sizes_are_those_told() -> None:
    for kind in KINDS:
        sizes = [len(part) for part in parts(kind, 0)]
        assert sizes == {"grasps differ": [N // GRASPS] * GRASPS, "places differ": [150] * GRASPS}.get(kind, [N])


def many(kind: str, seeds: int = 40) -> np.ndarray:
    return np.concatenate([errors(kind, seed) for seed in range(seeds)])


@pytest.mark.parametrize(
    ("kind", "variance"),
    [
        ("independent", 1.0),
        ("shared by element", 2.0),
        ("autocorrelated", 1.0),
        ("Student-t", 3.0),
        ("grasps differ", 1.0 + (0.03 / SIGMA) ** 2),
        ("places differ", 2.0),
    ],
)
def test_errors_have_the_variance_of_their_law(kind: str, variance: float) -> None:
    assert many(kind).var() == pytest.approx(variance, rel=0.2)


def test_errors_that_follow_each_other_are_correlated_by_four_fifths() -> None:
    found = many("autocorrelated", 20)
    assert np.mean(found[:, 1:] * found[:, :-1]) / found.var() == pytest.approx(0.8, abs=0.03)
    independent = many("independent", 20)
    assert abs(np.mean(independent[:, 1:] * independent[:, :-1])) < 0.05


@pytest.mark.parametrize("kind", ["shared by element", "places differ"])
def test_half_of_the_variance_is_an_elements(kind: str) -> None:
    shared = [
        [error[part.element == element].mean() for element in range(ELEMENTS) if (part.element == element).any()]
        for seed in range(40)
        for error, part in zip(errors(kind, seed), parts(kind, seed), strict=True)
    ]
    count = len(parts(kind, 0)[0]) / ELEMENTS
    assert np.concatenate(shared).var() == pytest.approx(1.0 + 1.0 / count, rel=0.2)


def test_scatter_grows_with_the_force_and_outliers_lie_below() -> None:
    data = make(4000, 1)
    error = np.abs(heteroscedastic(data, 1).friction_coefficient - plane(data)) / SIGMA
    light, hard = (error[each].mean() for each in (data.normal_force < 0.03, data.normal_force > 0.09))
    assert hard / light == pytest.approx(0.095 / 0.025, rel=0.2)
    changed = outliers(data, 1).friction_coefficient != data.friction_coefficient
    assert changed.mean() == pytest.approx(0.08, abs=0.02)
    assert outliers(data, 1).friction_coefficient[changed].max() <= 0.3
    noise = noisy_forces(data, 1).normal_force - data.normal_force
    assert noise.std() == pytest.approx(2e-3, rel=0.05)


def test_a_tenth_of_a_mixture_is_wide_and_below() -> None:
    found = many("outlier mixture")
    far = found[found < -4.0]
    assert len(far) / found.size == pytest.approx(0.1 * 0.76, rel=0.15)  # what of N(−7.5, 5²) is below −4
    assert many("noisy f_n").std() > 3.0


def fitted(low: float, high: float, **diagnostics: str) -> Any:
    """A model whose intervals go from so much below the truth to so much above."""
    interval = np.stack([TRUTH + low, TRUTH + high], axis=1)
    return SimpleNamespace(interval=lambda: interval, method="ols", diagnostics=diagnostics)


def test_intervals_that_hold_the_truth_are_counted_and_fits_that_did_not_converge(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fit(_: Any, seed: int, **options: Any) -> Any:
        assert options == {"method": "auto"}
        if seed == 3:
            raise estimators.NotConverged("no end", fitted(-1.0, 1.0))
        low = np.array([-1.0, -1.0, 0.1 if seed == 1 else 0.0])  # an end at the truth holds it
        return fitted(low, 1.0, likelihood="student_t") if seed else fitted(low, 1.0)

    monkeypatch.setattr(coverage.estimators, "fit", fit)
    row = covered("independent", {"method": "auto"}, 4)
    assert [row[f"beta{k}"] for k in range(3)] == [1.0, 1.0, 0.75]
    assert (row["fits"], row["not converged"]) == (4, 1)
    assert row["chosen"] == "ols 2, student_t 2"


def test_each_method_is_fitted_most_often_on_its_own_data(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: dict[tuple[str, str], int] = {}

    def counted(kind: str, options: dict[str, object], fits: int) -> dict[str, float | str]:
        asked[str(options.get("likelihood", options["method"])), kind] = fits
        return {f"beta{k}": 0.95 for k in range(3)}

    monkeypatch.setattr(coverage, "covered", counted)
    rows = coverage.table(20, 8, ["ols", "student_t"])
    assert asked["ols", "independent"] == asked["student_t", "Student-t"] == 20
    assert asked["ols", "Student-t"] == 8
    assert asked["student_t", "independent"] == 2
    assert len(rows) == 2 * len(KINDS)
    assert len(coverage.table(20, 0, ["ols"])) == 1


def test_the_table_shows_per_cent_and_its_own_data_in_bold() -> None:
    rows: list[coverage.Row] = [
        {"method": "ols", "data": "independent", "beta0": 0.951, "beta1": 0.944, "beta2": 1.0},
        {"method": "ols", "data": "Student-t", "beta0": 0.9, "beta1": 0.8, "beta2": 0.7},
        {"method": "student_t", "data": "Student-t", "beta0": 0.95, "beta1": 0.95, "beta2": 0.95},
    ]
    head, rule, first, second = compact(rows).splitlines()
    assert [cell.strip() for cell in head.strip("|").split("|")] == ["method", *KINDS]
    assert rule.count("---") == 1 + len(KINDS)
    cells = dict(zip(KINDS, [cell.strip() for cell in first.strip("|").split("|")][1:], strict=True))
    assert cells["independent"] == "**95 94 100**"
    assert cells["Student-t"] == "90 80 70"
    assert cells["outliers"] == ""
    assert second.startswith("| student_t |")
    assert "**95 95 95**" in second
    assert set(METHODS) >= {"ols", "student_t"}
