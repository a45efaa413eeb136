"""Noise that three frames do not show: what lasts from frame to frame, and rounding."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from service.slip_benchmark.faults import Fault, correlated, rounded
from slipcore import GraspLog, SlipHistory, detect_slip
from slipcore.detection.shared.lasting_noise import bend, noise_between_neighbours, seek_step, step_in_plane

Scene = Callable[..., GraspLog]
Score = Callable[[GraspLog, SlipHistory], float]


def step_of(*frames: np.ndarray) -> float:
    found = np.zeros(2)
    for values in frames:
        seek_step(np.ascontiguousarray(np.atleast_2d(values)), found)
    return float(found[0])


@pytest.mark.parametrize("step", [1e-7, 5e-6, 2e-5])
def test_the_step_of_rounded_places_is_their_greatest_common_divisor(step: float) -> None:
    places = step * np.random.default_rng(1).integers(-30, 30, (2, 64))
    assert step_of(places) == pytest.approx(step, rel=1e-6)
    assert step_of(step * np.array([0, 4, 8]), step * np.array([0, 6, 10])) == pytest.approx(2.0 * step, rel=1e-6)


def test_places_that_are_not_rounded_have_no_step() -> None:
    rng = np.random.default_rng(2)
    assert all(step_of(1e-5 * rng.standard_normal((2, 64))) == 0.0 for _ in range(200))
    assert step_of(np.zeros(8)) == 0.0
    assert step_of(np.array([0.0, 0.0, 7e-6])) == 0.0  # two places are multiples of their distance
    coarse = 2e-5 * np.round(rng.standard_normal((2, 64)))
    assert step_of(coarse, coarse + 1e-6 * rng.standard_normal((2, 64))) == 0.0


def bent(field: np.ndarray) -> float:
    return float(noise_between_neighbours(np.ascontiguousarray(field), np.empty(128)))


def test_noise_is_told_from_neighbours_in_one_frame() -> None:
    rng = np.random.default_rng(3)
    told = [bent(1e-6 * rng.standard_normal((20, 20, 3))) for _ in range(100)]
    assert np.mean(told) == pytest.approx(1e-6, rel=0.05)  # a quartile of 128 errs by 16 %, the mean of 100 by 2 %


def test_an_even_field_has_no_noise() -> None:
    i, j = np.meshgrid(np.arange(20.0), np.arange(20.0), indexing="ij")
    field = 1e-6 * np.stack([i**2 * (1.0 + j) + j**2, i * j - 3.0 * i**2, i], axis=-1)
    assert bent(field) < 1e-18  # rounding
    assert np.isnan(bent(field[:9, :9]))  # 49 elements with neighbours


def test_a_field_that_bends_around_a_rim_has_no_noise(scene: Scene) -> None:
    fields = scene("ring", marker_noise=0.0).displacement
    assert max(bent(field) for field in fields) < 3e-7  # 0.6 µm were taken to be noise


@pytest.mark.parametrize(("fault", "least"), [(correlated(1e-5), 0.75), (correlated(3e-6), 0.86), (rounded(2e-5), 0.8)])
@pytest.mark.parametrize("name", ["cond1", "ring"])
def test_slip_is_found_beside_noise_that_lasts(
    scene: Scene, f1_score: Score, name: str, fault: Fault, least: float
) -> None:
    log = fault(scene(name, marker_noise=1e-6, force_noise=2e-3), np.random.default_rng(4))
    history = detect_slip(log)
    assert f1_score(log, history) > least
    assert history.noise > 2e-6
    assert {finding.name for finding in history.findings} & {"lasting noise", "rounded"}


def test_rounding_below_the_noise_is_not_reported(scene: Scene) -> None:
    """Places in pixels with three decimals are multiples of 30 nm: each table of markers had the finding."""
    log = scene("cond1", marker_noise=2e-6, force_noise=2e-3)
    for step, is_reported in ((3e-8, False), (1e-6, False), (1e-5, True)):
        history = detect_slip(rounded(step)(log, np.random.default_rng(4)))
        assert ("rounded" in {finding.name for finding in history.findings}) is is_reported, step


def test_no_length_is_reported_of_a_log_without_a_scale(scene: Scene) -> None:
    log = rounded(1e-5)(scene("cond1", marker_noise=2e-6), np.random.default_rng(4))
    unscaled = replace(log, force=None, metadata={"scale": "unknown"})
    assert not unscaled.is_scaled
    assert detect_slip(unscaled).findings == ()


def test_white_noise_is_not_taken_to_last(scene: Scene) -> None:
    for name in ("cond1", "cond4"):
        for size in (0.0, 1e-6, 1e-5):
            history = detect_slip(scene(name, marker_noise=size, force_noise=2e-3))
            assert history.findings == ()
            assert not size or history.noise == pytest.approx(size, rel=0.1)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_field_bends_by_what_no_line_and_no_column_has_alone(axis: int) -> None:
    """x²y² by 4 everywhere, a sum of any functions of x and of y not at all."""
    rng, x = np.random.default_rng(6), np.arange(7.0)
    field = np.zeros((7, 7, 3))
    field[..., axis] = np.multiply.outer(x**2, x**2)
    alone = field.copy()
    alone[..., axis] = rng.standard_normal((7, 1)) + rng.standard_normal(7)
    for i, j in np.ndindex(5, 5):
        assert bend(field, i + 1, j + 1, axis) == pytest.approx(4.0)
        assert bend(alone, i + 1, j + 1, axis) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("of_places", "frames", "step"), [(2e-6, 0.0, 2e-6), (2e-6, 5.0, 2e-6), (0.0, 5.0, 0.0), (0.0, 0.0, 7e-6)]
)
def test_the_step_of_depth_counts_where_places_have_none_yet(of_places: float, frames: float, step: float) -> None:
    assert step_in_plane(np.array([of_places, frames, 7e-6, 0.0])) == step
