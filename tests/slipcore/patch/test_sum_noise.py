"""Noise of sums over patches: how large, for how long, and with or without a load that changes."""

import numpy as np
import pytest

from benchmarks.detector.bounds import common_lasting, lasting
from slipcore.frames import FloatArray
from slipcore.noise_memory import WHITE, Lasting
from slipcore.patch.sum_noise import SumNoise, _find_changes, _largest_square, _sum_of_square, noise_of_sums
from tests.slipcore.patch.spans import one_patch

UP = np.array([0.0, 0.0, 1.0])
PRESSED = np.array([0.3, 0.0, -1.0])
MIDDLE = np.zeros((9, 9), bool)
MIDDLE[3:6, 3:6] = True


def found_of(force: FloatArray, contact: FloatArray = MIDDLE, known: Lasting = WHITE) -> SumNoise:
    """Of elements [n, m] in contact, 1 mm apart, at 30 Hz within half a second."""
    place = np.zeros(force.shape)
    place[..., :2] = 1e-3 * np.stack(np.meshgrid(*(np.arange(length) for length in contact.shape), indexing="ij"), -1)
    spans = one_patch(np.broadcast_to(contact, force.shape[:3]))
    time, force = as_of_a_log(np.arange(len(force)) / 30.0), as_of_a_log(force)
    return noise_of_sums(time, force, np.broadcast_to(UP, force.shape), place, spans, 0.5, known)


def as_of_a_log(values: FloatArray) -> FloatArray:
    """Read-only: kernels are compiled for these, and would be anew for others, in four seconds."""
    values.setflags(write=False)
    return values


def test_noise_of_sums_is_told_apart_across_the_normal_and_along_it() -> None:
    random, time = np.random.default_rng(1), np.cumsum(np.random.default_rng(2).uniform(0.5, 1.5, 2000))
    force = np.array([0.3, 0.0, -1.0]) + random.standard_normal((2000, 3, 3, 3)) * np.array([0.01, 0.02, 0.05])
    place = np.zeros(force.shape)
    spans = one_patch(np.ones((2000, 3, 3), bool))
    time, force = as_of_a_log(time), as_of_a_log(force)
    found = noise_of_sums(time, force, np.broadcast_to(UP, force.shape), place, spans, 0.0).noise
    np.testing.assert_allclose(found[[0, -1]], [[0.02, 0.05]] * 2, rtol=0.1)


def test_elements_that_come_and_go_are_no_noise_of_sums() -> None:
    """Five at the rim that bear nothing, in every third frame: noise had come out 30 to 100 times as large."""
    force = np.zeros((300, 9, 7, 3))
    force[:, 2:7, 1:6] = [0.3, 0.0, -1.0]
    force += 1e-3 * np.random.default_rng(1).standard_normal(force.shape)
    place = np.zeros(force.shape)
    place[..., :2] = 1e-3 * np.stack(np.meshgrid(np.arange(7.0), np.arange(9.0)), axis=-1)
    contact = np.ones((300, 9, 7), bool)
    contact[np.arange(300) % 3 > 0, 0] = False
    time, force = as_of_a_log(np.arange(300) / 60.0), as_of_a_log(force)
    found = noise_of_sums(time, force, np.broadcast_to(UP, force.shape), place, one_patch(contact), 0.0).noise
    np.testing.assert_allclose(found[0], 1e-3, rtol=0.15)


@pytest.mark.parametrize("frames", [60, 1800])
def test_noise_that_elements_share_and_that_lasts_is_known_from_sums_alone(frames: int) -> None:
    """Three frames show a quarter of it."""
    whole, noises = np.ones((3, 3), bool), []
    for seed in range(40):
        noise = 5e-3 * common_lasting((frames, 3, 3, 3), np.random.default_rng(seed))
        noises.append(found_of(PRESSED + noise, whole).noise[0, 0])
    assert np.median(noises) == pytest.approx(5e-3, rel=0.2)
    assert np.quantile(noises, 0.1) > 5e-3 * (0.85 if frames == 1800 else 0.6)


def test_sums_last_as_their_elements_do() -> None:
    """A filter is the same for all: what many elements show of it is surer than what one sum does."""
    noise = 5e-3 * lasting((60, 3, 3, 3), np.random.default_rng(1))
    found, three = (
        found_of(PRESSED + noise, np.ones((3, 3), bool), known) for known in (Lasting(4.0, 19.0), Lasting(1.0, 2.0))
    )
    np.testing.assert_allclose(found.noise, 4.0 * three.noise, rtol=1e-12)
    assert (found.frames == 19.0).all()


def wandering(seed: int) -> FloatArray:
    """Forces of a contact in the middle whose load wanders by some newtons, [t, 9, 9, 3]."""
    force = np.zeros((300, 9, 9, 3))
    steps = 5e-3 * np.random.default_rng(seed).standard_normal((300, 3)).cumsum(axis=0)
    force[:, MIDDLE] = (PRESSED + steps)[:, None]
    return force


def test_elements_without_load_show_what_of_a_load_that_wanders_is_noise() -> None:
    force, noise = wandering(1), 1e-4 * lasting((300, 9, 9, 3), np.random.default_rng(2))
    alone, beside = found_of(force), found_of(force + noise)
    three = found_of(force, known=Lasting(1.0, 2.0)).noise
    assert (alone.noise > 3.0 * three).all()
    np.testing.assert_allclose(beside.noise, three, rtol=0.05)


def test_elements_without_load_show_all_noise_that_lasts() -> None:
    noises = [
        found_of(PRESSED * MIDDLE[..., None] + 5e-3 * common_lasting((300, 9, 9, 3), np.random.default_rng(seed))).noise
        for seed in range(20)
    ]
    share = 5e-3 / 3.0  # of an element, as nine of them have as much as a ninth of the sum over 81
    assert np.median(noises) == pytest.approx(share, rel=0.3)
    assert np.quantile(noises, 0.1) > 0.6 * share


def test_changes_are_those_of_elements_that_are_free_in_three_frames() -> None:
    random = np.random.default_rng(1)
    force, labels = random.standard_normal((9, 4, 5, 3)), np.full((9, 4, 5), -1)
    labels[1, 0, 0] = labels[4, 1, 1] = labels[7, 2, 2] = labels[5, 3, 3] = 0
    off = np.ones((4, 5, 3))
    _find_changes(as_of_a_log(force), labels, 4, 3, 0.25, off)
    expected = force[4] - 0.75 * force[1] - 0.25 * force[7]
    for place in ((0, 0), (1, 1), (2, 2)):
        expected[place] = 0.0
    np.testing.assert_allclose(off, expected, rtol=1e-12)


def test_the_largest_square_is_of_elements_that_change() -> None:
    off, room = np.ones((6, 7, 3)), np.zeros((7, 8), np.int64)
    assert _largest_square(off, room) == (5, 5, 6)
    middle, edge = off.copy(), off.copy()
    middle[2, 3] = edge[5, 3] = 0.0
    assert _largest_square(middle, room)[2] == 3  # in a room that has been used
    assert _largest_square(edge, room)[2] == 5
    assert _largest_square(0.0 * off, room)[2] == 0
    assert _largest_square(off * [0.0, 0.0, 1.0], room)[2] == 6


def test_a_sum_is_over_the_largest_square_alone() -> None:
    room, total = np.zeros((5, 7), np.int64), np.ones(3)
    off = np.arange(1.0, 73.0).reshape(4, 6, 3)
    off[:, 3] = 0.0
    assert _sum_of_square(off, room, total) == 3
    np.testing.assert_allclose(total, off[:3, :3].sum(axis=(0, 1)))
    assert _sum_of_square(0.0 * off, room, total) == 0
    np.testing.assert_array_equal(total, 0.0)
