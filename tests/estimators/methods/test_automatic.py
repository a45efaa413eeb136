"""The recommended method: what it takes, why, and what it says where least squares disagrees."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import estimators
from estimators.linear.fit_data import gather
from estimators.methods import ols
from estimators.methods.automatic import choose, compared, distances
from slipcore.samples import FrictionSamples

Make = Callable[..., FrictionSamples]


def clean(samples: Make, seed: int, n: int = 400) -> FrictionSamples:
    return samples(n, seed=seed)


def correlated(samples: Make, seed: int, n: int = 400) -> FrictionSamples:
    """Errors shared within an element."""
    data, shared = samples(n, seed=seed), np.random.default_rng([seed, 1]).standard_normal(20)
    return replace(data, friction_coefficient=data.friction_coefficient + 0.015 * shared[data.element])


def heteroscedastic(samples: Make, seed: int, n: int = 400) -> FrictionSamples:
    rng = np.random.default_rng([seed, 2])
    f_n = rng.uniform(0.02, 0.1, n)
    return samples(n, seed=seed, normal_force=f_n, noise=rng.standard_normal(n) * f_n / 0.06)


def outliers(samples: Make, seed: int, n: int = 400) -> FrictionSamples:
    rng, data = np.random.default_rng([seed, 3]), samples(n, seed=seed)
    low = rng.uniform(0.0, 0.3, n)
    return replace(data, friction_coefficient=np.where(rng.random(n) < 0.08, low, data.friction_coefficient))


@pytest.mark.parametrize(("spoil", "left_out"), [(clean, 0.0), (correlated, 0.0), (outliers, 0.075)])
def test_outliers_and_nothing_else_are_left_out(
    samples: Make, spoil: Callable[..., FrictionSamples], left_out: float
) -> None:
    choices = [choose(gather(spoil(samples, seed, n=3000))) for seed in range(10)]
    parts = sorted(1.0 - choice.data.n / 3000 for choice in choices)
    assert parts[1] >= left_out - 0.02
    assert parts[8] <= left_out + 0.02


def test_outliers_in_few_grasps_leave_the_scatter_between_them_its_say(samples: Make) -> None:
    """Errors with heavy tails: within one grasp a robust fit would be as exact as its own samples are."""
    rng = np.random.default_rng(0)
    heavy = samples(800, noise=rng.standard_t(2.5, 800))
    model = estimators.fit(heavy, method="auto")
    assert "without the" in str(model.diagnostics["chosen_because"])
    assert model.scales is not None
    within = estimators.fit(heavy, method="robust").diagnostics["standard_error_cluster_beta0"]
    assert model.standard_errors[0] > 5.0 * float(within)


@pytest.mark.parametrize("share", [-0.4, 0.2, 0.5])
def test_a_grasp_that_differs_from_the_other_is_no_outlier(samples: Make, share: float) -> None:
    """Of few samples a place, with errors far below what the two differ by."""
    rng, seen = np.random.default_rng(3), []
    for count, part in ((70, 1.0), (90, 1.0 + share)):
        each = samples(count, seed=count, noise=np.zeros(count))
        errors = 0.002 * rng.standard_normal(count)
        seen.append(replace(each, friction_coefficient=each.friction_coefficient * part + errors))
    model = estimators.fit(seen, method="auto")
    assert model.n > 150
    assert model.scales is not None
    assert model.scales.between_grasps.value > 0.2 * abs(share)


def test_what_lies_off_by_less_than_a_grip_notices_is_kept(samples: Make) -> None:
    """Without noise whatever is off a little, here by 0.5 % of friction, lies many of the others' deviations away."""
    noise = np.where(np.random.default_rng(0).random(800) < 0.1, -1.0, 1e-3)
    for size, kept in ((0.002, 800), (0.02, int((noise > 0.0).sum()))):
        assert choose(gather(samples(800, scale=size, noise=noise))).data.n == kept


def test_places_that_differ_are_no_outliers(samples: Make) -> None:
    """A twentieth of the places lies ten times farther off than a sample's scatter: that is what places do."""
    data = samples(3000, elements=100)
    friction = data.friction_coefficient + 0.2 * (data.element < 5)
    data = gather(replace(data, friction_coefficient=friction))
    assert choose(data).data is data


def test_places_of_few_samples_are_not_taken_for_outliers_beside_those_of_many(samples: Make) -> None:
    """Places that differ by three times the scatter within: those that few samples tell of cannot be corrected."""
    data, rng = samples(2000, elements=60), np.random.default_rng(0)
    element = np.where(np.arange(2000) < 300, 60 + np.arange(2000) // 5, data.element)
    friction = data.friction_coefficient + 0.06 * rng.standard_normal(500)[element]
    data = gather(replace(data, friction_coefficient=friction, element=element))
    assert choose(data).data is data


def test_normal_errors_show_no_outliers_however_few_samples_a_place_has(samples: Make) -> None:
    for elements in (8, 40, 55, 200):
        grasps = [gather([samples(500, seed=10 * k + g, elements=elements) for g in range(3)]) for k in range(4)]
        parts = [np.mean(distances(data, data.raw("a test")) > 2.535) for data in grasps]
        assert 0.006 < np.mean(parts) < 0.018, elements


def test_the_reason_and_the_check_are_told(samples: Make) -> None:
    grasps = [samples(60, seed=g) for g in range(6)]
    model = estimators.fit(grasps, method="auto")
    assert model.diagnostics["chosen_because"] == "friction may scatter between grasps, between places and within them"
    assert model.diagnostics["check"] == "least squares with cluster-robust errors agrees"
    moments = [estimators.Moments.from_samples(grasp) for grasp in grasps]
    np.testing.assert_allclose(estimators.fit(moments, method="auto").coefficients, model.coefficients, rtol=1e-9)


def test_disagreement_with_least_squares_is_told(samples: Make) -> None:
    data = gather([samples(60, seed=g) for g in range(4)])
    model = estimators.fit([samples(60, seed=g) for g in range(4)], method="hierarchical")
    moved = replace(model, coefficients=model.coefficients + np.array([0.0, 0.0, 5.0]))
    assert "disagrees by more than both intervals allow on beta2" in compared(moved, data)
    assert compared(model, data).endswith("agrees")


@pytest.mark.parametrize("fits", [8, pytest.param(20, marks=pytest.mark.long)])
@pytest.mark.parametrize("spoil", [clean, correlated, heteroscedastic, outliers])
def test_intervals_cover_whatever_the_fault(
    samples: Make, truth: np.ndarray, spoil: Callable[..., FrictionSamples], fits: int
) -> None:
    inside = np.zeros(3)
    for seed in range(fits):
        low, high = estimators.fit(spoil(samples, seed), method="auto").interval(0.95).T
        inside += (low <= truth) & (truth <= high)
    assert (inside >= stats.binom(fits, 0.93).ppf(1e-3)).all()


def test_a_grasp_whose_samples_all_lie_off_counts_as_no_cluster(samples: Make) -> None:
    """Errors of one grasp alone are not those of two that agree."""
    data = gather([samples(80, seed=1), samples(80, seed=2)])
    assert data.observations is not None
    for left_out in (0, 1):
        kept = data.kept(data.observations.grasp != left_out)
        assert kept.clusters == 1
        assert "standard_error_cluster_beta0" not in ols.fit(kept).diagnostics
