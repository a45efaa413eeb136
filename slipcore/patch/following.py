"""Contact patches of a whole log."""

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
        _follow(log, normals, pressing, slip, (labels[span] == number, wide[span] == number), span, chosen)
        for number, span in _lasting_and_loaded(labels, count, pressing)
    )


def _lasting_and_loaded(labels: NDArray[np.int64], count: int, pressing: FloatArray) -> list[tuple[int, slice]]:
    """Numbers of the patches that last, and bear a share of the load, each with its frames from the first to the last.

    Nothing here is of all frames for each patch: a long log of many touches has thousands of them.
    """
    touched = np.flatnonzero(labels.ravel() >= 0)
    element = touched // labels[0].size * count + labels.ravel()[touched]
    pairs, of_pair = np.unique(element, return_inverse=True)
    borne = np.bincount(of_pair, pressing.ravel()[touched], len(pairs))
    frame, number = np.divmod(pairs, max(count, 1))
    lasts = np.bincount(number[borne > 0.0], minlength=count) >= PATCHES.least_frames
    most, first, end = np.zeros(count), np.full(count, len(labels)), np.zeros(count, int)
    np.maximum.at(most, number, borne)
    np.minimum.at(first, number, frame)
    np.maximum.at(end, number, frame + 1)
    least = PATCHES.least_load_share * np.bincount(frame, borne).max(initial=0.0)
    kept = np.flatnonzero(lasts & (most > least))
    return [(int(each), slice(int(first[each]), int(end[each]))) for each in kept]


def _follow(
    log: GraspLog,
    normals: FloatArray | None,
    pressing: FloatArray,
    slip: BoolArray,
    regions: tuple[BoolArray, BoolArray],
    span: slice,
    options: PatchOptions,
) -> Patch:
    """One patch, by its ``regions`` [k, n, m] without and with the margin, in the frames of ``span``."""
    patch, wide = regions
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
    return Patch(span.start, pose, motion.speed, regime, *resultant, plateaus.pivoting | plateaus.sliding)


def _no_resultants(frames: int) -> Resultants:
    return Resultants(np.zeros(frames), np.full((frames, 2), np.nan), *(np.full(frames, np.nan) for _ in range(3)))
