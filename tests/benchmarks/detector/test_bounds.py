"""Noise of forces of each kind, and how bounds of friction are counted."""

import numpy as np
import pytest

from benchmarks.detector import bounds
from benchmarks.detector.bounds import (
    NOISES,
    SMOOTHING,
    TIME_CONSTANT,
    Bounds,
    common,
    common_lasting,
    held_by,
    lasting,
    page,
    smoothed,
    smoothed_lasting,
    summary,
    white,
)
from slipcore.defaults import NORMAL_95, PatchOptions

SHAPE = (400, 6, 5, 3)


def rng() -> np.random.Generator:
    return np.random.default_rng(1)


def autocorrelation(noise: np.ndarray, frames: int) -> float:
    return float(np.mean(noise[frames:] * noise[:-frames]) / np.mean(noise**2))


@pytest.mark.parametrize("kind", [kind for kind, _ in NOISES])
def test_each_kind_has_the_shape_that_is_asked_for_and_repeats_by_its_generator(kind: bounds.Noise) -> None:
    found = kind(SHAPE, rng())
    assert found.shape == SHAPE
    np.testing.assert_array_equal(found, kind(SHAPE, rng()))


def test_common_noise_is_one_for_all_and_as_large_in_the_sum_as_white_noise() -> None:
    found = common(SHAPE, rng())
    np.testing.assert_array_equal(found, np.broadcast_to(found[:, :1, :1], SHAPE))
    sums = [kind(SHAPE, rng()).sum(axis=(1, 2)).std() for kind in (common, white)]
    assert sums[0] == pytest.approx(np.sqrt(30.0), rel=0.1)
    assert sums[1] == pytest.approx(np.sqrt(30.0), rel=0.1)


def test_smoothed_noise_is_smaller_and_alike_in_neighbours() -> None:
    found = smoothed((100, 30, 30, 3), rng())[:, 6:-6, 6:-6]
    assert found.std() == pytest.approx(0.5 / (np.sqrt(np.pi) * SMOOTHING), rel=0.1)  # of a Gaussian in two directions
    assert np.mean(found[:, 1:] * found[:, :-1]) / found.var() == pytest.approx(np.exp(-0.25 / SMOOTHING**2), rel=0.05)
    assert abs(autocorrelation(found, 1)) < 0.05


@pytest.mark.parametrize("frames", [1, 5, 10])
def test_lasting_noise_is_of_one_and_fades_with_its_time_constant(frames: int) -> None:
    found = lasting((4000, 5, 5, 3), rng())
    assert found.std() == pytest.approx(1.0, rel=0.03)
    assert found[:5].std() == pytest.approx(1.0, rel=0.15)  # from the first frame on
    assert autocorrelation(found, frames) == pytest.approx(np.exp(-frames / TIME_CONSTANT), abs=0.03)


def test_smoothed_noise_that_lasts_is_both() -> None:
    found = smoothed_lasting((2000, 12, 12, 3), rng())
    assert autocorrelation(found, 5) == pytest.approx(np.exp(-0.5), abs=0.1)
    middle = found[:, 5:8, 5:8]
    assert np.mean(middle[:, 1:] * middle[:, :-1]) / middle.var() > 0.7


def test_common_noise_that_lasts_is_one_for_all_and_fades_with_its_time_constant() -> None:
    found = common_lasting((20000, 6, 5, 3), rng())
    np.testing.assert_array_equal(found, np.broadcast_to(found[:, :1, :1], found.shape))
    assert found[:, 0, 0].std() == pytest.approx(1.0 / np.sqrt(30.0), rel=0.1)
    assert autocorrelation(found[:, 0, 0], 5) == pytest.approx(np.exp(-0.5), abs=0.05)


def test_bounds_are_counted_against_the_truth_where_there_are_any() -> None:
    found = summary(3, white, 1e-3, np.array([0.9, 1.01, np.nan, 1.2, 1.0]), 0.8)
    assert found == Bounds(3, "white", 1e-3, bounds=4, above=2, largest=1.2, left=0.8)


@pytest.mark.parametrize("side", [2, 5])
def test_a_load_that_is_held_without_noise_is_its_own_bound_but_for_the_error_of_sums(side: int) -> None:
    nothing = np.zeros((60, side, side, 3))
    found = held_by(np.ones((side, side), bool), 0.3, nothing)
    assert found.is_bound
    assert found.low == pytest.approx(0.3 * (1.0 - NORMAL_95 * PatchOptions().resultant_error), rel=1e-6)


def test_a_load_is_borne_by_the_elements_that_touch_alone() -> None:
    few = np.zeros((4, 4), bool)
    few[1:3, 1:3] = True
    assert held_by(few, 0.3, np.zeros((30, 4, 4, 3))).coefficient == pytest.approx(0.3, rel=1e-9)


def test_a_row_tells_array_noise_in_millinewtons_and_what_is_left() -> None:
    lines = page([Bounds(3, "white", 5e-3, 12, 2, 1.0456, 0.75)], "median").splitlines()
    assert [cell.strip() for cell in lines[2].strip("|").split("|")] == [
        "3 × 3",
        "white",
        "5",
        "12",
        "2",
        "1.05",
        "0.75",
    ]
    assert lines[0].endswith("| median |")
