"""Contact patches of a whole log."""

from dataclasses import fields, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from slipcore.defaults import PATCHES, PatchOptions, choose_options
from slipcore.frames import BoolArray, FloatArray, GraspLog
from slipcore.patch.motion import PatchFrames, motion_over_markers
from slipcore.patch.plateau import find_plateaus
from slipcore.patch.pose import lattice_pose
from slipcore.patch.regimes import regimes
from slipcore.patch.regions import follow_regions, widened
from slipcore.patch.resultants import Resultants, resultants
from slipcore.patch_record import Patch
from slipcore.surface.log_normals import normals_of

Scalar = TypeVar("Scalar", bound=np.generic)


def follow_patches(log: GraspLog, contact: BoolArray, slip: BoolArray, **options: float) -> tuple[Patch, ...]:
    """The contact patches of a log, in order of their first touch.

    ``contact``, ``slip`` [t, n, m]: what a detector says of its elements; ``options``: see ``defaults.PatchOptions``.
    Raises ``InvalidInput`` for an option that does not exist or is out of its range.
    """
    chosen = choose_options(PatchOptions, options)
    labels, count = follow_regions(contact)
    pressing = np.maximum(-(log.displacement if log.force is None else log.force)[..., 2], 0.0)
    normals = None if log.force is None else normals_of(log)
    wide = labels if log.force is None else widened(labels, chosen.margin)
    return tuple(
        _follow(log, normals, pressing, slip, (labels == number, wide == number), chosen)
        for number in _lasting_and_loaded(labels, count, pressing)
    )


def _lasting_and_loaded(labels: NDArray[np.int64], count: int, pressing: FloatArray) -> list[int]:
    """Numbers of the patches that last, and bear a share of the load."""
    frames = len(labels)
    key = (labels + 1 + (count + 1) * np.arange(frames)[:, None, None]).ravel()
    borne = np.bincount(key, pressing.ravel(), frames * (count + 1)).reshape(frames, count + 1)[:, 1:]
    lasts = (borne > 0.0).sum(axis=0) >= PATCHES.least_frames
    least = PATCHES.least_load_share * borne.sum(axis=1).max(initial=0.0)
    return [int(number) for number in np.flatnonzero(lasts & (borne.max(axis=0, initial=0.0) > least))]


def _follow(
    log: GraspLog,
    normals: FloatArray | None,
    pressing: FloatArray,
    slip: BoolArray,
    regions: tuple[BoolArray, BoolArray],
    options: PatchOptions,
) -> Patch:
    """One patch, by its ``regions`` [t, n, m] without and with the margin, from its first frame to its last."""
    present = np.flatnonzero(regions[0].any(axis=(1, 2)))
    span = slice(int(present[0]), int(present[-1]) + 1)
    patch, wide = (region[span] for region in regions)
    pitch = float(np.sqrt(log.element_area))
    object_pose = None if log.object_pose is None else log.object_pose[span]
    kinematics = PatchFrames(log.time[span], log.position, log.displacement[span], object_pose, pitch)
    weight = np.where(patch, pressing[span], 0.0)
    pose, gyration = lattice_pose(weight, log.position, options.least_anisotropy)
    motion = motion_over_markers(kinematics, weight, pose, gyration, options)
    resultant = _no_resultants(len(patch))
    if log.force is not None and normals is not None:
        resultant = resultants(
            log.force[span], normals[span], log.position + kinematics.displacement, wide, options.kernel_width
        )
    held = resultant.normal_force >= options.least_force_share * resultant.normal_force.max()
    plateaus = find_plateaus(
        kinematics.time, motion, resultant.load_ratio, resultant.tangential_force, held, pitch, options
    )
    regime = regimes(patch, slip[span], motion, plateaus, options)
    found = Patch(pose, motion.speed, regime, *resultant, plateaus.pivoting | plateaus.sliding)
    return _over_whole_log(found, span, len(log))


def _no_resultants(frames: int) -> Resultants:
    return Resultants(np.zeros(frames), np.full((frames, 2), np.nan), *(np.full(frames, np.nan) for _ in range(3)))


def _over_whole_log(found: Patch, span: slice, frames: int) -> Patch:
    """The patch of some frames, as of the whole log."""
    arrays = {entry.name: _padded(getattr(found, entry.name), span, frames) for entry in fields(found)}
    return replace(found, **arrays)


def _padded(part: NDArray[Scalar], span: slice, frames: int) -> NDArray[Scalar]:
    """An array [k, ...] of the frames in ``span`` as one of all, [t, ...]: before and after it nothing is known."""
    nothing = {"f": np.nan, "b": False, "U": "none"}[part.dtype.kind]
    whole = np.full((frames, *part.shape[1:]), nothing, part.dtype)
    whole[span] = part
    return whole
