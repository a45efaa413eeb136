"""What the estimators refuse, and what they take clusters and weights to be."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import estimators
from estimators.defaults import CLUSTERS
from estimators.linear.observations import codes_of, observe
from slipcore.samples import FrictionSamples

Make = Callable[..., FrictionSamples]


def take(samples: FrictionSamples, rows: object) -> FrictionSamples:
    names = FrictionSamples.arrays()
    return FrictionSamples(**{name: getattr(samples, name)[rows] for name in names}, element_area=samples.element_area)


@pytest.mark.parametrize("method", ["ols", "bayes"])
@pytest.mark.parametrize("n", [0, 1, 2, 3])
def test_fewer_than_four_samples_are_refused_by_name(samples: Make, method: str, n: int) -> None:
    with pytest.raises(estimators.TooFewSamples) as caught:
        estimators.fit(take(samples(10), slice(n)), method=method)
    assert caught.value.allowed == "at least 4"
    assert ("no slip gave one" in str(caught.value)) == (n == 0)


def test_an_empty_sequence_and_only_empty_grasps_are_refused(samples: Make) -> None:
    empty = take(samples(10), slice(0))
    for grasps in ([], [empty], [empty, empty]):
        with pytest.raises(estimators.TooFewSamples):
            estimators.fit(grasps)


def test_an_empty_grasp_among_others_changes_nothing(samples: Make) -> None:
    one, two = samples(100, seed=1), samples(100, seed=2)
    with_empty = estimators.fit([one, take(one, slice(0)), two])
    without = estimators.fit([one, two])
    np.testing.assert_array_equal(with_empty.covariance, without.covariance)
    assert with_empty.degrees_of_freedom == without.degrees_of_freedom < 1.01


def test_weights_of_zero_are_left_out_and_all_zero_is_refused(samples: Make) -> None:
    whole = samples(200)
    weight = np.where(np.arange(200) < 120, 1.0, 0.0)
    kept = estimators.fit(replace(whole, weight=weight))
    np.testing.assert_array_equal(kept.coefficients, estimators.fit(take(whole, slice(120))).coefficients)
    assert kept.n == 120
    with pytest.raises(estimators.InvalidSamples, match="weight is 0 for every sample"):
        estimators.fit(replace(whole, weight=np.zeros(200)))


def test_weights_that_make_samples_worth_no_more_than_three_are_refused(samples: Make) -> None:
    few = replace(take(samples(10), slice(4)), weight=np.array([1.0, 1.0, 0.5, 0.01]))
    with pytest.raises(estimators.TooFewSamples, match=r"worth 2\.8 by their weights") as caught:
        estimators.fit(few)
    assert caught.value.allowed == "more than 3"


def test_weights_matter_only_relative_to_each_other(samples: Make) -> None:
    weight = np.random.default_rng(3).uniform(0.2, 1.0, 200)
    one, tiny = (observe(samples(200, weight=scale * weight)) for scale in (1.0, 1e-12))
    np.testing.assert_allclose(one.weight, tiny.weight, rtol=1e-12)  # rounding of the products
    np.testing.assert_allclose(one.effective_n, weight.sum() ** 2 / (weight @ weight), rtol=1e-12)


def test_sensors_of_different_element_area_are_pooled_at_the_same_pressure(samples: Make) -> None:
    first, second = samples(200), samples(200, seed=1)
    alike = estimators.fit([first, second])
    mixed = estimators.fit([first, second.at_element_area(2.0 * second.element_area)])
    assert mixed.element_area == first.element_area
    np.testing.assert_array_equal(mixed.coefficients, alike.coefficients)  # a factor of 2 is exact


@pytest.mark.parametrize("area", [0.0, -1e-6, np.nan, np.inf])
def test_an_element_area_that_is_none_is_refused(samples: Make, area: float) -> None:
    with pytest.raises(estimators.InvalidSamples, match="element_area"):
        estimators.fit([samples(20), replace(samples(20), element_area=area)])


def test_clusters_are_grasps_else_elements_else_stretches_of_time(samples: Make) -> None:
    assert observe([samples(50), samples(50)]).cluster_kind == "grasp"
    assert observe(samples(50)).cluster_kind == "element"
    record = observe(samples(50, elements=1))
    assert (record.cluster_kind, record.clusters) == ("time block", CLUSTERS.time_blocks)
    assert (np.diff(record.cluster) >= 0).all()


@pytest.mark.parametrize(("option", "value"), [("method", "magic"), ("accuracy", 0.0), ("seconds", -1.0)])
def test_an_option_out_of_range_is_refused(samples: Make, option: str, value: object) -> None:
    with pytest.raises(estimators.InvalidSamples, match=option):
        estimators.fit(samples(50), **{option: value})


def test_merged_moments_of_several_grasps_are_not_those_of_one(samples: Make) -> None:
    one, other = (estimators.Moments.from_samples(samples(50)) for _ in range(2))
    kinds = [estimators.fit(data, "conjugate").diagnostics["cluster_kind"] for data in (one, one.merge(other))]
    assert kinds == ["none", "merged"]


@pytest.mark.parametrize(
    ("labels", "codes"),
    [
        ([7, 5, 7, 6], [2, 0, 2, 1]),
        ([1000, 5, 1000, 77], [2, 0, 2, 1]),
        ([-3, 10**12, -3], [0, 1, 0]),
        ([4], [0]),
    ],
)
def test_labels_are_numbered_in_their_order_however_far_apart_they_are(labels: list[int], codes: list[int]) -> None:
    assert codes_of(np.array(labels)).tolist() == codes
