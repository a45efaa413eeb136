"""Moments: any order, any grouping, one answer, in a few hundred bytes."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import estimators
from estimators import Moments
from slipcore.samples import FrictionSamples

Make = Callable[..., FrictionSamples]


def coefficients(moments: Moments) -> np.ndarray:
    return moments.fit().coefficients


def test_a_fit_from_moments_is_the_fit_from_samples(samples: Make) -> None:
    grasps = [samples(80, seed=g, weight=np.random.default_rng(g).uniform(0.3, 1.0, 80)) for g in range(12)]
    raw = estimators.fit(grasps)
    kept = estimators.fit([Moments.from_samples(grasp) for grasp in grasps])
    np.testing.assert_allclose(kept.coefficients, raw.coefficients, rtol=1e-12)
    np.testing.assert_allclose(kept.covariance, raw.covariance, rtol=1e-10)  # from small differences
    np.testing.assert_allclose(kept.scale, raw.scale, rtol=1e-12)
    assert (kept.n, kept.domain) == (raw.n, raw.domain)
    np.testing.assert_allclose(kept.degrees_of_freedom, raw.degrees_of_freedom, rtol=1e-10)
    for likelihood in ("gaussian", "hierarchical"):
        raw, kept = (
            estimators.fit(data, method="bayes", likelihood=likelihood, seed=5).coefficients
            for data in (grasps, [Moments.from_samples(grasp) for grasp in grasps])
        )
        np.testing.assert_allclose(kept, raw, rtol=1e-7)  # the same chain, up to rounding in what it starts from


@given(order=st.permutations(range(8)), cut=st.integers(1, 7))
@settings(max_examples=30)
def test_merging_is_free_of_order_and_grouping(order: list[int], cut: int) -> None:
    rng = np.random.default_rng(0)
    rows = rng.uniform(0.0, 1.0, (8, 5, 3)) * [5e-3, 0.1, 0.4]
    parts = []
    for block in rows:
        moments = Moments.empty(1e-6)
        for v, f_n, mu in block:
            moments = moments.add(v, f_n, mu, weight=0.2 + v * 100)
        parts.append(moments)
    reference = parts[0].merge(*parts[1:])
    first = [parts[k] for k in order[:cut]]
    second = [parts[k] for k in order[cut:]]
    other = first[0].merge(*first[1:]).merge(second[0].merge(*second[1:]))
    np.testing.assert_allclose(coefficients(other), coefficients(reference), rtol=1e-12)
    np.testing.assert_allclose(other.fit().covariance, reference.fit().covariance, rtol=1e-12)
    assert other.n == 40


def test_one_by_one_equals_all_at_once(samples: Make) -> None:
    data = samples(200)
    online = Moments.empty(data.element_area)
    for row in zip(data.tangential_velocity, data.normal_force, data.friction_coefficient, strict=True):
        online = online.add(*row)
    batch = Moments.from_samples(data)
    np.testing.assert_allclose(online.factor.triangle, batch.factor.triangle, rtol=1e-11, atol=1e-15)
    assert online.domain == batch.domain


def test_forgetting_is_exponential_weighting(samples: Make) -> None:
    data = samples(100)
    faded = Moments.empty(data.element_area)
    for row in zip(data.tangential_velocity, data.normal_force, data.friction_coefficient, strict=True):
        faded = faded.forget(0.95).add(*row)
    weighted = Moments.from_samples(replace(data, weight=0.95 ** np.arange(99, -1, -1.0)))
    np.testing.assert_allclose(coefficients(faded), coefficients(weighted), rtol=1e-10)
    np.testing.assert_allclose(faded.effective_n, weighted.effective_n, rtol=1e-12)
    assert 38.0 < faded.effective_n < 39.1  # (1 + 0.95) / (1 - 0.95) = 39 after long


def test_bytes_bring_back_the_same_fit(samples: Make) -> None:
    moments = Moments.from_samples(samples(200))
    content = moments.to_bytes()
    back = Moments.from_bytes(content)
    assert len(content) <= 140 + 100 + 48 + 20 * 32  # 20 elements
    np.testing.assert_array_equal(coefficients(back), coefficients(moments))
    assert (back.n, back.domain, back.element_area) == (200, moments.domain, 1e-6)
    empty = Moments.from_bytes(Moments.empty(1e-6).to_bytes())
    assert empty.merge(back).to_bytes() == content


@pytest.mark.parametrize(
    "spoil", [lambda c: c[:-1], lambda c: b"XXXX" + c[4:], lambda c: c[:12] + b"\xff" * 8 + c[20:]]
)
def test_other_bytes_are_refused(samples: Make, spoil: Callable[[bytes], bytes]) -> None:
    with pytest.raises(estimators.InvalidSamples, match="moments"):
        Moments.from_bytes(spoil(Moments.from_samples(samples(20)).to_bytes()))


def test_moments_of_nothing_are_neutral_and_not_fitted(samples: Make) -> None:
    none = np.zeros(5)
    nothing = Moments.from_samples(samples(5, weight=none))
    some = Moments.from_samples(samples(50))
    assert nothing.effective_n == 0.0
    np.testing.assert_array_equal(coefficients(nothing.merge(some, nothing)), coefficients(some))
    with pytest.raises(estimators.TooFewSamples):
        nothing.fit()


def test_moments_of_other_element_areas_merge_as_their_samples_would(samples: Make) -> None:
    first, second = samples(60), samples(80, seed=1)
    other = second.at_element_area(3.0 * second.element_area)
    merged = Moments.from_samples(other).merge(Moments.from_samples(first))
    together = Moments.from_samples(FrictionSamples.concatenate([first, other]))
    assert merged.element_area == first.element_area
    np.testing.assert_allclose(merged.fit().coefficients, together.fit().coefficients, rtol=1e-11)  # rounding of QR
    np.testing.assert_allclose(merged.domain.normal_force, together.domain.normal_force, rtol=1e-15)


def test_what_moments_cannot_do_is_refused_by_name(samples: Make) -> None:
    moments = Moments.from_samples(samples(50))
    with pytest.raises(estimators.InvalidSamples, match="mixture"):
        estimators.fit([moments, samples(50)])
    for bad in ((np.nan, 0.05, 0.4), (1e-3, -0.05, 0.4), (1e-3, 0.05, np.inf)):
        with pytest.raises(estimators.InvalidSamples):
            moments.add(*bad)
    with pytest.raises(estimators.InvalidSamples, match="weight"):
        moments.add(1e-3, 0.05, 0.4, weight=0.0)
    for factor in (0.0, 1.1, np.nan):
        with pytest.raises(estimators.InvalidSamples, match="factor"):
            moments.forget(factor)
