"""Bristles by hand: three in a row, as plain Python."""

import numpy as np
import pytest

from slipcore.contact.defaults import WORLD
from slipcore.contact.reduced import kernel
from slipcore.contact.reduced.kernel import Bristles, Pad, Steps
from tests.slipcore.plain_kernels import as_plain_python

INFLUENCE = np.array([[0.2, 0.5, -0.01], [0.4, 0.9, -0.03], [2.0, 4.0, 0.0], [0.5, 1.0, 0.05], [0.3, 0.6, 0.02]])
"""From two places before to two behind; not the same on both sides, so that none is taken for the other."""
PAD = Pad(np.array([1.0, 2.0, 3.0]), np.array([0.5, -0.5, 0.0]), np.arange(3), INFLUENCE, 2, 1.0)
ALONE = Pad(np.array([0.0]), np.array([0.0]), np.arange(1), np.array([[2.0, 4.0, 0.0]]), 0, 1.0)
FORCE = np.array([[1.0, 2.0], [0.0, 0.0], [-3.0, 0.5]])


@pytest.fixture(autouse=True)
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    as_plain_python(monkeypatch, kernel)


def apart(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Force, offset and slip of bristles that do not touch."""
    return np.zeros((count, 2)), np.full((count, 2), np.nan), np.zeros(count, bool)


def by_sums(which: list[int]) -> np.ndarray:
    """Displacement of bristle j by the force on k, which the row of j − k says, [j, 2]."""
    moved = np.zeros((3, 2))
    for j in range(3):
        for k in which:
            xx, yy, xy = INFLUENCE[2 + j - k]
            moved[j] += [xx * FORCE[k, 0] + xy * FORCE[k, 1], xy * FORCE[k, 0] + yy * FORCE[k, 1]]
    return moved


def test_all_bristles_are_displaced_by_all_forces() -> None:
    np.testing.assert_allclose(kernel.displaced(PAD, FORCE), by_sums([0, 1, 2]), rtol=1e-14)


def test_a_patch_knows_how_its_bristles_move_one_another() -> None:
    patch = kernel.patch_of(PAD, np.array([0, 2]), FORCE)
    np.testing.assert_allclose(patch.moved.T, by_sums([0, 2])[[0, 2]], rtol=1e-14)
    np.testing.assert_array_equal(patch.near[:, 0, 1], INFLUENCE[4])  # on the last by the first
    np.testing.assert_array_equal(patch.near[:, 1, 0], INFLUENCE[0])
    moved = patch.moved.copy()
    kernel.spread(patch.near, 1, 0.1, -0.2, moved)
    np.testing.assert_allclose((moved - patch.moved)[:, 0], [0.2 * 0.1 + 0.01 * 0.2, -0.01 * 0.1 - 0.5 * 0.2])


def test_a_bristle_holds_the_object_where_it_now_is() -> None:
    """At (10, 20), turned by 0.1: its place (3, 0) goes to (10, 20.3)."""
    patch, offset = kernel.patch_of(PAD, np.array([1, 2]), FORCE), np.full((3, 2), np.nan)
    kernel.put(PAD, patch, np.array([10.0, 20.0, 0.1]), 1, offset)
    np.testing.assert_allclose(offset[2], [10.0 - patch.moved[0, 1], 20.3 - patch.moved[1, 1]])
    kernel.put(PAD, patch, np.array([10.0, 20.0, 0.1]), 0, offset)
    np.testing.assert_allclose(offset[1], [10.05 - patch.moved[0, 0], 20.2 - patch.moved[1, 0]])
    assert np.isnan(offset[0]).all()


def test_what_loses_its_limit_is_freed() -> None:
    force, offset, slips = FORCE.copy(), np.zeros((3, 2)), np.ones(3, bool)
    kernel.leave(np.array([1.0, 0.0, 1.0]), force, offset, slips)
    assert force[1].tolist() == [0.0, 0.0]
    assert np.isnan(offset[1]).all()
    assert slips.tolist() == [True, False, True]
    np.testing.assert_array_equal(force[[0, 2]], FORCE[[0, 2]])


def test_a_bristle_sticks_up_to_its_limit_and_is_carried_along_beyond() -> None:
    """Of 2 m/N along x and 4 along y; the object goes by 0.6 and 1.6, which asks for 0.3 and 0.4 N."""
    force, offset, slips = apart(1)
    kernel.relax(ALONE, np.ones(1), np.array([5.0, 7.0, 0.0]), force, offset, slips, 3)
    np.testing.assert_array_equal(offset, [[5.0, 7.0]])
    kernel.relax(ALONE, np.ones(1), np.array([5.6, 8.6, 0.0]), force, offset, slips, 3)
    np.testing.assert_allclose(force, [[0.3, 0.4]])
    assert not slips[0]
    kernel.relax(ALONE, np.full(1, 0.25), np.array([5.6, 8.6, 0.0]), force, offset, slips, 3)
    np.testing.assert_allclose(force, [[0.15, 0.2]])  # half of it, and it slips by the rest
    np.testing.assert_allclose(offset, [[5.3, 7.8]])
    assert slips[0]


def test_three_that_stick_share_a_motion_as_their_influence_says() -> None:
    """Gauss-Seidel ends where the surface goes with the object, here turned by 1e-3 as well."""
    force, offset, slips = apart(3)
    kernel.relax(PAD, np.full(3, 2.0), np.zeros(3), force, offset, slips, 1)
    kernel.relax(PAD, np.full(3, 2.0), np.array([1.0, -2.0, 1e-3]), force, offset, slips, 200)
    expected = np.stack([1.0 - 1e-3 * PAD.y, -2.0 + 1e-3 * PAD.x], axis=-1)
    np.testing.assert_allclose(kernel.displaced(PAD, force), expected, rtol=0, atol=8.0 * WORLD.rest)
    assert not slips.any()


def test_pressure_is_hertzs_and_adds_up() -> None:
    """Under 8 N the radius is 2: √(1 − r²/4) at r = 0, 1 and √3."""
    pad = PAD._replace(x=np.array([0.0, 1.0, 0.0]), y=np.array([0.0, 0.0, np.sqrt(3.0)]), pressing=1.0)
    shape = np.array([1.0, np.sqrt(0.75), 0.5])
    np.testing.assert_allclose(kernel.pressures(pad, 8.0), 8.0 * shape / shape.sum())
    assert not kernel.pressures(pad, 0.0).any()
    assert not kernel.pressures(pad, -1.0).any()
    assert not kernel.pressures(PAD._replace(pressing=1e-9), 8.0).any()  # none of them within


def test_depth_is_hertzs_within_and_outside_the_contact() -> None:
    """Johnson (3.42) on a ball of 10 with a radius of 2: a²/R in the middle, a²/2R at the edge."""
    pad = PAD._replace(x=np.array([0.0, 2.0, 2.0 * (1.0 + 1e-9)]), y=np.zeros(3))
    np.testing.assert_allclose(kernel.depths(pad, 8.0, 10.0), [0.4, 0.2, 0.2], rtol=1e-6)
    far = kernel.depths(pad._replace(x=np.full(3, 200.0)), 8.0, 10.0)
    np.testing.assert_allclose(far, 4.0 * 2.0**3 / (3.0 * np.pi * 10.0 * 200.0), rtol=1e-4)  # of a point load


def test_an_object_feels_both_fingers_in_the_frame_of_the_first() -> None:
    one = kernel.on_object(PAD, np.array([0, 2]), FORCE, 1.0)
    np.testing.assert_allclose(one, [-2.0, 2.5, 1.0 * 2.0 - 0.5 * 1.0 + 3.0 * 0.5])
    np.testing.assert_allclose(kernel.on_object(PAD, np.array([0, 2]), FORCE, -1.0), [-2.0, -2.5, -3.0])


STEPS = Steps(number=1, length=0.1, sweeps=50, lag=0.2, gel_time=0.0, mass=2.0, inertia=0.5)


def advanced(fingers: int, command: float, motion: np.ndarray, steps: Steps = STEPS, normal: float = 0.0) -> tuple:
    """After some steps under a load that grows from nothing to (4, -2, 1); each finger has one bristle."""
    found, held = motion.copy(), np.full(fingers, normal)
    bristles = Bristles(*(np.stack([each] * fingers) for each in apart(1)))
    load = np.array([[0.0] * 6, [4.0, -2.0, 1.0, 0.0, 0.0, 0.0]])
    kernel.advance(ALONE, steps, np.ones((fingers, 1)), np.full(fingers, command), load, held, found, bristles)
    return found, held, bristles


def test_a_gripper_follows_its_command_with_its_lag() -> None:
    _, normal, _ = advanced(1, 10.0, np.zeros((2, 6)), normal=2.0)
    assert normal[0] == pytest.approx(10.0 - 8.0 * np.exp(-0.5))


def test_what_no_finger_holds_is_driven_by_the_load() -> None:
    """Two steps of which the first has half of the load: velocities by mass and inertia, places by these."""
    found, _, _ = advanced(1, 0.0, np.array([[0.0] * 6, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]]), STEPS._replace(number=2))
    change = 0.1 * np.array([2.0, -1.0, 2.0])
    np.testing.assert_allclose(found[1, :3], np.array([1.0, 0.0, 0.0]) + 0.5 * change + change)
    np.testing.assert_allclose(found[0, :3], 0.1 * np.array([2.0, 0.0, 0.0]) + 0.05 * change)
    assert not found[:, 3:].any()


def test_two_fingers_that_hold_hold_back_alike() -> None:
    """Both stick with 8 N before them; the object goes on by (0.1, 0.2), and each meets (0.05, 0.05) N."""
    motion = np.zeros((2, 6))
    start, normal, bristles = advanced(2, 8.0, motion, normal=8.0)
    load, found = np.zeros((2, 6)), np.array([[0.0] * 6, [1.0, 2.0, 0.0, 0.0, 0.0, 0.0]])
    kernel.advance(ALONE, STEPS, np.ones((2, 1)), np.full(2, 8.0), load, normal, found, bristles)
    np.testing.assert_allclose(found[0], [0.1, 0.2, 0.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(bristles.force[:, 0], [[0.05, 0.05], [0.05, -0.05]])  # y is turned round
    np.testing.assert_allclose(found[1, :3], np.array([1.0, 2.0, 0.0]) - 0.1 / 2.0 * np.array([0.1, 0.1, 0.0]))
    assert start.shape == (2, 6)
