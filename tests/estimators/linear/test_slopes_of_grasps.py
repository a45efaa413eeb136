"""Slopes that grasps show: alike but for the level of each, or apart by more than their samples tell."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.estimators.lasting_errors import LAW, SAMPLES, found, grasp
from estimators.linear.fit_data import gather
from estimators.linear.grasp_statistics import GraspStatistics
from estimators.linear.slopes_of_grasps import _factors, with_slopes_that_differ
from slipcore.samples import FrictionSamples


def statistics(grasps: list[FrictionSamples]) -> list[GraspStatistics]:
    return list(gather(grasps).grasp_statistics())


def squares(grasps: list[GraspStatistics]) -> np.ndarray:
    return np.stack([each.within.T @ each.within for each in grasps])


def divided_by(grasps: list[GraspStatistics], law: np.ndarray = LAW) -> float:
    """How many times less of slopes samples say."""
    return float((squares(grasps) / squares(with_slopes_that_differ(grasps, law)))[0, 0, 0])


@pytest.mark.parametrize("places", [1, 2, 3])
def test_errors_that_last_as_long_as_a_grasp_make_neither_scatter_nor_certain_slopes(places: int) -> None:
    """Of twelve grasps that scatter by 3 %, as a force sensor or a few elements record them."""
    scatter, held = zip(*(found(seed, places) for seed in range(700, 712)), strict=True)
    assert 0.015 < min(scatter) <= max(scatter) < 0.06
    assert np.mean(held) > 0.7  # 0.3 to 0.55, were each grasp's slopes as well known as its samples say


def test_samples_say_so_many_times_less_as_slopes_differ_more() -> None:
    """Slopes told by two rows each, along which grasps differ by ± 3 and samples by 1."""
    one = statistics([grasp(np.random.default_rng(k), 4, 0.0, 0.0) for k in range(2)])
    rows, left = np.array([[1.0, 0.0], [0.0, 100.0]]), np.sqrt(2 * (4 * SAMPLES - 4 - 2))
    average = np.array([2e-3, 5.0])
    made = []
    for sign in (-1.0, 1.0):
        told = rows @ LAW[1:] + sign * 3.0
        within = np.vstack([np.column_stack([rows, told]), [0.0, 0.0, left / np.sqrt(2.0)]])
        mean = np.tile(np.append(average, LAW @ np.append(1.0, average)), (4, 1))
        made.append(replace(one[0], mean=mean, within=within))
    less = with_slopes_that_differ(made, LAW)
    times = (4 * 9.0 / 2) / (left**2 / (8 * SAMPLES - 8 - 4))
    for before, after in zip(squares(made), squares(less), strict=True):
        np.testing.assert_allclose(after[:2], before[:2] / times, rtol=1e-12)
        told = before[:2, 2] @ np.linalg.solve(before[:2, :2], before[:2, 2])
        np.testing.assert_allclose(after[2, 2], before[2, 2] - told + told / times, rtol=1e-12)
    assert times > 10.0


def test_slopes_of_independent_errors_are_as_well_known_as_samples_say() -> None:
    times = [
        divided_by(statistics([grasp(rng, 3, 0.0, 0.0) for _ in range(6)]))
        for rng in map(np.random.default_rng, range(60))
    ]
    assert np.mean(times) < 1.3  # the mean of the larger of 1 and χ²/10 on 10 degrees of freedom: 1.18
    assert min(times) == pytest.approx(1.0, rel=1e-12)


def test_slopes_that_go_with_the_level_of_their_grasp_do_not_differ() -> None:
    rng = np.random.default_rng(0)
    grasps = statistics([grasp(rng, 3, 0.0, 0.1, error=3e-5) for _ in range(12)])
    assert divided_by(grasps) < 1.6  # of slopes known to a hundredth of what they differ by
    assert divided_by([replace(each, mean=each.mean * [1.0, 1.0, 0.0] + [0.0, 0.0, 0.48]) for each in grasps]) > 10.0


def test_slopes_that_are_alike_whatever_the_level_of_their_grasp_do_not_differ() -> None:
    """As where the few places of each grasp differ; by their levels slopes seemed to differ, and counted for less."""
    rng = np.random.default_rng(0)
    grasps = statistics([grasp(rng, 3, 0.0, 0.0, error=1e-3) for _ in range(12)])
    off = np.resize([-0.05, 0.05], 12)
    apart = [
        replace(each, mean=each.mean + np.array([0.0, 0.0, level])) for each, level in zip(grasps, off, strict=True)
    ]
    assert divided_by(apart) == pytest.approx(divided_by(grasps), rel=0.01)


def test_slopes_that_go_with_their_grasp_do_not_differ_where_its_few_places_hide_its_level() -> None:
    """Grasps off by 10 %, slopes and all, whose level three places that scatter by 0.05 show to 6 %."""
    rng = np.random.default_rng(0)
    grasps = statistics([grasp(rng, 3, 0.0, 0.1, error=1e-3) for _ in range(12)])
    hidden = [replace(each, mean=each.mean + rng.normal(0.0, 0.05, (3, 1)) * [0.0, 0.0, 1.0]) for each in grasps]
    assert divided_by(hidden) < 1.6  # 17, were the levels of places taken for their grasp's
    unsure = _factors(grasps, LAW)[1]
    assert unsure == pytest.approx(0.0, abs=1e-7)  # of samples alone: 1e-3 of 1,200
    deviation = np.sqrt(_factors(hidden, LAW)[1])
    assert np.median(deviation) == pytest.approx(0.05 / np.sqrt(3.0) / 0.458, rel=0.4)  # of three each


def test_one_grasp_and_grasps_without_error_are_left_as_they_are() -> None:
    rng = np.random.default_rng(0)
    for grasps in ([grasp(rng, 3)], [grasp(rng, 3, scatter=0.0, error=0.0) for _ in range(3)]):
        told = statistics(grasps)
        assert with_slopes_that_differ(told, LAW) == told


def exact(rng: np.random.Generator, places: int) -> FrictionSamples:
    """A grasp on the law, with velocities and forces all over its places."""
    v, f_n, one = rng.uniform(1e-3, 5e-3, 100 * places), rng.uniform(3.0, 7.0, 100 * places), np.ones(100 * places)
    mu = 0.5 + 4.0 * v - 0.01 * f_n
    time, place = np.tile(np.arange(100) / 100.0, places), np.repeat(np.arange(places), 100)
    return FrictionSamples(mu, v, f_n, mu * f_n, time, place, one, 1e-4)


@pytest.mark.parametrize("places", [1, 4])
def test_what_rounding_leaves_is_no_noise_that_slopes_differ_by_more_than(places: int) -> None:
    for seed in range(10):
        rng = np.random.default_rng(seed)
        almost = LAW * [1.0, 1.0 - 1e-4, 1.0]  # as it is fitted beside a prior
        assert divided_by(statistics([exact(rng, places) for _ in range(12)]), almost) == 1.0


def test_a_law_that_falls_to_what_grasps_scatter_by_has_no_factors() -> None:
    """Grasps that are off by 0.02 whatever their force, at forces from where the law is 0.45 to where it is 0."""
    rng = np.random.default_rng(0)
    law, scatter = np.array([0.55, 0.0, -0.05]), 0.02
    forces = np.linspace(2.0, 11.0, 12)
    one = statistics([grasp(rng, 3, 0.0, 0.0) for _ in forces])
    made = [
        replace(each, mean=np.tile([2e-3, force, law @ [1.0, 2e-3, force] + sign * scatter], (3, 1)))
        for each, force, sign in zip(one, forces, np.resize([-1.0, 1.0], 12), strict=True)
    ]
    factors, unsure = _factors(made, law)
    assert (factors > 0.4).all()
    assert (factors < 1.6).all()
    assert factors[-1] == 1.0
    assert (unsure == 0.0).all()  # places of each are alike
    np.testing.assert_allclose(
        factors[:3],
        [1.0 - scatter / 0.45, 1.0 + scatter / (0.45 - 0.05 * 9 / 11), 1.0 - scatter / (0.45 - 0.05 * 18 / 11)],
    )
