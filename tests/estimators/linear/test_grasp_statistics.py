"""Statistics of a grasp by place: compact, and free of order."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import estimators
from estimators import Moments
from estimators.defaults import CLUSTERS
from estimators.linear import grasp_statistics
from estimators.linear.grasp_statistics import Columns, GraspStatistics
from slipcore.samples import FrictionSamples

Make = Callable[..., FrictionSamples]


def columns(n: int = 600, places: int = 12, seed: int = 0) -> Columns:
    rng = np.random.default_rng(seed)
    place = np.concatenate([np.arange(places), rng.integers(0, places, n - places)])
    v, f_n = rng.uniform(0.0, 5e-3, n), rng.uniform(0.05, 0.2, n)
    mu = 0.4 + 2.0 * v - 0.8 * f_n + 0.02 * rng.standard_normal(n)
    moments = np.zeros(n)  # all at once: errors of different times might go together by chance
    return Columns(np.stack([v, f_n, mu]).T, rng.uniform(0.2, 1.0, n), place, moments)


def whole(grasp: GraspStatistics) -> np.ndarray:
    """All sums of squares and products of (1, v, f_n, μ), [4, 4]."""
    means = np.column_stack([np.ones(len(grasp.mean)), grasp.mean])
    total = np.einsum("g,gi,gj->ij", grasp.count * grasp.weight, means, means)
    total[1:, 1:] += np.einsum("g,gki,gkj->ij", grasp.weight, grasp.spread, grasp.spread)
    total[1:, 1:] += grasp.within.T @ grasp.within
    return total


def test_the_parts_add_up_to_all_samples() -> None:
    values, weight, *_ = data = columns()
    rows = np.column_stack([np.ones(len(values)), values])
    np.testing.assert_allclose(
        whole(GraspStatistics.from_columns(data)), (rows * weight[:, None]).T @ rows, rtol=1e-12, atol=1e-12
    )


def test_places_beyond_the_limit_are_pooled_without_losing_a_sum() -> None:
    data = columns(20_000, places=4096)
    grasp = GraspStatistics.from_columns(data)
    rows = np.column_stack([np.ones(len(data.values)), data.values])
    assert len(grasp.count) <= CLUSTERS.most_groups
    assert grasp.count.sum() == 4096
    np.testing.assert_allclose(whole(grasp), (rows * data.weight[:, None]).T @ rows, rtol=1e-11, atol=1e-11)


def test_pooling_places_hardly_moves_the_posterior(samples: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    grasps = [samples(2000, seed=g, elements=100) for g in range(4)]
    exact = estimators.fit(grasps, method="hierarchical")
    monkeypatch.setattr(grasp_statistics, "CLUSTERS", replace(CLUSTERS, most_places=10))
    pooled = estimators.fit(grasps, method="hierarchical")
    away = np.abs(pooled.coefficients - exact.coefficients) / exact.standard_errors
    assert 0.0 < away.max() < 0.01


@pytest.mark.parametrize("places", [1, 480, 4096])
def test_bytes_bring_back_all_and_stay_below_16_kb(places: int) -> None:
    grasp = GraspStatistics.from_columns(columns(8192, places))
    content = grasp.to_bytes()
    back, rest = GraspStatistics.from_bytes(content + b"more")
    assert len(content) <= 16_000
    assert rest == b"more"
    for name in ("count", "weight", "mean", "spread", "within", "total_weight", "weight_square"):
        np.testing.assert_array_equal(getattr(back, name), getattr(grasp, name), err_msg=name)
    for grasps in (1, 2, 5):
        np.testing.assert_array_equal(back.among(grasps).within, grasp.among(grasps).within)


@pytest.mark.parametrize("spoil", [lambda c: c[:50], lambda c: c[:-1], lambda c: c[:-8] + b"\xff" * 8])
def test_other_bytes_are_refused(spoil: Callable[[bytes], bytes]) -> None:
    with pytest.raises(estimators.InvalidSamples, match="moments of a grasp"):
        GraspStatistics.from_bytes(spoil(GraspStatistics.from_columns(columns()).to_bytes()))


def test_moments_of_the_version_before_are_still_read(samples: Make) -> None:
    moments = Moments.from_samples(samples(80), places=False)
    content = moments.to_bytes()
    assert (content[:4], len(content)) == (b"SMo1", 140)
    back = Moments.from_bytes(content)
    assert back.grasps == ()
    others = [Moments.from_samples(samples(80, seed=g)) for g in (1, 2)]
    assert estimators.fit([back, *others], method="hierarchical").n == 240


def test_moments_keep_places_through_bytes_merging_and_another_area(samples: Make) -> None:
    grasps = [samples(100, seed=g) for g in range(3)]
    first, second, third = (Moments.from_bytes(Moments.from_samples(grasp).to_bytes()) for grasp in grasps)
    from_samples = estimators.fit(grasps, method="hierarchical")
    for kept in ([third, first, second], third.merge(first.merge(second)), [first.merge(third), second]):
        model = estimators.fit(kept, method="hierarchical")
        np.testing.assert_allclose(model.coefficients, from_samples.coefficients, rtol=1e-9)
        np.testing.assert_allclose(model.covariance, from_samples.covariance, rtol=1e-7)
    halved = first.at_element_area(0.5 * first.element_area)
    np.testing.assert_allclose(halved.grasps[0].mean[:, 1], 0.5 * first.grasps[0].mean[:, 1], rtol=1e-15)
    assert first.add(1e-3, 0.05, 0.4).grasps == ()  # a sample whose place nobody told


def test_the_noise_that_samples_carry_is_taken_out_of_every_fit(samples: Make) -> None:
    """Also where grasps of other areas are brought to one: the noise of a force scales as the force does."""
    rng, grasps = np.random.default_rng(3), []
    for seed in range(6):
        data = samples(1500, seed=seed, normal_force=0.06 + 0.01 * rng.standard_normal(1500))
        noisy = replace(
            data, normal_force=data.normal_force + 0.01 * rng.standard_normal(1500), normal_force_noise=0.01
        )
        grasps.append(noisy.at_element_area(2e-6) if seed % 2 else noisy)
    told = estimators.fit(grasps, method="hierarchical")
    unaware = estimators.fit([replace(part, normal_force_noise=0.0) for part in grasps], method="hierarchical")
    kept = estimators.fit([Moments.from_samples(part) for part in grasps], method="hierarchical")
    assert abs(told.coefficients[2] + 0.8) < 4.0 * told.standard_errors[2]
    assert abs(unaware.coefficients[2] + 0.8) > 6.0 * unaware.standard_errors[2]  # half of the slope
    np.testing.assert_allclose(kept.coefficients, told.coefficients, rtol=1e-7)


def test_what_one_place_says_by_itself_is_kept_and_left_out_beside_another_grasp(samples: Make) -> None:
    along = np.linspace(0.0, 1.0, 400)  # what errors that last look like must last, too
    record = samples(
        noise=np.cumsum(np.random.default_rng(0).standard_normal(400)),
        scale=0.002,
        tangential_velocity=5e-3 * along,
        normal_force=0.06 + 0.04 * np.sin(7.0 * along),
    )
    record = replace(record, element=np.zeros(400, dtype=np.int64), time=np.arange(400) / 60.0)
    moments = Moments.from_samples(record)
    grasp = moments.grasps[0]
    assert grasp.alone is not None
    assert np.linalg.norm(grasp.alone[:2, :2]) < 0.5 * np.linalg.norm(grasp.within[:2, :2])
    doubled = moments.at_element_area(2.0 * moments.element_area).grasps[0]
    assert doubled.alone is not None
    np.testing.assert_allclose(doubled.alone, grasp.alone * [1.0, 2.0, 1.0], rtol=1e-12)
    before = replace(moments, grasps=(replace(grasp, alone=None),))  # as an older version stored it
    for others, alike in (([], False), ([Moments.from_samples(samples(400, seed=1))], True)):
        ours, older = (estimators.fit([each, *others], method="hierarchical") for each in (moments, before))
        assert np.allclose(ours.covariance, older.covariance, rtol=1e-12) == alike
