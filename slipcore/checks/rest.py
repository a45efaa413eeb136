"""When nothing touches: the frames in which a log's markers have not moved yet, or no longer are."""

import numpy as np

from slipcore.checks.subject import Subject
from slipcore.frames import BoolArray, FloatArray


def frames_at_rest(seen: Subject) -> BoolArray:
    """Frames in which the markers of the contact are where they were without it, [t]; none where too few are so.

    Markers that are seen in the plane only stay where they are when they are pressed: of their frames those count in
    which elements press least.
    """
    none, touched = np.zeros(len(seen.log), bool), touched_elements(seen)
    if not touched.any():
        return none
    moved = np.linalg.norm(seen.log.displacement[:, touched].mean(axis=1), axis=-1)
    rest = moved <= seen.limits.rest_share * moved.max(initial=0.0)
    if seen.forces is not None and not seen.log.displacement[..., 2].any():
        rest = _least_pressed(seen, rest, touched)
    return rest if moved.any() and np.count_nonzero(rest) >= seen.limits.least_rest else none


def touched_elements(seen: Subject) -> BoolArray:
    """Elements that touch in most of the frames held, [n, m]."""
    if not seen.held.any():
        return np.zeros(seen.log.grid, bool)
    return np.asarray(seen.history.contact[seen.held].mean(axis=0) > 0.5)


def passing_noise(seen: Subject, series: FloatArray) -> float:
    """Standard deviation of one value of series [t, axes, k] from frame to frame; 0 where too few frames show it."""
    from slipcore.noise import estimate_noise  # with its compiler, which the names of findings do without

    return float(np.nan_to_num(estimate_noise(seen.log.time, series)))


def _least_pressed(seen: Subject, rest: BoolArray, touched: BoolArray) -> BoolArray:
    """Of these frames, [t], those with the least force on these elements, [n, m], to a share of it or to its noise."""
    assert seen.forces is not None
    pressing = seen.forces.pressing[:, touched]
    total = pressing.sum(axis=1)
    least = total[rest].min(initial=np.inf)
    noise = passing_noise(seen, pressing[:, None]) * np.sqrt(pressing.shape[1])
    within = max(seen.limits.rest_share * (total.max() - least), seen.limits.rest_deviations * noise)
    return np.asarray(rest & (total <= least + within))
