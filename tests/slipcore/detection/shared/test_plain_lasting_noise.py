"""Noise by neighbours and steps of rounding, by hand, as plain Python."""

import math

import numpy as np
import pytest

from slipcore.defaults import NOISE
from slipcore.detection.shared import lasting_noise
from slipcore.detection.shared.lasting_noise import (
    OF_QUARTILE,
    OF_STENCIL,
    OF_STEP,
    ROWS,
    SERIES,
    SPREAD,
    STEP,
    TURNING,
)
from tests.slipcore.plain_kernels import as_plain_python


@pytest.fixture(autouse=True)
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    as_plain_python(monkeypatch, lasting_noise)


def test_constants_are_those_of_their_distributions() -> None:
    values = np.random.default_rng(1).standard_normal(400_000)
    assert np.quantile(np.abs(values), 0.25) == pytest.approx(OF_QUARTILE, rel=0.01)
    weights = np.outer([1.0, -2.0, 1.0], [1.0, -2.0, 1.0])
    assert np.sqrt((weights**2).sum()) == OF_STENCIL
    assert np.std(np.linspace(-0.5, 0.5, 100_001)) == pytest.approx(OF_STEP, rel=1e-4)


@pytest.mark.parametrize(
    ("one", "other", "found"),
    [(6.0, 4.0, 2.0), (4.0, 6.0, 2.0), (5.0, 0.0, 5.0), (0.0, 5.0, 5.0), (7.5, 2.5, 2.5), (0.0, 0.0, 0.0)],
)
def test_a_common_divisor_is_the_greatest_one(one: float, other: float, found: float) -> None:
    assert lasting_noise.common_divisor(one * 1e-6, other * 1e-6) == pytest.approx(found * 1e-6, abs=1e-12)


def test_what_misses_a_multiple_by_rounding_is_one() -> None:
    near = 6e-6 - 0.9 * NOISE.least_step
    assert lasting_noise.common_divisor(near, 2e-6) == pytest.approx(2e-6, rel=1e-3)
    assert lasting_noise.common_divisor(6e-6 - 3.0 * NOISE.least_step, 2e-6) < 1e-8


def seek(values: list[float], found: np.ndarray) -> list[float]:
    lasting_noise.seek_step(np.atleast_2d(values), found)
    return found.tolist()


def test_a_step_stays_until_a_finer_one_is_seen_and_none_is_sought_after_that_for_a_while() -> None:
    found = np.zeros(2)
    assert seek([0.0, 4e-6, 8e-6], found) == pytest.approx([4e-6, 0.0])
    assert seek([0.0, 0.0, 12e-6], found) == pytest.approx([4e-6, 0.0])  # two places, and known
    assert seek([0.0, 2e-6, 12e-6], found) == pytest.approx([2e-6, 0.0])
    assert seek([0.0, 1.5e-8, 12e-6], found) == [0.0, NOISE.memory]
    assert seek([0.0, 4e-6, 8e-6], found) == [0.0, NOISE.memory - 1.0]


def test_three_different_places_make_a_step_and_two_do_not() -> None:
    assert seek([3e-6, 0.0, 3e-6, 0.0], np.zeros(2)) == [0.0, 0.0]
    assert seek([3e-6, 0.0, 3e-6, 9e-6], np.zeros(2)) == pytest.approx([3e-6, 0.0])
    assert seek([3e-6, 3e-6 + 0.5e-8, 6e-6, 3e-6], np.zeros(2))[0] == 0.0  # as good as the same


def test_steps_of_places_and_of_depth_are_kept_apart() -> None:
    displacement, found = np.zeros((3, 3, 3)), np.zeros(4)
    displacement[..., 0] = 2e-6 * np.arange(9.0).reshape(3, 3)
    displacement[..., 1] = 3e-6 * np.arange(9.0).reshape(3, 3)
    displacement[..., 2] = 5e-6 * np.arange(9.0).reshape(3, 3)
    lasting_noise.seek_steps(displacement, found, np.empty((2, SERIES)))
    np.testing.assert_allclose(found, [1e-6, 0.0, 5e-6, 0.0], rtol=1e-3, atol=1e-15)


def test_no_place_is_looked_at_while_no_step_is_sought() -> None:
    nothing = np.full((3, 3, 3), np.nan)
    found = np.array([1e-6, 2.0, 0.0, 5.0])
    lasting_noise.seek_steps(nothing, found, np.empty((2, SERIES)))
    np.testing.assert_array_equal(found, [1e-6, 1.0, 0.0, 4.0])


def test_of_depth_a_step_is_sought_while_none_is_in_the_plane() -> None:
    displacement, found = np.zeros((3, 3, 3)), np.array([0.0, 2.0, 0.0, 0.0])
    displacement[..., 2] = 5e-6 * np.arange(9.0).reshape(3, 3)
    lasting_noise.seek_steps(displacement, found, np.empty((2, SERIES)))
    np.testing.assert_allclose(found, [0.0, 1.0, 5e-6, 0.0], rtol=1e-3)


def test_the_size_of_a_field_is_what_its_components_scatter_by() -> None:
    field = np.full((2, 2, 3), 7.0)
    field[..., 0] = [[1.0, 3.0], [1.0, 3.0]]
    field[..., 2] = [[0.0, 0.0], [0.0, 4.0]]
    assert lasting_noise.size_of(field) == pytest.approx(math.sqrt((4.0 + 12.0) / 12.0), rel=1e-12)
    assert lasting_noise.size_of(np.full((3, 3, 3), 5.0)) == 0.0


def test_noise_is_told_from_225_elements_with_neighbours_on() -> None:
    fields = [np.random.default_rng(2).standard_normal((side, 17, 3)) for side in (16, 17)]
    found = [lasting_noise.noise_between_neighbours(field, np.empty(2 * SERIES)) for field in fields]
    assert math.isnan(found[0])
    assert found[1] == pytest.approx(1.0, rel=0.5)
    assert NOISE.least_inner == 15 * 15


def test_of_what_bends_the_part_is_left_out_that_a_field_of_that_size_may_bend_by() -> None:
    noisy = 1e-6 * np.random.default_rng(3).standard_normal((20, 20, 3))
    tilted = noisy.copy()
    slope = 1e-3 * np.arange(20.0)
    tilted[..., 2] += slope[:, None]
    room = np.empty(2 * SERIES)
    alone = lasting_noise.noise_between_neighbours(noisy, room)
    large = lasting_noise.size_of(tilted)
    expected = max(alone**2 - (NOISE.field_bend * large) ** 2, 0.0) ** 0.5
    assert lasting_noise.noise_between_neighbours(tilted, room) == pytest.approx(expected, abs=1e-12)
    assert large == pytest.approx(1e-3 * np.std(np.arange(20.0)) / np.sqrt(3.0), rel=0.05)
    assert 5e-7 < alone < 2e-6


def test_a_frame_that_is_not_fresh_changes_nothing_of_what_is_remembered() -> None:
    noise, after = lasting_noise.start_noise(), np.full_like(lasting_noise.start_noise(), 9.0)
    assert noise.shape == (ROWS, max(1 + NOISE.memory, SERIES))
    field, series = 1e-6 * np.random.default_rng(4).standard_normal((20, 20, 3)), np.empty((2, SERIES))
    told = lasting_noise.step_lasting(noise, field, False, after, series)
    assert math.isnan(told[0])
    assert told[1:] == (0.0, 0.0)
    assert not after[SPREAD:TURNING].any()
    assert (after[:SPREAD] == 9.0).all()  # not its rows
    told = lasting_noise.step_lasting(noise, field, True, after, series)
    first = lasting_noise.noise_between_neighbours(field, np.empty(2 * SERIES))
    assert told[0] == pytest.approx((2.0 - 1.0 / NOISE.memory) * first, rel=1e-12)  # rounded up while there are few
    assert after[STEP, 1] == NOISE.memory  # no step, and none is sought for a while
