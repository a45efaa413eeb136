"""How an object moves over the markers under a contact patch."""

from typing import NamedTuple

import numpy as np

from slipcore.defaults import PATCHES, PatchOptions
from slipcore.frames import BoolArray, FloatArray
from slipcore.patch.local_rates import local_rates


class PatchFrames(NamedTuple):
    """What a log has of some frames: ``time`` [t] s, ``position`` [n, m, 3] m of markers at rest, ``displacement``
    [t, n, m, 3] m, ``object_pose`` [t, 3] m, m, rad or None; ``pitch`` m of the lattice.
    """

    time: FloatArray
    position: FloatArray
    displacement: FloatArray
    object_pose: FloatArray | None
    pitch: float


class Motion(NamedTuple):
    """Of the object over the markers: ``velocity`` [t, 2] m/s at the patch's centre, and ``turning`` [t] m/s, its
    rotation times the patch's radius of gyration; ``travels`` and ``turns`` [t]: where they are more than their errors
    and than can be resolved; ``wanders`` [t]: where the patch itself travels on the lattice.
    """

    velocity: FloatArray
    turning: FloatArray
    travels: BoolArray
    turns: BoolArray
    wanders: BoolArray

    @property
    def speed(self) -> FloatArray:
        """Mean of the speed over the patch, about the root of the mean square: [t] m/s."""
        return np.asarray(np.hypot(np.hypot(*self.velocity.T), np.nan_to_num(self.turning)))


def motion_over_markers(
    kinematics: PatchFrames, weight: FloatArray, pose: FloatArray, gyration: FloatArray, options: PatchOptions
) -> Motion:
    """By the object's pose where it is known; else by that of the patch on the lattice, [t, 3] m, m, rad.

    ``weight`` [t, n, m] of the patch's elements, ``gyration`` [t] m. A patch goes with its object unless this rolls.
    """
    rate, error = local_rates(kinematics.time, pose, options.window)
    of_patch = _motion(rate, error, gyration, options.least_travel * kinematics.pitch / options.window)
    if kinematics.object_pose is None:
        return of_patch
    markers, centre = _marker_motion(kinematics, weight)
    (carried, its_error), (own, error) = (
        local_rates(kinematics.time, each, options.window) for each in (kinematics.object_pose, markers)
    )
    arm = centre - kinematics.object_pose[:, :2]
    at_centre = np.column_stack([carried[:, 0] - carried[:, 2] * arm[:, 1], carried[:, 1] + carried[:, 2] * arm[:, 0]])
    rate = np.column_stack([at_centre, carried[:, 2]]) - own
    of_object = _motion(rate, np.hypot(its_error, error), gyration, options.least_speed)
    return of_object._replace(wanders=of_patch.travels)


def _motion(rate: FloatArray, error: FloatArray, gyration: FloatArray, least: float) -> Motion:
    velocity, turning = rate[:, :2], rate[:, 2] * gyration
    speed, spin = np.hypot(*velocity.T), np.abs(turning)
    travels = speed > np.maximum(least, PATCHES.significant * np.hypot(error[:, 0], error[:, 1]))
    turns = spin > np.maximum(least, PATCHES.significant * error[:, 2] * gyration)
    return Motion(velocity, turning, travels, turns, travels)


def _marker_motion(kinematics: PatchFrames, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rigid motion of the markers under a patch since rest, [t, 3] m, m, rad (weighted planar Procrustes problem), and
    their centre [t, 2] m.
    """
    total = weight.sum(axis=(1, 2))
    share = weight / np.where(total > 0.0, total, np.nan)[:, None, None]
    rest, moved = kinematics.position[..., :2], kinematics.position[..., :2] + kinematics.displacement[..., :2]
    middle = np.tensordot(share, rest, axes=([1, 2], [0, 1]))
    centre = (share[..., None] * moved).sum(axis=(1, 2))
    before, after = rest - middle[:, None, None], moved - centre[:, None, None]
    cross = (share * (before[..., 0] * after[..., 1] - before[..., 1] * after[..., 0])).sum(axis=(1, 2))
    dot = (share * (before * after).sum(axis=-1)).sum(axis=(1, 2))
    return np.column_stack([centre - middle, np.arctan2(cross, dot)]), centre
