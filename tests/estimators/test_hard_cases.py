"""The hard cases, walked one by one: a right answer to the digits stated, or a named error."""

from collections.abc import Callable
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

import estimators
from estimators import Domain, Moments
from estimators.defaults import REFERENCE
from estimators.linear.least_squares import factorise, solve
from slipcore.samples import FrictionSamples
from stiction_client.support import Kind

Make = Callable[..., FrictionSamples]

METHODS: dict[str, dict[str, object]] = {
    "ols": {"method": "ols"},
    "robust": {"method": "robust"},
    "conjugate": {"method": "conjugate"},
    "on a grid": {"method": "hierarchical"},
    "auto": {"method": "auto", "accuracy": 0.2, "seconds": 0.05},
    **{
        name: {"method": "bayes", "likelihood": name, "accuracy": 0.2, "seconds": 0.05}
        for name in ("gaussian", "hierarchical", "student_t", "outlier", "errors_in_variables")
    },
}


def hard(samples: Make, case: str) -> FrictionSamples | list[FrictionSamples]:
    """Data of a hard case."""
    rng = np.random.default_rng(0)
    v = np.linspace(1e-3, 5e-3, 100)
    truth = np.array([0.4, 2.0, -0.8])
    made: dict[str, Callable[[], FrictionSamples | list[FrictionSamples]]] = {
        "four samples": lambda: samples(4),
        "five of one element": lambda: samples(5, elements=1),
        "constant velocity": lambda: samples(100, tangential_velocity=np.full(100, 2e-3)),
        "all forces equal": lambda: samples(100, normal_force=np.full(100, 0.05)),
        "both constant": lambda: samples(100, tangential_velocity=np.zeros(100), normal_force=np.full(100, 0.05)),
        "collinear to 1e-12": lambda: samples(
            100, tangential_velocity=v, normal_force=20.0 * v * (1.0 + 1e-12 * rng.standard_normal(100))
        ),
        "coefficients of 1e8": lambda: samples(100, coefficients=1e8 * truth, scale=2e6),
        "coefficients of 1e-8": lambda: samples(100, coefficients=1e-8 * truth, scale=2e-10),
        "no residual": lambda: samples(100, scale=0.0),
        "most to the last digit alike": lambda: replace(
            samples(24, normal_force=np.repeat([0.02, 0.05], 12)),
            friction_coefficient=0.4 - 1e-5 * (np.arange(24) % 5 == 0) * np.arange(24),
        ),
        "no friction": lambda: samples(100, coefficients=np.zeros(3), scale=0.0),
        "negative friction": lambda: samples(100, coefficients=-truth),
        "one gross outlier": lambda: with_outlier(samples(100), 1e12),
        "one gross outlier below": lambda: with_outlier(samples(100), -1e6),
        "velocity offset of 1e9": lambda: samples(
            100, tangential_velocity=1e9 + rng.uniform(0.0, 100.0, 100), coefficients=np.array([0.4, 1e-12, -0.8])
        ),
        "force of zero": lambda: samples(100, normal_force=np.concatenate([[0.0], rng.uniform(0.02, 0.1, 99)])),
        "all forces zero": lambda: samples(100, normal_force=np.zeros(100)),
        "weights of zero": lambda: samples(100, weight=np.concatenate([np.zeros(90), np.ones(10)])),
        "weights of 1e-300": lambda: samples(100, weight=np.concatenate([np.full(90, 1e-300), np.ones(10)])),
        "grasps of one sample": lambda: [samples(1, seed=k) for k in range(8)],
        "the same grasp five times": lambda: [samples(20)] * 5,
        "strided and read-only": lambda: strided(samples(100)),
        "two places": lambda: samples(60, elements=2),
        "one grasp of a hundred times the samples": lambda: [samples(n, seed=n) for n in (20, 21, 22, 2000)],
    }
    return made[case]()


CASES = [
    "four samples",
    "five of one element",
    "constant velocity",
    "all forces equal",
    "both constant",
    "collinear to 1e-12",
    "coefficients of 1e8",
    "coefficients of 1e-8",
    "no residual",
    "most to the last digit alike",
    "no friction",
    "negative friction",
    "one gross outlier",
    "one gross outlier below",
    "velocity offset of 1e9",
    "force of zero",
    "all forces zero",
    "weights of zero",
    "weights of 1e-300",
    "grasps of one sample",
    "the same grasp five times",
    "strided and read-only",
    "two places",
    "one grasp of a hundred times the samples",
]


def with_outlier(data: FrictionSamples, value: float) -> FrictionSamples:
    friction = data.friction_coefficient.copy()
    friction[7] = value
    return replace(data, friction_coefficient=friction, tangential_force=friction * data.normal_force)


def strided(data: FrictionSamples) -> FrictionSamples:
    columns = {name: np.repeat(getattr(data, name), 2)[::2] for name in FrictionSamples.arrays()}
    for column in columns.values():
        column.setflags(write=False)
    return FrictionSamples(**columns, element_area=data.element_area)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("case", CASES)
def test_every_method_gives_a_sound_answer_or_a_named_error(samples: Make, case: str, method: str) -> None:
    """Warnings are errors here: no overflow, no division by zero, no failed factorisation on the way."""
    data, refused = hard(samples, case), ""
    try:
        model = estimators.fit(data, **METHODS[method])
    except estimators.NotConverged as error:
        model = error.model
    except estimators.InvalidSamples as error:
        refused = error.name
    if refused:
        assert case in {"no friction", "negative friction", "all forces zero", "all forces equal", "both constant"}
        assert refused in {"mean friction", "normal_force"}
        return
    v, f_n = (float(np.mean(range_)) for range_ in (model.domain.tangential_velocity, model.domain.normal_force))
    low, middle, high = (float(model.predict(v, f_n, quantile)) for quantile in (0.05, None, 0.95))
    assert np.isfinite([low, middle, high, *model.coefficients, *model.covariance.ravel(), model.scale]).all()
    assert low <= max(middle, 0.0) <= high
    assert model.support in get_args(Kind)
    assert (model.support == "implausible") >= (middle <= 0.0)
    assert (np.diag(model.covariance) >= 0.0).all()


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("friction_coefficient", np.nan, "finite"),
        ("friction_coefficient", np.inf, "finite"),
        ("normal_force", np.nan, "finite"),
        ("normal_force", -1e-3, "at least 0"),
        ("tangential_velocity", -1e-9, "at least 0"),
        ("tangential_force", np.nan, "finite"),
        ("weight", -0.1, "at least 0"),
        ("weight", np.nan, "finite"),
    ],
)
def test_a_bad_number_is_named_with_its_value_and_what_is_allowed(
    samples: Make, name: str, value: float, allowed: str
) -> None:
    good = samples(20)
    column = getattr(good, name).copy()
    column[7] = value
    with pytest.raises(estimators.InvalidSamples, match=f"{name} is .* at sample 7; allowed: {allowed}"):
        estimators.fit(replace(good, **{name: column}))


def test_one_sample_that_outweighs_all_others_is_too_few(samples: Make) -> None:
    weight = np.full(50, 1e-9)
    weight[0] = 1.0
    with pytest.raises(estimators.TooFewSamples, match="worth 1 by their weights"):
        estimators.fit(samples(50, weight=weight))


def test_constant_normal_force_leaves_its_slope_open(samples: Make) -> None:
    model = estimators.fit(samples(300, normal_force=np.full(300, 0.05)))
    np.testing.assert_array_equal(model.identifiable, [False, True, False])
    assert abs(model.predict(2e-3, 0.05) - (0.4 + 2.0 * 2e-3 - 0.8 * 0.05)) < 5 * 0.02 / np.sqrt(300)


@pytest.mark.parametrize("jitter", [0.0, 1e-15, 1e-12])
def test_collinear_velocity_and_force_flag_both_slopes_and_predict_on_the_line(
    samples: Make, places_as_grasps: Callable[[FrictionSamples], list[FrictionSamples]], jitter: float
) -> None:
    v = np.linspace(1e-3, 5e-3, 300)
    f_n = 20.0 * v * (1.0 + jitter * np.random.default_rng(0).standard_normal(300))
    data = samples(300, tangential_velocity=v, normal_force=f_n)
    model = estimators.fit(places_as_grasps(data))
    np.testing.assert_array_equal(model.identifiable, [True, False, False])
    assert model.diagnostics["rank"] == 2.0
    on_line = model.predict(v, f_n)
    assert np.abs(on_line - (0.4 + 2.0 * v - 0.8 * f_n)).max() < 5 * 0.02 * np.sqrt(3 / 300)
    spread = model.predict(v, f_n, 0.95) - model.predict(v, f_n, 0.05)
    assert spread.max() < 4.5 * model.scale
    off_line = model.predict(1e-3, 0.1, 0.95) - model.predict(1e-3, 0.1, 0.05)
    assert off_line > 2.0 * spread.max()  # a corner of the box that no sample was near


def test_an_offset_of_a_billion_costs_no_more_than_its_own_rounding(samples: Make) -> None:
    """Centred factors: merged grasps at 1e9 give the slopes of the very same numbers, centred exactly first."""
    rng = np.random.default_rng(0)
    v = 1e9 + np.round(rng.uniform(0.0, 100.0, 400), 3)
    base = samples(400, tangential_velocity=v - 1e9, coefficients=np.array([0.4, 1e-3, -0.8]))
    far = replace(base, tangential_velocity=v)
    near = replace(base, tangential_velocity=v - 1e9)
    take = [slice(k, k + 50) for k in range(0, 400, 50)]
    names = FrictionSamples.arrays()

    def cut(whole: FrictionSamples, rows: slice) -> Moments:
        columns = {name: getattr(whole, name)[rows] for name in names}
        return Moments.from_samples(FrictionSamples(**columns, element_area=1e-6))

    found, wanted = (
        parts[0].merge(*parts[1:]).fit().coefficients
        for parts in ([cut(whole, rows) for rows in take] for whole in (far, near))
    )
    np.testing.assert_allclose(found[1:], wanted[1:], rtol=1e-8)  # the mean of v is itself rounded to 1e-7


def test_many_moments_merge_to_the_fit_of_all_their_samples(samples: Make) -> None:
    assert _merged(samples, 20_000).n == 20_000


@pytest.mark.long
def test_a_million_moments_merge_to_the_fit_of_all_their_samples(samples: Make) -> None:
    assert _merged(samples, 1_000_000).n == 1_000_000


@pytest.mark.long
def test_a_hundred_thousand_grasps_tell_the_law_and_their_scatter(samples: Make) -> None:
    """Moments of 2,000 grasps of two places, fifty times each: scales as of 2,000, errors 50 times less in square."""
    rng = np.random.default_rng(0)
    parts = [samples(6, seed=k, elements=2, offset=0.02 * rng.standard_normal()) for k in range(2000)]
    moments = [Moments.from_samples(part) for part in parts]
    few, many = (estimators.fit(times * moments, method="hierarchical") for times in (1, 50))
    assert few.scales is not None
    assert many.scales is not None
    np.testing.assert_allclose(many.coefficients, few.coefficients, rtol=0.0, atol=0.1 * few.standard_errors.max())
    np.testing.assert_allclose(few.standard_errors / many.standard_errors, np.sqrt(50.0), rtol=0.1)  # priors tell less
    assert many.scales.between_grasps.value == pytest.approx(few.scales.between_grasps.value, rel=0.1)
    assert few.scales.between_grasps.value == pytest.approx(0.02 / 0.35, rel=0.15)  # a part of friction


def _merged(samples: Make, count: int) -> Moments:
    """So many moments of a sample each, once they fit as the samples do."""
    data = samples(count)
    columns = np.stack([data.tangential_velocity, data.normal_force, data.friction_coefficient]).T
    one = Moments.empty(1e-6).add(*columns[0])
    single = [
        replace(one, factor=replace(one.factor, mean=row), domain=Domain((row[0], row[0]), (row[1], row[1])))
        for row in columns
    ]
    merged = single[0].merge(*single[1:])
    np.testing.assert_allclose(merged.fit().coefficients, Moments.from_samples(data).fit().coefficients, rtol=1e-11)
    return merged


def test_one_gross_outlier_does_not_move_the_plane(samples: Make) -> None:
    data = samples(50)
    clean = estimators.fit(data, method="robust")
    for value in (1e3, 1e12):
        friction = data.friction_coefficient.copy()
        friction[7] = value
        found = estimators.fit(replace(data, friction_coefficient=friction), method="robust")
        assert np.abs((found.coefficients - clean.coefficients) / clean.standard_errors).max() < 0.5
        np.testing.assert_allclose(found.scale, clean.scale, rtol=0.1)
    lost = estimators.fit(replace(data, friction_coefficient=friction))
    assert abs(lost.coefficients[0]) > 1e3  # least squares


def test_a_perfect_plane_is_found_with_no_scatter(samples: Make, truth: np.ndarray) -> None:
    model = estimators.fit(samples(60, scale=0.0), method="robust")
    np.testing.assert_allclose(model.coefficients, truth, rtol=1e-9)
    assert model.scale < 1e-12


def test_zero_residual_leaves_a_scatter_of_the_priors_size(samples: Make) -> None:
    model = estimators.fit(samples(100, scale=0.0), method="conjugate")
    np.testing.assert_allclose(model.coefficients, [0.4, 2.0, -0.8], rtol=5e-3)  # the prior's pull on 100 samples
    assert 0.0 < model.scale < 0.1 * REFERENCE.scatter


def plane(n: int, beta: np.ndarray, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    v, f_n = rng.uniform(0.0, 5e-3, n), rng.uniform(0.02, 0.1, n)
    return np.column_stack([v, f_n, beta[0] + beta[1] * v + beta[2] * f_n])


@pytest.mark.parametrize("size", [1e-8, 1.0, 1e8])
def test_a_plane_without_noise_is_found_whatever_its_size(size: float) -> None:
    beta = size * np.array([0.4, 2.0, -0.8])
    fit = solve(factorise(plane(500, beta)))
    np.testing.assert_allclose(fit.coefficients.astype(float), beta, rtol=1e-12)  # rounding of the response
    assert fit.residual_norm <= 1e-13 * size


def test_slopes_of_very_different_size_keep_their_digits() -> None:
    beta = np.array([1e-8, 1e8, 1.0])
    columns = plane(500, beta) * [1e-8, 1e8, 1.0] * [1.0, 1e-8, 1.0]
    fit = solve(factorise(columns))
    np.testing.assert_allclose(fit.coefficients[1:].astype(float), [1e16, 1.0], rtol=1e-9)  # μ is 1e5, rounded to 1e-11


def test_collinear_to_a_part_in_a_trillion_is_solved_or_said_to_be_unseen() -> None:
    """v and f_n collinear to 1e-6 … 1e-9: right to the digits that condition leaves; to 1e-12: rank 1 of 2."""
    rng = np.random.default_rng(0)
    v, other = rng.uniform(0.0, 1.0, 200), rng.uniform(0.0, 1.0, 200)
    for jitter, rtol in ((1e-6, 1e-8), (1e-9, 1e-5)):
        columns = np.column_stack([v, v + jitter * other, np.zeros(200)])
        columns[:, 2] = 1.0 + 2.0 * columns[:, 0] + 3.0 * columns[:, 1]
        fit = solve(factorise(columns))
        np.testing.assert_allclose(fit.coefficients.astype(float), [1.0, 2.0, 3.0], rtol=rtol)
        assert fit.rank == 2
    columns = np.column_stack([v, v + 1e-12 * other, 1.0 + 5.0 * v])
    fit = solve(factorise(columns))
    assert fit.rank == 1
    assert fit.inflation.min() == 1e16
    np.testing.assert_allclose(fit.coefficients[1:].astype(float).sum(), 5.0, rtol=1e-10)
