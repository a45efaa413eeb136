"""As how many independent places those of a grasp count."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

import estimators
from estimators import InvalidSamples, Moments
from estimators.linear.grasp_statistics import ALIKE, HEADER, GraspStatistics
from estimators.linear.place_correlation import independent_share
from slipcore.samples import FrictionSamples

SIDE = 12
ELEMENT = np.arange(SIDE**2)


def shares(width: float, noise: float = 0.0, element: np.ndarray = ELEMENT) -> np.ndarray:
    """Of a hundred fields of variance 1, smoothed by a normal density of so many elements, with noise on each."""
    found = []
    for seed in range(100):
        rng = np.random.default_rng(seed)
        field = rng.standard_normal((SIDE, SIDE))
        if width:
            field = ndimage.gaussian_filter(field, width, mode="wrap") * np.sqrt(4.0 * np.pi) * width
        mu = field.ravel() + noise * rng.standard_normal(SIDE**2)
        mean = np.stack([1e-3 * rng.random(SIDE**2), 0.1 * rng.random(SIDE**2), mu], axis=1)[: len(element)]
        found.append(independent_share(mean, np.full(len(mean), noise**2), element))
    return np.array(found)


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_smooth_places_count_as_the_variance_of_their_mean_says(noise: float) -> None:
    """Smoothed by a density of 1 element the mean has 4 pi times the variance of independent places' (convolution); the
    level of what counts as eleven places takes a tenth of that variance, and two slopes take as much.
    """
    expected = (1.0 + noise**2) / (4.0 * np.pi + noise**2)
    assert np.median(shares(1.0, noise)) == pytest.approx(expected, rel=0.35)


def test_places_that_differ_each_by_itself_count_in_full() -> None:
    assert np.mean(shares(0.0) == 1.0) >= 0.9  # 97.7 % lie below two standard errors


def test_places_without_neighbours_count_in_full() -> None:
    np.testing.assert_array_equal(shares(1.0, element=2 * ELEMENT), 1.0)
    np.testing.assert_array_equal(shares(1.0, element=ELEMENT[:10]), 1.0)


def smooth_grasp(samples: Callable[..., FrictionSamples], seed: int) -> FrictionSamples:
    field = ndimage.gaussian_filter(np.random.default_rng([seed, 1]).standard_normal((SIDE, SIDE)), 1.0, mode="wrap")
    data = samples(600, seed=seed, elements=SIDE**2, scale=0.01)
    force = 0.02 + 0.08 * (data.element // SIDE) / SIDE  # the same at a place, so that places alone tell its slope
    friction = data.friction_coefficient - 0.8 * (force - data.normal_force) + 0.1 * field.ravel()[data.element]
    return replace(data, friction_coefficient=friction, normal_force=force, tangential_force=friction * force)


def test_smooth_places_widen_what_one_grasp_tells(samples: Callable[..., FrictionSamples]) -> None:
    data = smooth_grasp(samples, 0)
    apart = replace(data, element=2 * data.element)  # of which no two are known to be neighbours
    alike, independent = (estimators.fit(each, method="hierarchical") for each in (data, apart))
    assert alike.standard_errors[2] > 1.3 * independent.standard_errors[2]


def test_the_share_is_stored_and_read(samples: Callable[..., FrictionSamples]) -> None:
    moments = Moments.from_samples(smooth_grasp(samples, 0))
    (grasp,) = moments.grasps
    assert grasp.share < 0.5
    (read,) = Moments.from_bytes(moments.to_bytes()).grasps
    assert read.share == grasp.share
    np.testing.assert_array_equal(read.mean, grasp.mean)
    assert grasp.scaled(2.0).share == grasp.share
    content = bytearray(grasp.to_bytes())
    assert HEADER.unpack_from(content)[1] & ALIKE
    content[HEADER.size : HEADER.size + 8] = np.array([1.5], "<f8").tobytes()
    with pytest.raises(InvalidSamples, match="share"):
        GraspStatistics.from_bytes(bytes(content))
