"""What all methods share of a frame, by hand, as plain Python."""

import math
from inspect import unwrap

import numpy as np
import pytest

from slipcore.defaults import NOISE
from slipcore.detection.shared.contact import ContactThreshold
from slipcore.detection.shared.observe import indent, pulled, same, step_standing
from slipcore.detection.shared.records import FrameArrays

ROW, COLUMN = np.mgrid[:3, :3]
POSITION = np.stack([ROW, COLUMN, 0 * ROW], axis=-1).astype(float)


def frame(time: float, displacement: np.ndarray, force: np.ndarray) -> FrameArrays:
    return FrameArrays(time, displacement, force, np.zeros(0), np.zeros((0, 0, 3)), np.zeros((0, 0), bool))


def moved(x: float = 0.0, y: float = 0.0, z: float = 0.0, turn: float = 0.0) -> np.ndarray:
    """Of nine markers with so much in all, and turned about the one in the middle."""
    field = np.zeros((3, 3, 3))
    field[0, 0] = x, y, z
    field[2, 1, 1] += turn  # an arm of one along x
    field[0, 1, 1] -= turn
    return field


FORCE = np.full((3, 3, 3), 0.1)
MOST = NOISE.stale_deviations * 3.0
"""Of noise of 1 on nine markers."""


def standing(
    displacement: np.ndarray, force: np.ndarray = FORCE, before: float = 0.0, force_noise: float = 1.0
) -> np.ndarray:
    """The clock row half a second after a frame whose markers were at 0 and whose force was ``FORCE``."""
    row, after = np.zeros(8), np.full(8, -1.0)
    row[3] = before
    last, now = frame(1.0, moved(), FORCE), frame(1.5, displacement, force)
    unwrap(step_standing)(POSITION, last, now, row, np.array([1.0, force_noise]), after)
    return after[3:]


@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_forces_stand_still_that_are_the_same_while_markers_move_beyond_noise(axis: str, sign: float) -> None:
    assert standing(moved(**{axis: 0.99 * sign * MOST}))[0] == 0.0
    assert standing(moved(**{axis: 1.01 * sign * MOST}))[0] == 0.5


def test_markers_that_turn_move_as_well() -> None:
    """Nine markers about the middle have squared arms of 12 in all."""
    most = NOISE.stale_deviations * math.sqrt(12.0)
    assert standing(moved(turn=0.49 * most))[0] == 0.0  # by two arms of one
    assert standing(moved(turn=0.51 * most))[0] == 0.5


def test_forces_that_change_or_are_all_zero_do_not_stand_still() -> None:
    far = moved(x=2.0 * MOST, y=3.0, z=4.0)
    assert standing(far, FORCE + 1e-12).tolist() == [0.0, 2.0 * MOST, 3.0, 4.0, pytest.approx(-3.0 + 2.0 * MOST)]
    last = frame(1.0, moved(), 0.0 * FORCE)
    after = np.zeros(8)
    unwrap(step_standing)(POSITION, last, last._replace(time=1.5, displacement=far), np.ones(8), np.ones(2), after)
    assert after[3] == 0.0


def test_once_forces_stand_they_go_on_and_sums_are_of_when_they_last_changed() -> None:
    assert standing(moved(), before=0.25).tolist() == [0.75, 0.0, 0.0, 0.0, 0.0]


def test_forces_without_noise_may_stand_still() -> None:
    assert standing(moved(x=2.0 * MOST), force_noise=0.0)[0] == 0.0
    assert standing(moved(x=2.0 * MOST), force_noise=0.0, before=0.25)[0] == 0.75  # but they did before


@pytest.mark.parametrize(("sum_of_all", "pulls"), [(-17.9, False), (-18.1, True), (30.0, False)])
def test_elements_pull_by_more_than_noise_and_what_a_touch_needs(sum_of_all: float, pulls: bool) -> None:
    """Nine elements: 3 deviations of 0.5 · 3, and 1.5 each."""
    touch = ContactThreshold(*np.zeros(len(ContactThreshold._fields)))._replace(noise=3.0, least=1.5)
    assert unwrap(pulled)(np.full((3, 3), sum_of_all / 9.0), 0.5, touch) == pulls


def test_a_surface_is_indented_inwards() -> None:
    depth = np.zeros((3, 3))
    unwrap(indent)(moved(x=1.0, z=-2.0), depth)
    assert depth[0, 0] == 2.0
    assert np.count_nonzero(depth) == 1


def test_fields_are_the_same_to_the_last_bit() -> None:
    one = np.array([[1.0, 2.0], [3.0, 4.0]])
    assert unwrap(same)(one, one.copy())
    other = one.copy()
    other[1, 1] = np.nextafter(4.0, 5.0)
    assert not unwrap(same)(one, other)
