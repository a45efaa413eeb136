"""Samples whose velocity is relative to what seems to stick tell no β₁, and β₀ and β₂ do not bear its error."""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from benchmarks.end_to_end.unknown_motion import Finding, findings
from estimators import FrictionModel, Moments, fit, recognise
from estimators.defaults import PRIOR
from estimators.errors import InvalidSamples
from estimators.linear.unknown_velocity import offset_variance
from slipcore.samples import FrictionSamples

Make = Callable[..., FrictionSamples]
QUICK = ("ols", "robust", "conjugate", "hierarchical", "auto")
SLOPES = (-8.0, 0.0, 8.0)
"""β₁, s/m: about a standard deviation of what is expected of friction of 0.4, to either side."""
AT = np.array([1.0, 0.0, 0.06])
"""(1, v, f_n) of a grasp that holds."""


def grasp(seed: int, slope: float, speed: float, count: int = 300) -> tuple[FrictionSamples, FrictionSamples]:
    """One that slides at about ``speed`` m/s, as seen with the object's motion and without.

    Friction is 0.4 + ``slope`` v − 0.8 f_n, scattered by 3 % between grasps and by 0.02 between places. What seems to
    stick goes along: of the velocity hundredths are seen, and more where the normal force is less.
    """
    rng = np.random.default_rng([seed, round(1e7 * speed)])
    element = rng.integers(0, 30, count)
    f_n = rng.uniform(0.02, 0.1, 30)[element] * rng.uniform(0.9, 1.1, count)
    v = speed * rng.uniform(0.8, 1.2, count)
    law = (1.0 + 0.03 * rng.standard_normal()) * (0.4 + slope * v - 0.8 * f_n)
    mu = law + 0.02 * rng.standard_normal(30)[element] + 0.02 * rng.standard_normal(count)
    time, ones = np.arange(count) * 0.01, np.ones(count)
    seen = FrictionSamples(mu, v, f_n, mu * f_n, time, element, ones, 1e-6)
    relative = speed * (0.02 + 0.1 * (1.0 - f_n / 0.12)) * rng.uniform(0.8, 1.2, count)
    return seen, replace(seen, tangential_velocity=relative, velocity_is_relative=np.ones(count, bool))


def grasps(seed: int, slope: float, known: int = 0, count: int = 6) -> list[FrictionSamples]:
    """Of speeds from 0.5 to 3 mm/s; the motion of the first ``known`` is recorded."""
    speeds = np.random.default_rng(seed).permutation(np.geomspace(5e-4, 3e-3, count))
    pairs = [grasp(seed, slope, float(speed)) for speed in speeds]
    return [posed if k < known else unposed for k, (posed, unposed) in enumerate(pairs)]


def covered(method: str, known: int, seeds: int) -> tuple[np.ndarray, int]:
    """How many 95 % intervals of β₀, β₁, β₂ and of friction at rest hold the truth, [4], and of how many."""
    inside = np.zeros(4)
    for slope in SLOPES:
        for seed in range(seeds):
            inside += held(fit(grasps(seed, slope, known), method=method), slope)
    return inside, len(SLOPES) * seeds


def held(model: FrictionModel, slope: float) -> np.ndarray:
    """Whether the 95 % intervals of β₀, β₁, β₂ and of friction at rest hold the truth, [4]."""
    low, high = model.interval(0.95).T
    truth = np.array([0.4, slope, -0.8])
    half = stats.t.ppf(0.975, model.degrees_of_freedom) * np.sqrt(AT @ model.covariance @ AT)
    at_rest = abs(float(AT @ (model.coefficients - truth))) <= half
    return np.array([*((low <= truth) & (truth <= high)), at_rest])


@pytest.mark.parametrize("method", ["hierarchical", "ols"])
@pytest.mark.parametrize("known", [0, 3])
@pytest.mark.parametrize("seeds", [5, pytest.param(12, marks=pytest.mark.long)])
def test_intervals_hold_the_truth_whatever_velocity_does(method: str, known: int, seeds: int) -> None:
    inside, fits = covered(method, known, seeds)
    assert (inside >= stats.binom(fits, 0.95).ppf(1e-3)).all(), inside / fits


@pytest.mark.long
@pytest.mark.parametrize("method", ["auto", "bayes"])
@pytest.mark.parametrize("known", [0, 3])
def test_intervals_hold_the_truth_of_materials_that_differ_in_92_to_98_percent(method: str, known: int) -> None:
    slopes = 7.0 * np.random.default_rng(1).standard_normal(400)
    models = [fit(grasps(1000 + k, float(slope), known), method=method) for k, slope in enumerate(slopes)]
    told = np.mean([held(model, float(slope)) for model, slope in zip(models, slopes, strict=True)], axis=0)
    assert (told >= 0.92 - 0.027).all(), told  # two standard errors of 1.4 %
    assert (told[[0, 3]] <= 0.98 + 0.014).all(), told  # β₂ allows for a tilt that these data lack


@pytest.mark.long
def test_intervals_hold_the_truth_of_detected_grasps_of_the_reduced_world() -> None:
    found = list(findings(range(2000, 2060), ("auto",)))
    unknown = [each for each in found if each.condition == "unknown"]
    assert not any(each.identifiable[1] for each in unknown)
    for k in (0, 2, 3):
        assert _inside(unknown, k) >= stats.binom(len(unknown), 0.92).ppf(1e-3)


def _inside(found: Sequence[Finding], k: int) -> int:
    return sum(abs(each.estimate[k] - each.truth[k]) <= each.half_width[k] for each in found)


@pytest.mark.parametrize("method", QUICK)
def test_no_relative_velocity_tells_of_its_coefficient(method: str) -> None:
    unposed = grasps(0, 8.0)
    model = fit(unposed, method=method)
    assert not model.identifiable[1]
    assert model.coefficients[1] == pytest.approx(0.0, abs=1e-6)
    assert model.domain.tangential_velocity == (0.0, 0.0)
    assert "motion is unknown" in str(model.diagnostics["unknown_velocity"])
    faster = [replace(each, tangential_velocity=7.0 * each.tangential_velocity) for each in unposed]
    np.testing.assert_array_equal(fit(faster, method=method).coefficients, model.coefficients)


def test_where_all_motions_are_known_nothing_changes() -> None:
    posed = grasps(0, 8.0, known=6)
    model = fit(posed, method="hierarchical")
    assert model.identifiable[1]
    assert "unknown_velocity" not in model.diagnostics


@pytest.mark.parametrize("method", ["hierarchical", "conjugate", "ols"])
def test_only_grasps_of_known_motion_tell_of_velocity(method: str) -> None:
    posed, mixed = grasps(1, 8.0, known=6)[:3], grasps(1, 8.0, known=3)
    alone, together = fit(posed, method=method), fit(mixed, method=method)
    assert "to 50% of the samples" in str(together.diagnostics["unknown_velocity"])
    assert together.domain.tangential_velocity == alone.domain.tangential_velocity
    assert together.domain.normal_force[0] <= alone.domain.normal_force[0]


def test_grasps_of_unknown_motion_add_to_what_is_known_of_the_force_s_slope() -> None:
    """On average over eight materials: how much grasps differ, which widens all, comes out otherwise with each."""
    ratio = [
        fit(grasps(seed, 8.0, known=3), method="hierarchical").standard_errors[2]
        / fit(grasps(seed, 8.0, known=6)[:3], method="hierarchical").standard_errors[2]
        for seed in range(8)
    ]
    assert np.mean(ratio) < 0.95


def test_what_grasps_of_unknown_motion_differ_by_does_not_make_velocity_known() -> None:
    """All known velocities are equal: only the others' offset, of which nothing is known, would tell of velocity."""
    mixed = [
        replace(each, tangential_velocity=np.full(len(each), 4e-3)) if not each.velocity_is_relative.any() else each
        for each in grasps(2, 0.0, known=12, count=24)[:12] + grasps(2, 0.0, known=0, count=24)[12:]
    ]
    for method in ("ols", "conjugate", "hierarchical"):
        assert not fit(mixed, method=method).identifiable[1]


def test_one_grasp_of_equal_velocities_answers_at_rest() -> None:
    (unposed,) = grasps(3, 8.0, count=1)
    still = replace(unposed, tangential_velocity=np.full(len(unposed), 1e-4))
    for method in QUICK:
        model = fit(still, method=method)
        assert not model.identifiable[1]
        assert np.isfinite(model.covariance).all()
        assert 0.3 < float(model.predict(0.0, 0.06)) < 0.4


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_the_unit_of_force_does_not_matter(factor: float) -> None:
    mixed = grasps(4, 8.0, known=2)
    other = [each.at_element_area(factor * each.element_area) for each in mixed]
    units = np.array([1.0, 1.0, 1.0 / factor])
    for method in ("ols", "hierarchical"):
        model, same = fit(mixed, method=method), fit(other, method=method)
        np.testing.assert_allclose(same.coefficients, model.coefficients * units, rtol=1e-6)
        np.testing.assert_allclose(same.standard_errors, model.standard_errors * units, rtol=1e-6)


def test_moments_of_both_kinds_merge_in_any_order_and_survive_their_bytes() -> None:
    mixed = grasps(5, 8.0, known=2, count=4)
    parts = [Moments.from_bytes(Moments.from_samples(each).to_bytes()) for each in mixed]
    expected = fit(mixed, method="hierarchical")
    for order in itertools.permutations(range(4)):
        first, *others = (parts[k] for k in order)
        whole = first.merge(*others)
        assert whole.domain.tangential_velocity == expected.domain.tangential_velocity
        model = fit([Moments.from_bytes(whole.to_bytes())], method="hierarchical")
        np.testing.assert_allclose(model.coefficients, expected.coefficients, rtol=1e-9)
        np.testing.assert_allclose(model.covariance, expected.covariance, rtol=1e-6)
        assert model.diagnostics["unknown_velocity"] == expected.diagnostics["unknown_velocity"]


def test_least_squares_of_moments_allows_for_unknown_velocities_as_that_of_samples() -> None:
    mixed = grasps(6, 8.0, known=3)
    parts = [Moments.from_samples(each) for each in mixed]
    of_samples, of_moments = fit(mixed, method="ols"), fit(parts, method="ols")
    np.testing.assert_allclose(of_moments.coefficients, of_samples.coefficients, rtol=1e-9)
    np.testing.assert_allclose(of_moments.covariance, of_samples.covariance, rtol=1e-6)


def test_moments_without_places_keep_what_is_unknown() -> None:
    (unposed,) = grasps(7, 8.0, count=1)
    moments = Moments.from_samples(unposed, places=False)
    faded = Moments.from_bytes(moments.to_bytes()).forget(0.5)
    assert faded.unknown_weight == pytest.approx(0.5 * len(unposed))
    assert faded.unknown_force == pytest.approx(0.5 * unposed.normal_force.sum())
    assert not faded.fit().identifiable[1]
    for cut in (4 + 17 * 8 + 8, len(moments.to_bytes()) - 1):
        with pytest.raises(InvalidSamples, match="moments is cut short"):
            Moments.from_bytes(moments.to_bytes()[:cut])


def test_the_offset_goes_by_what_is_known_of_velocity() -> None:
    """Nothing: a tenth of friction over 5 mm/s, at 1 mm/s; all: the coefficient times that speed."""
    assert np.sqrt(offset_variance(0.4, 0.0, 1e12)) == pytest.approx(0.02 * 0.4)
    assert np.sqrt(offset_variance(0.4, 20.0, 0.0)) == pytest.approx(20.0 * PRIOR.unknown_velocity)
    assert offset_variance(0.0, 3.0, 1.0) == 0.0


def test_draws_of_a_chain_spread_as_far_as_its_errors_tell() -> None:
    model = fit(grasps(8, 8.0), method="bayes", likelihood="gaussian", seconds=5.0)
    assert model.draws is not None
    spread = model.draws[:, 0].std()
    assert spread == pytest.approx(model.standard_errors[0], rel=0.1)
    assert spread > 0.015 * 0.35  # of which independent errors alone make a tenth


def test_a_grasp_of_unknown_motion_is_recognised() -> None:
    models = {
        name: fit([grasp(k, slope, 1e-3 * (k + 1))[0] for k in range(4)], method="hierarchical")
        for name, slope in (("smooth", 8.0), ("rough", 120.0))
    }
    (unposed,) = grasps(9, 8.0, count=1)
    assert recognise(unposed, models)["smooth"] > 0.5
