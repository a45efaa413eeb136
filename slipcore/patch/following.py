"""Contact patches of a whole log."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipcore.defaults import SMOOTHING, PatchOptions, choose_options
from slipcore.frames import BoolArray, FloatArray, GraspLog
from slipcore.noise import estimate_noise
from slipcore.noise_memory import lasting_noise_of
from slipcore.patch.motion import motion_over_markers
from slipcore.patch.plateau import find_plateaus
from slipcore.patch.pose import lattice_pose
from slipcore.patch.regimes import regimes
from slipcore.patch.regions import follow_regions, widened
from slipcore.patch.resultants import Resultants, resultants
from slipcore.patch.spans import Spans, find_spans
from slipcore.patch.sum_noise import noise_of_sums
from slipcore.patch_record import Patch
from slipcore.surface.log_normals import normals_of


def follow_patches(log: GraspLog, contact: BoolArray, slip: BoolArray, **options: float) -> tuple[Patch, ...]:
    """The contact patches of a log, in order of their first touch.

    ``contact``, ``slip`` [t, n, m]: what a detector says of its elements; ``options``: see ``defaults.PatchOptions``.
    Raises ``InvalidInput`` for an option that does not exist or is out of its range.
    """
    chosen = choose_options(PatchOptions, options)
    pressing = np.maximum(-(log.displacement if log.force is None else log.force)[..., 2], 0.0)
    spans = find_spans(*follow_regions(contact), pressing)
    return _follow(log, spans, pressing, slip, chosen) if len(spans.frame) else ()


def _follow(
    log: GraspLog, spans: Spans, pressing: FloatArray, slip: BoolArray, options: PatchOptions
) -> tuple[Patch, ...]:
    """Of all patches together: a long log of short touches has more of them than Python could look at one by one."""
    pose, gyration = lattice_pose(spans, pressing, log.position, options.least_anisotropy)
    motion = motion_over_markers(log, spans, pressing, pose, gyration, options)
    resultant, noise_frames = _resultants(log, spans, options)
    largest = np.maximum.reduceat(resultant.normal_force, spans.bounds[:-1])
    held = resultant.normal_force >= np.repeat(options.least_force_share * largest, np.diff(spans.bounds))
    load = resultant.load_ratio, resultant.tangential_force, held
    pitch = math.sqrt(log.element_area)
    plateaus = find_plateaus(log.time[spans.frame], spans.bounds, motion, *load, pitch, options)
    regime = regimes(spans, slip, motion, plateaus, options)
    fields: tuple[NDArray[Any], ...] = (pose, motion.speed, regime, *resultant, noise_frames, plateaus.any)
    limits = pairwise(spans.bounds.tolist())
    return tuple(Patch(int(spans.frame[begin]), *(field[begin:end] for field in fields)) for begin, end in limits)


def _resultants(log: GraspLog, spans: Spans, options: PatchOptions) -> tuple[Resultants, FloatArray]:
    """And in how many frames [k] in a row their noise is no less sure than in one; NaN, and 1, without forces."""
    if log.force is None:
        frames = len(spans.frame)
        unknown = (np.full(frames, np.nan) for _ in range(4))
        return Resultants(np.zeros(frames), np.full((frames, 2), np.nan), *unknown), np.ones(frames)
    wide, series = spans._replace(labels=widened(spans.labels, options.margin)), _series(log.force)
    fields = log.force, normals_of(log), log.position + log.displacement
    lasting = lasting_noise_of(log.time, series, options.window, SMOOTHING.least_force_noise)
    of_elements = lasting.gain * np.nan_to_num(estimate_noise(log.time, series))
    of_sums = noise_of_sums(log.time, *fields, wide, options.window, lasting)
    noise = np.maximum(of_elements, of_sums.noise)
    return resultants(*fields, wide, options.kernel_width, noise), of_sums.frames


def _series(force: FloatArray) -> FloatArray:
    """Components of the forces [t, n, m, 3] on elements: [t, 3, n m]."""
    return np.moveaxis(force, -1, 1).reshape(len(force), 3, -1)
