"""Forces of a whole log that do not go with its displacement: late or early ones, and normal force leaking sideways.

Summed over the lattice, forces on an elastic gel change as displacement does, whatever sticks or slips: along the
normal ΔΣF = k ΔΣu, along the surface and about the normal likewise. How large k is, and how well that holds, differs
from gel to gel. So forces are changed only where that makes the sums of this very log agree far better.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.ndimage import label

from slipcore.defaults import CONTRADICTION
from slipcore.finding import Finding
from slipcore.frames import FloatArray, GraspLog

NORMAL, ALONG, ABOUT = slice(2, 3), slice(0, 2), slice(3, 4)
"""Components of the sums that have a stiffness of their own."""

LATE, EARLY = "late forces", "early forces"
"""Findings, by whether forces come after or before the displacement that they go with."""


class Changes(NamedTuple):
    """How sums over the lattice change from one ``step``, s, to the next: of ``displacement`` m and ``force`` N along
    x, y, z, and their moment about z over the lattice's radius of gyration, [k, 4] each.
    """

    step: float
    displacement: FloatArray
    force: FloatArray


def agreeing(log: GraspLog) -> tuple[GraspLog, tuple[Finding, ...]]:
    """The log with forces that go with its displacement, and what was done for that: mostly the same, and nothing."""
    if log.force is None or not log.has_displacement or len(log) < CONTRADICTION.least_frames:
        return log, ()
    found = []
    if lag := lag_of_forces(changes_of(log)):
        log = brought_forward(log, lag)
        name, order = (LATE, "after") if lag > 0.0 else (EARLY, "before")
        evidence = f"forces come {abs(lag):.2f} s {order} the displacement that they go with"
        remedy = "give both the times at which they were measured"
        found.append(Finding(name, f"{evidence}; slip is found with both at once", remedy))
    leak = crosstalk_of(slow_changes_of(log))
    if leak.any() and not _leaves_the_lattice(log):
        assert log.force is not None
        force = log.force.copy()
        force[..., :2] += leak * force[..., 2:]
        log = replace(log, force=force)
        evidence = f"{leak[0]:.2g} and {leak[1]:.2g} of the normal force appear along x and y without displacement"
        found.append(Finding("crosstalk", f"{evidence}; slip is found without that", "calibrate the sensor"))
    return log, tuple(found)


def changes_of(log: GraspLog, least_step: float = CONTRADICTION.least_step) -> Changes:
    """How the log's sums change, in means over two steps of even length; empty where most of it is gaps."""
    step = max(float(np.median(np.diff(log.time))), least_step)
    count = int((log.time[-1] - log.time[0]) / step) - 1
    assert log.force is not None
    if count > CONTRADICTION.most_steps * len(log):
        return Changes(step, np.zeros((0, 4)), np.zeros((0, 4)))
    middle = log.time[0] + step * np.arange(1, count + 1)
    return Changes(step, *(_changes(log, field, middle, step) for field in (log.displacement, log.force)))


def _changes(log: GraspLog, field: FloatArray, middle: FloatArray, step: float) -> FloatArray:
    place = log.position[..., :2] - log.position[..., :2].mean(axis=(0, 1))
    moment = np.tensordot(field[..., 1], place[..., 0]) - np.tensordot(field[..., 0], place[..., 1])
    radius = np.sqrt((place**2).sum(axis=-1).mean())
    every = field.reshape(len(field), -1, 3)
    total = np.ones(every.shape[1]) @ every  # in a twentieth of the time of sum()
    sums = np.column_stack([total, moment / radius])
    areas = 0.5 * (sums[1:] + sums[:-1]) * np.diff(log.time)[:, None]
    integral = np.vstack([np.zeros(4), np.cumsum(areas, axis=0)])
    means = [np.interp(middle + step, log.time, each) - np.interp(middle - step, log.time, each) for each in integral.T]
    return np.diff(np.transpose(means) / (2.0 * step), axis=0)


def slow_changes_of(log: GraspLog) -> Changes:
    """The same in steps so long that noise is small beside the changes of displacement along the surface; empty where
    there are none. Noise in a column of a regression lets another, that is nearly in proportion to it, take its place.
    """
    changes = changes_of(log)
    while len(changes.force) >= CONTRADICTION.least_frames:
        along = changes.displacement[:, ALONG]
        noise = np.square(along[6:] - 2.0 * along[3:-3] + along[:-6]).mean() / 6.0  # apart enough to share no frames
        if noise <= CONTRADICTION.largest_noise * np.square(along).mean():
            return changes
        changes = changes_of(log, CONTRADICTION.coarsening * changes.step)
    return Changes(changes.step, np.zeros((0, 4)), np.zeros((0, 4)))


def _leaves_the_lattice(log: GraspLog) -> bool:
    """Whether the contact lies partly beside the elements, which then see a part of how the gel bulges alone."""
    assert log.force is not None
    borne = log.force[..., 2].sum(axis=0)
    return bool(abs(borne.sum() - borne[1:-1, 1:-1].sum()) > CONTRADICTION.largest_rim * abs(borne.sum()))


def unexplained(displacement: FloatArray, force: FloatArray) -> float:
    """Share of the changes of force [k, 4] N, squared, that no stiffness makes of those of displacement [k, 4] m."""
    left = 0.0
    for component in (NORMAL, ALONG, ABOUT):
        moved, pushed = displacement[:, component].ravel(), force[:, component].ravel()
        size = float(moved @ moved)
        stiffness = max(float(moved @ pushed) / size, 0.0) if size > 0.0 else 0.0
        left += float(((pushed - stiffness * moved) ** 2).sum())
    total = float((force**2).sum())
    return left / total if total > 0.0 else 0.0


def lag_of_forces(changes: Changes) -> float:
    """By how much forces come later than the displacement that they go with, s, negative if they come before it; 0
    where that is not clear.

    Under a load that comes again and again they go with any of several lags, and none is taken.
    """
    step, displacement, force = changes
    count = len(force)
    most = min(round(CONTRADICTION.longest_lag / step), count // 3)
    early = [unexplained(displacement[lag:], force[: count - lag]) for lag in range(most, 0, -1)]
    late = [unexplained(displacement[: count - lag], force[lag:]) for lag in range(most + 1)]
    left = np.array(early + late)
    best = int(np.argmin(left))
    near, _ = label(left < CONTRADICTION.largest_left)
    if best == most or not near[best]:
        return 0.0
    is_one = left[near != near[best]].min(initial=1.0) > left[best] + CONTRADICTION.as_good
    return step * (best - most) if is_one and _is_clear(late[0], float(left[best])) else 0.0


def _is_clear(before: float, left: float) -> bool:
    """Whether taking out a fault explains changes of force: shares of them that are unexplained ``before`` and after.

    Where hardly anything is, as without noise, the rest is what no gel does exactly, and any fault would explain it.
    """
    return left < CONTRADICTION.clearly * before and before - left > CONTRADICTION.least_explained


def brought_forward(log: GraspLog, lag: float) -> GraspLog:
    """The log with the forces that came ``lag`` seconds later; at its end, where none came, the last ones stay, and
    where ``lag`` is negative the first ones at its begin.
    """
    assert log.force is not None
    then = np.searchsorted(0.5 * (log.time[1:] + log.time[:-1]), log.time + lag)
    return replace(log, force=log.force[then])


def crosstalk_of(changes: Changes) -> FloatArray:
    """Share of the normal force that appears along x and along y without displacement, [2]; 0 where that is not clear.

    Least squares of ΔΣF = k ΔΣu + c ΔF_N along each axis, against the same without c. Of a press at a slant, where both
    columns are alike, they tell nothing.
    """
    pressing = -changes.force[:, 2]
    leak, left, without = np.zeros(2), 0.0, 0.0
    for axis in (0, 1):
        moved, pushed = changes.displacement[:, axis], changes.force[:, axis]
        if not moved.any():  # a sensor of depth alone says nothing of them
            return np.zeros(2)
        if (moved @ pressing) ** 2 > CONTRADICTION.largest_likeness * (moved @ moved) * (pressing @ pressing):
            return np.zeros(2)
        columns = np.column_stack([moved, pressing])
        found, alone = np.linalg.lstsq(columns, pushed)[0], np.linalg.lstsq(columns[:, :1], pushed)[0]
        left += float(((pushed - columns @ found) ** 2).sum())
        without += float(((pushed - columns[:, :1] @ alone) ** 2).sum())
        leak[axis] = found[1]
    total = float((changes.force[:, ALONG] ** 2).sum()) or 1.0
    clear = np.hypot(*leak) > CONTRADICTION.least_crosstalk and _is_clear(without / total, left / total)
    return leak if clear else np.zeros(2)
