from dataclasses import replace

import numpy as np
import pytest

import estimators
from estimators import FrictionModel, Moments, Scale, Scales
from slipcore.samples import FrictionSamples

LAW = np.array([0.45, 8.0, -0.8])
TAU, OMEGA, SIGMA = 0.06, 0.02, 0.03


def grasp(seed: int, effect: float, n: int = 60, places: int = 8) -> FrictionSamples:
    """A grasp whose friction is 1 + ``effect`` times the law's, and whose places differ."""
    rng = np.random.default_rng([seed, 23])
    place = rng.integers(0, places, n)
    v, f_n = rng.uniform(1e-4, 5e-3, n), rng.uniform(0.05, 0.2, places)[place] * rng.uniform(0.8, 1.2, n)
    mu = (LAW @ [np.ones(n), v, f_n]) * (1.0 + effect)
    mu += OMEGA * rng.standard_normal(places)[place] + SIGMA * rng.standard_normal(n)
    return FrictionSamples(mu, v, f_n, mu * f_n, np.arange(n) * 0.01, place, np.ones(n), 1e-6)


@pytest.fixture(scope="module")
def truth() -> np.ndarray:
    return TAU * np.random.default_rng(7).standard_normal(200)


@pytest.fixture(scope="module")
def moments(truth: np.ndarray) -> list[Moments]:
    return [Moments.from_samples(grasp(k, effect)) for k, effect in enumerate(truth)]


@pytest.fixture(scope="module")
def model(moments: list[Moments]) -> FrictionModel:
    return estimators.fit(moments, "hierarchical")


def known(model: FrictionModel) -> FrictionModel:
    """The law that the grasps were made with, and its scales, as if nothing of them were uncertain."""
    scales = Scales(*(Scale(value, np.inf) for value in (TAU, OMEGA, SIGMA)))
    return replace(model, coefficients=LAW, covariance=np.zeros((3, 3)), scales=scales)


def test_an_effect_is_that_of_the_dense_normal_model(model: FrictionModel) -> None:
    seen = grasp(3, 0.08)
    (found,) = estimators.grasp_effects(known(model), [Moments.from_samples(seen)])
    law = LAW @ [np.ones(len(seen)), seen.tangential_velocity, seen.normal_force]
    noise = SIGMA**2 * np.eye(len(seen)) + OMEGA**2 * (seen.element[:, None] == seen.element)
    precision = TAU**-2 + law @ np.linalg.solve(noise, law)
    expected = law @ np.linalg.solve(noise, seen.friction_coefficient - law) / precision
    np.testing.assert_allclose(found.value, expected, rtol=1e-9)
    half = 1.959963984540054 / np.sqrt(precision)
    np.testing.assert_allclose(found.interval, (expected - half, expected + half), rtol=1e-9)


def test_places_in_groups_say_the_same(model: FrictionModel) -> None:
    """Of a grasp with more places than are kept singly only their weights are rounded."""
    seen = grasp(4, 0.05, n=4000, places=900)
    (found,) = estimators.grasp_effects(known(model), [Moments.from_samples(seen)])
    law = LAW @ [np.ones(len(seen)), seen.tangential_velocity, seen.normal_force]
    noise = SIGMA**2 * np.eye(len(seen)) + OMEGA**2 * (seen.element[:, None] == seen.element)
    solved = np.linalg.solve(noise, np.stack([law, seen.friction_coefficient - law], axis=1))
    np.testing.assert_allclose(found.value, law @ solved[:, 1] / (TAU**-2 + law @ solved[:, 0]), rtol=2e-2)


def test_intervals_hold_the_true_effects_of_most_grasps(
    truth: np.ndarray, moments: list[Moments], model: FrictionModel
) -> None:
    """Of 200 grasps; 95 % would be 190, with a standard deviation of 3.1."""
    found = estimators.grasp_effects(model, moments)
    held = sum(low <= u <= high for u, (low, high) in zip(truth, (each.interval for each in found), strict=True))
    assert 180 <= held <= 199
    assert np.corrcoef(truth, [each.value for each in found])[0, 1] > 0.85  # √(1 − 0.021²/0.06²) = 0.94 is expected


def test_elements_of_another_area_change_no_effect(model: FrictionModel) -> None:
    seen = grasp(5, -0.1)
    same, larger = (estimators.grasp_effects(model, [Moments.from_samples(each)])[0] for each in (seen, _larger(seen)))
    np.testing.assert_allclose(larger.value, same.value, rtol=1e-9)
    np.testing.assert_allclose(larger.interval, same.interval, rtol=1e-9)


def _larger(samples: FrictionSamples) -> FrictionSamples:
    return samples.at_element_area(4.0 * samples.element_area)


def test_unknown_velocities_make_an_effect_less_sure(model: FrictionModel) -> None:
    seen = grasp(6, 0.1)
    relative = replace(seen, velocity_is_relative=np.ones(len(seen), bool))
    sure, unsure = (estimators.grasp_effects(model, [Moments.from_samples(each)])[0] for each in (seen, relative))
    assert unsure.velocity_unknown
    assert np.ptp(unsure.interval) > np.ptp(sure.interval)


def test_without_scatter_between_grasps_no_grasp_differs(model: FrictionModel, moments: list[Moments]) -> None:
    still = replace(known(model), scales=Scales(Scale(0.0, 9.0), Scale(OMEGA, 9.0), Scale(SIGMA, 9.0)))
    assert [each.value for each in estimators.grasp_effects(still, moments[:3])] == [0.0, 0.0, 0.0]


def test_no_grasps_have_no_effects(model: FrictionModel) -> None:
    assert estimators.grasp_effects(model, []) == []


def test_a_model_without_scales_and_moments_of_several_grasps_are_refused(
    model: FrictionModel, moments: list[Moments]
) -> None:
    with pytest.raises(estimators.InvalidSamples, match="model is by ols, without scales"):
        estimators.grasp_effects(estimators.fit(moments[:3], "ols"), moments[:3])
    with pytest.raises(estimators.InvalidSamples, match="moments is of 2 grasps"):
        estimators.grasp_effects(model, [moments[0].merge(moments[1])])
