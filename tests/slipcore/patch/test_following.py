"""Patches of long logs: each is of its own frames alone."""

import tracemalloc

import numpy as np

from benchmarks.calibration.patch_grasps import PIVOT, SLIDE, Setting, grasp
from slipcore import GraspLog
from slipcore.patch.following import follow_patches
from slipcore.patch.friction import contact_friction
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


def test_a_touch_tells_the_same_alone_and_between_others() -> None:
    once = grasp(PIVOT, 0.7, Setting(marker_noise=1e-6, force_noise=2e-3))
    slide = grasp(SLIDE, 0.7, Setting(marker_noise=1e-6, force_noise=2e-3))
    assert once.force is not None
    assert slide.force is not None
    parts = slide, once, slide
    force = np.concatenate([part.force for part in parts])
    displacement, normal = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("displacement", "normal")
    )
    time = np.concatenate([k * 100.0 + part.time for k, part in enumerate(parts)])
    contact = force[..., 2] < -0.02
    contact[[0, len(slide), len(slide) + len(once)]] = False
    log = GraspLog(time, once.position, displacement, once.element_area, force, normal)
    patches = follow_patches(log, contact, np.zeros_like(contact))
    middle = contact[len(slide) : len(slide) + len(once)]
    (alone,) = follow_patches(once, middle, np.zeros_like(middle))
    assert len(patches) == len(parts)
    assert alone.plateau.any()
    for name in ("pose", "speed", "tangential_force", "moment", "load_ratio", "element_force"):
        np.testing.assert_allclose(getattr(patches[1], name), getattr(alone, name), rtol=1e-6, atol=1e-9)
    for name in ("regime", "plateau"):
        np.testing.assert_array_equal(getattr(patches[1], name), getattr(alone, name))
    found = contact_friction(time, patches)
    assert found is not None
    assert found.reason.endswith("pivoting and sliding")


def test_memory_goes_with_the_length_of_the_log_alone() -> None:
    """One array of all frames for each touch took 8 GiB for 300,000 frames, of a file of 1 MB."""
    log, contact = touching_again_and_again()
    tracemalloc.start()
    follow_patches(log, contact, np.zeros_like(contact))
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 2_000 * FRAMES
