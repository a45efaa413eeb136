"""Patches of long logs: each is of its own frames alone."""

import tracemalloc

import numpy as np

from slipcore import GraspLog
from slipcore.patch.following import follow_patches
from slipcore.patch.regimes import slips_as_a_whole

TOUCHES, PERIOD, TOUCHED = 400, 20, 8
FRAMES = TOUCHES * PERIOD


def touching_again_and_again() -> tuple[GraspLog, np.ndarray]:
    """2 × 2 elements that touch for some frames of each period, and where they do."""
    contact = np.zeros((FRAMES, 2, 2), bool)
    contact[np.arange(FRAMES) % PERIOD < TOUCHED] = True
    force = np.where(contact[..., None], [0.05, 0.0, -0.5], 0.0)
    rest = np.stack([*np.meshgrid([0.0, 1e-3], [0.0, 1e-3], indexing="ij"), np.zeros((2, 2))], axis=-1)
    return GraspLog(np.arange(FRAMES) / 30.0, rest, np.zeros(force.shape), 1e-6, force=force), contact


def test_each_touch_is_a_patch_of_its_own_frames() -> None:
    log, contact = touching_again_and_again()
    patches = follow_patches(log, contact, np.zeros_like(contact))
    assert [patch.frames for patch in patches] == [slice(first, first + TOUCHED) for first in range(0, FRAMES, PERIOD)]
    for patch in patches[:: TOUCHES // 4]:
        np.testing.assert_allclose(patch.normal_force, 2.0, rtol=1e-12)  # four elements of half a newton
        np.testing.assert_allclose(patch.load_ratio, 0.1, rtol=1e-3)
    assert not slips_as_a_whole(patches, FRAMES).any()


def test_memory_goes_with_the_length_of_the_log_alone() -> None:
    """One array of all frames for each touch took 8 GiB for 300,000 frames, of a file of 1 MB."""
    log, contact = touching_again_and_again()
    tracemalloc.start()
    follow_patches(log, contact, np.zeros_like(contact))
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 2_000 * FRAMES
