"""A step of method ``forces_only``: forces followed, and looked at once the load has changed."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import borrowed, compiled
from slipcore.detection.filter.loading import low_pass
from slipcore.detection.forces_only.sharing import (
    Loads,
    Sharing,
    compare,
    length,
    log_sum,
    sideways,
    slip_density,
    stick_density,
)
from slipcore.detection.forces_only.tuning import Considered, ForcesTuning, forces_tuning
from slipcore.detection.shared.records import Decision
from slipcore.frames import BoolArray, FloatArray

RAYLEIGH_MEAN = math.sqrt(math.pi / 2.0)
"""Mean length of a vector of two components with normal noise of 1."""


class ForcesState(NamedTuple):
    """What is remembered: low-passed forces of the elements, ``normal`` [n, m] and ``tangential`` [n, m, 3] N, now and
    when the load was last looked at; which elements touched then; ``log_odds`` of slip [n, m] by changes
    of the load; log weights [g] of friction coefficients; and the probability of slip [n, m].
    """

    normal: FloatArray
    tangential: FloatArray
    last_normal: FloatArray
    last_tangential: FloatArray
    touched: BoolArray
    log_odds: FloatArray
    friction: FloatArray
    probability: FloatArray


class MeasuredForces(NamedTuple):
    """A frame as these kernels take it, see ``interface.ObservedFrame``; ``noise`` of forces, N, NaN while unknown."""

    interval: float
    position: FloatArray
    force: FloatArray
    pressing: FloatArray
    normal: FloatArray
    contact: BoolArray
    stays: BoolArray
    noise: float


@compiled
def step_forces(
    state: ForcesState, frame: MeasuredForces, considered: Considered, after: ForcesState, decision: Decision
) -> None:
    """Fill the state ``after`` and the decision; what it is given may be plain tuples of the same entries."""
    before, seen, known = ForcesState(*borrowed(state)), MeasuredForces(*borrowed(frame)), Considered(*considered)
    kept, decided = ForcesState(*borrowed(after)), Decision(*borrowed(decision))
    tuning = forces_tuning(known.settings)
    gain = low_pass(seen.interval, tuning.force_smoothing)
    noise = 0.0 if math.isnan(seen.noise) else seen.noise * math.sqrt(gain / (2.0 - gain))
    follow(before, seen, gain, kept)
    if not seen.contact.any():
        kept.friction[:] = known.prior
    places = places_of(seen.stays)
    if len(places):
        now = loads_at(places, seen.position, kept.normal, kept.tangential)
        last = loads_at(places, seen.position, kept.last_normal, kept.last_tangential)
        if min(now.normal.sum(), last.normal.sum()) > 0.0:
            moved = load_change(last, now, noise, tuning)
            if moved > tuning.least_load_change:
                look(places, last, now, noise, moved, known, tuning, kept)
    decide_by(kept.probability, tuning.threshold, decided)


@compiled
def decide_by(probability: FloatArray, threshold: float, decision: Decision) -> None:
    """Slip above the threshold, and the probability with its odds shifted to ½ there."""
    odds = (1.0 - threshold) / threshold
    n, m = probability.shape
    for i in range(n):
        for j in range(m):
            p = probability[i, j]
            decision.slip[i, j], decision.probability[i, j] = p > threshold, p * odds / (1.0 - p + p * odds)


@compiled
def follow(before: ForcesState, seen: MeasuredForces, gain: float, kept: ForcesState) -> None:
    """Low-pass the forces of what stays in contact, and begin anew with what has just touched."""
    kept.touched[:] = seen.contact
    kept.friction[:] = before.friction
    none = not seen.contact.any()
    n, m = seen.contact.shape
    for i in range(n):
        for j in range(m):
            anew, share = not (seen.stays[i, j] and before.touched[i, j]), 0.0 if none else 1.0
            pressing = share * max(seen.pressing[i, j], 0.0)
            last = pressing if anew else before.normal[i, j]
            kept.normal[i, j] = last + gain * (pressing - last)
            kept.last_normal[i, j] = pressing if anew else before.last_normal[i, j]
            for a in range(3):
                along = share * (seen.force[i, j, a] + seen.pressing[i, j] * seen.normal[i, j, a])
                last = along if anew else before.tangential[i, j, a]
                kept.tangential[i, j, a] = last + gain * (along - last)
                kept.last_tangential[i, j, a] = along if anew else before.last_tangential[i, j, a]
            kept.log_odds[i, j] = 0.0 if anew else before.log_odds[i, j]
            kept.probability[i, j] = 0.0 if anew else before.probability[i, j]


@compiled
def places_of(stays: BoolArray) -> NDArray[np.int64]:
    """Rows and columns [k, 2] of the elements that stay in contact."""
    n, m = stays.shape
    places, count = np.empty((n * m, 2), np.int64), 0
    for i in range(n):
        for j in range(m):
            if stays[i, j]:
                places[count, 0], places[count, 1] = i, j
                count += 1
    return places[:count]


@compiled
def loads_at(places: NDArray[np.int64], position: FloatArray, normal: FloatArray, tangential: FloatArray) -> Loads:
    """Forces on the elements at these rows and columns, [k, 2]."""
    count = len(places)
    loads = Loads(np.empty((count, 2)), np.empty(count), np.empty((count, 3)))
    for e in range(count):
        i, j = places[e]
        loads.place[e, 0], loads.place[e, 1] = position[i, j, 0], position[i, j, 1]
        loads.normal[e] = normal[i, j]
        for a in range(3):
            loads.tangential[e, a] = tangential[i, j, a]
    return loads


@compiled
def load_change(before: Loads, now: Loads, noise: float, tuning: ForcesTuning) -> float:
    """How far the forces of elements have gone, as a share of the normal force and beyond what noise makes of it."""
    total, count, change = now.normal.sum(), len(now.normal), np.empty(3)
    gone = abs(total - before.normal.sum())
    for e in range(count):
        for a in range(3):
            change[a] = now.tangential[e, a] - before.tangential[e, a]
        gone += length(change)
    return float((gone - tuning.load_deviations * RAYLEIGH_MEAN * math.sqrt(2.0) * noise * count) / total)


@compiled
def look(
    places: NDArray[np.int64],
    before: Loads,
    now: Loads,
    noise: float,
    moved: float,
    known: Considered,
    tuning: ForcesTuning,
    kept: ForcesState,
) -> None:
    """What a change of the load says of the friction, and of each element that stays at these ``places``."""
    seen, grid = compare(before, now, noise, tuning), known.friction
    level = levels(seen.ratio, grid, tuning)
    stick, slip = stick_density(seen, tuning), slip_density(seen, grid, tuning)
    learn_friction(seen, level, stick, slip, moved, known, tuning, kept.friction)
    whole = log_sum_of(kept.friction)
    weight = np.empty(len(grid))
    pressed, least = 0.0, sticking_friction(before, now, noise, tuning)
    for k in range(len(grid)):
        weight[k] = math.exp(kept.friction[k] - whole)
        pressed += weight[k] if grid[k] > least else 0.0
    last = kept.log_odds.copy()
    kept.last_normal[:], kept.last_tangential[:] = kept.normal, kept.tangential
    kept.log_odds[:] = 0.0
    kept.probability[:] = 0.0
    for e in range(len(places)):
        i, j = places[e]
        gained = log_sum_of(kept.friction + slip[:, e]) - whole - stick[e]
        gained = log_odds_told(seen.expected[e], seen.falls[e], gained, tuning)
        log_odds = last[i, j] * math.exp(-moved / tuning.memory) + gained
        log_odds = min(max(log_odds, -tuning.largest_log_odds), tuning.largest_log_odds)
        log_odds -= tuning.pressed_log_odds * pressed
        kept.log_odds[i, j] = max(log_odds, -tuning.pressed_log_odds)
        for k in range(len(grid)):
            kept.probability[i, j] += weight[k] / (1.0 + math.exp(-level[k, e] - kept.log_odds[i, j]))


@compiled
def levels(ratio: FloatArray, friction: FloatArray, tuning: ForcesTuning) -> FloatArray:
    """Log-odds [g, k] of slip that force ratios [k] give by each friction [g]."""
    level, most = np.empty((len(friction), len(ratio))), tuning.largest_level_odds
    for k in range(len(friction)):
        for e in range(len(ratio)):
            odds = (ratio[e] / friction[k] - tuning.slip_level) / tuning.slip_level_width
            level[k, e] = min(max(odds, -most), most)
    return level


@compiled
def log_sum_of(logs: FloatArray) -> float:
    """Logarithm of the sum of numbers of which the logarithms are given."""
    largest, total = float(logs.max()), 0.0
    for k in range(len(logs)):
        total += math.exp(logs[k] - largest)
    return largest + math.log(total)


@compiled
def log_odds_told(expected: float, falls: bool, gained: float, tuning: ForcesTuning) -> float:
    """Log-odds of slip of an element from a change of the load: what the part says where it grows, and stick where it
    is taken back.
    """
    if expected > tuning.least_change:
        return tuning.part_weight * min(max(gained, -tuning.largest_gain), tuning.largest_gain)
    return -tuning.taken_back if expected < -tuning.least_change and falls else 0.0


@compiled
def learn_friction(
    seen: Sharing,
    level: FloatArray,
    stick: FloatArray,
    slip: FloatArray,
    moved: float,
    known: Considered,
    tuning: ForcesTuning,
    friction: FloatArray,
) -> None:
    """Change log weights [g] by elements of whose load more is known; what was known fades by the way moved."""
    kept = math.exp(-moved / tuning.friction_memory)
    for k in range(len(friction)):
        log_likelihood = 0.0
        for e in range(len(stick)):
            if seen.expected[e] > tuning.least_change:
                at_limit = -log_sum(0.0, -level[k, e])
                log_likelihood += log_sum(at_limit + slip[k, e], at_limit - level[k, e] + stick[e])
            above = max(seen.ratio[e] / known.friction[k] - 1.0, 0.0)
            if above > 0.0:
                above /= math.hypot(tuning.excess, seen.deviation[e] / known.friction[k])
                log_likelihood -= 0.5 * above * above
        friction[k] = known.prior[k] + (friction[k] - known.prior[k]) * kept + tuning.friction_weight * log_likelihood
    friction -= friction.max()


@compiled
def sticking_friction(before: Loads, now: Loads, noise: float, tuning: ForcesTuning) -> float:
    """Friction above which all stick again, for the normal force grows so much faster than the tangential one
    (Mindlin and Deresiewicz, 1953); infinite where it does not grow beyond noise.
    """
    total = now.normal.sum()
    grows = total - before.normal.sum()
    least = tuning.pressing_deviations * noise * math.sqrt(2.0 * len(now.normal))
    if grows <= max(least, tuning.least_change * total):
        return math.inf
    return float(sideways(before, now) / (tuning.pressing_share * grows))
