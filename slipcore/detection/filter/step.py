"""One step of method ``filter``: two states an element, stick and slip, on its place on the object and force ratio.

An element's memory is a column of ``elements`` [13, n, m]: its slip probability; where in the object's frame it would
be if it stuck (x, y m, variance m²) and if it slipped (the same); its force low-passed (normal, tangential N); the
force ratio that it slipped at with the weight of that knowledge; and how probable it was, before this frame was seen,
that it began to slip if it stuck and that it stuck again if it slipped. What is common to all is ``body`` [14].
"""

import math
from typing import NamedTuple

import numpy as np

from slipcore.compilation import compiled, unpack
from slipcore.detection.filter.force_ratio import ratio_evidence
from slipcore.detection.filter.loading import Loading, depth_presses_home, forces_press_home, low_pass, step_loading
from slipcore.detection.filter.pose import (
    Anchors,
    Pose,
    Uncertainty,
    find_pose,
    object_motion,
    place_of_object,
    place_on_object,
    pose_at,
)
from slipcore.detection.shared.observe import same
from slipcore.frames import BoolArray, FloatArray

ROWS = 13
(
    PROBABILITY, STICK_X, STICK_Y, STICK_VARIANCE, SLIP_X, SLIP_Y, SLIP_VARIANCE, NORMAL, TANGENTIAL, RATIO, KNOWN,
    ONSET, END,
) = range(ROWS)  # fmt: skip
POSE, LOADING, FRICTION, FOLLOWS, BODY = 0, 4, 10, 12, 14
"""Where ``body`` holds the pose, the loading, the slipping force ratio (weighted sum, weight), and the share in which
the surface follows the known motion (the same); and its length."""
WILD = 25.0
"""Squared distance over its variance from where an element would be, stuck or slipping, beyond which a marker was lost
and found elsewhere: it then tells nothing, but is believed if it stays there."""
NOT_GIVEN = np.zeros(0)
FOLLOWS_PRIOR = 30.0
"""Prior weight of a surface that follows all of the motion: a share of 1 ± 0.2."""
CERTAIN = 12.0
"""Largest log-odds that one frame can bring or a filter can hold; the rest of the way out takes too long to go back."""


class Tuning(NamedTuple):
    """``FilterOptions`` as numbers for the kernels, in the same order and units."""

    noise_margin: float
    unknown_noise: float
    displacement_floor: float
    rigidity: float
    slip_share: float
    slip_share_spread: float
    creep: float
    onset_length: float
    onset_time: float
    onset_inside: float
    onset_at_front: float
    end_length: float
    end_time: float
    least_weight: float
    outlier: float
    motion_margin: float
    force_smoothing: float
    ratio_spread: float
    ratio_difference: float
    ratio_memory: float
    ratio_weight: float
    force_to_noise: float
    loading_smoothing: float
    pressing_share: float
    pressing_slope: float
    pressing_floor: float
    pressing_rate: float
    threshold: float


TUNING, THRESHOLD = len(Tuning._fields), Tuning._fields.index("threshold")


@compiled
def step_filter(
    elements: FloatArray,
    body: FloatArray,
    settings: FloatArray,
    position: FloatArray,
    start: FloatArray,
    end: FloatArray,
    force_before: FloatArray,
    force: FloatArray,
    pressing: FloatArray,
    tangential: FloatArray,
    contact: BoolArray,
    stays: BoolArray,
    given_before: FloatArray,
    given: FloatArray,
    sigma: float,
    pressing_sigma: float,
    interval: float,
    after: FloatArray,
    next_body: FloatArray,
    slip: BoolArray,
    probability: FloatArray,
) -> None:
    """Fill the last four from displacements ``start`` to ``end`` [n, m, 3] and forces [n, m, 3] and poses ``given`` [3]
    (each empty where there is none). Noise: ``sigma`` of a marker, m, and ``pressing_sigma`` of an element, N; NaN if
    unknown.
    """
    tuning = Tuning(*unpack(settings, TUNING))
    marker_noise = tuning.unknown_noise if math.isnan(sigma) else sigma
    variance = (tuning.noise_margin * marker_noise) ** 2 + tuning.displacement_floor**2
    force_sigma = 0.0 if math.isnan(pressing_sigma) else 1.1 * pressing_sigma
    before = pose_at(body[POSE], body[POSE + 1], body[POSE + 2], body[POSE + 3])
    next_body[:] = body
    if same(start, end) and not touches_anew(contact, stays):  # a frame that repeats the last tells nothing
        after[:] = elements
        after[ONSET] = after[END] = 0.0
        decide(after[PROBABILITY], tuning.threshold, slip, probability)
        return
    places = gather(elements, stays)
    anchors = anchors_of(elements, places, position, end)
    pose, doubt = step_pose(anchors, before, given_before, given, variance, tuning, next_body)
    motion_x, motion_y, noise = object_motion(anchors, before, pose, doubt, tuning.motion_margin)
    change = force_change(places, force_before, force)
    deeper = sunk(places, start, end)
    home = presses_home(
        body, anchors, (motion_x, motion_y), deeper, change, variance, force_sigma, interval, tuning, next_body
    )
    readiness = 0.0 if math.isnan(sigma) else 0.02 if home else 1.0  # nothing begins to slip before noise is known
    evidence = np.zeros(len(places))
    follow_forces(
        elements, pressing, tangential, stays, force.size > 0, low_pass(interval, tuning.force_smoothing), after
    )
    if change.size:
        weigh_forces(elements, places, force_sigma, interval, tuning, after, next_body, evidence)
    start_elements(position, end, contact, stays, pose, variance, after)
    for e in range(len(places)):
        i, j = places[e]
        near = tuning.onset_inside + tuning.onset_at_front * at_front(elements, contact, i, j)
        seen = place_on_object(pose, anchors.marker_x[e], anchors.marker_y[e])
        motion = (motion_x[e], motion_y[e])
        update_element(
            elements, i, j, motion, noise[e], readiness * near, home, evidence[e], seen, variance, interval,
            tuning, after,
        )  # fmt: skip
    decide(after[PROBABILITY], tuning.threshold, slip, probability)


@compiled
def step_pose(
    anchors: Anchors,
    before: Pose,
    given_before: FloatArray,
    given: FloatArray,
    variance: float,
    tuning: Tuning,
    next_body: FloatArray,
) -> tuple[Pose, Uncertainty]:
    """Where the object's surface is now: as what most likely sticks says, or as far as it follows the known motion."""
    pose, doubt = find_pose(anchors, before, NOT_GIVEN, variance, tuning.least_weight, tuning.rigidity, tuning.outlier)
    if given.size and given_before.size:
        known = follow_object(anchors, before, pose, doubt, given_before, given, next_body)
        pose, doubt = find_pose(anchors, before, known, variance, tuning.least_weight, tuning.rigidity, tuning.outlier)
    for value in range(4):
        next_body[POSE + value] = pose[value]
    return pose, doubt


@compiled
def follow_object(
    anchors: Anchors,
    before: Pose,
    fitted: Pose,
    doubt: Uncertainty,
    given_before: FloatArray,
    given: FloatArray,
    next_body: FloatArray,
) -> FloatArray:
    """Pose [3] of the object's surface: it follows the known motion of the body, all of it or by a share.

    The surface of a soft object stays behind its body. The share is learnt from what sticks while little slips.
    """
    if len(anchors.x) < 2:
        next_body[FOLLOWS] = next_body[FOLLOWS + 1] = FOLLOWS_PRIOR
        return given.copy()
    step = given - given_before
    step[2] = math.atan2(math.sin(step[2]), math.cos(step[2]))
    x, y = anchors.marker_x.mean(), anchors.marker_y.mean()
    dx, dy = step[0] - step[2] * (y - given_before[1]), step[1] + step[2] * (x - given_before[0])
    ax, ay = place_on_object(before, x, y)
    fx, fy = place_of_object(fitted, ax, ay)
    size = dx * dx + dy * dy
    weight = 1.0 / (doubt.place + 0.0025 * size + 1e-30)
    along = (fx - x) * dx + (fy - y) * dy
    begins = next_body[FOLLOWS + 1] < 50.0 * FOLLOWS_PRIOR
    if along > 0.15 * size and (begins or anchors.stick.mean() > 0.7):
        next_body[FOLLOWS] += weight * along
        next_body[FOLLOWS + 1] += weight * size
    known = next_body[FOLLOWS + 1]
    share = next_body[FOLLOWS] / known if known > 0.0 else 1.0
    if share > 0.9 or (1.0 - share) ** 2 * known < 9.0:
        share = 1.0
    return np.array([before.x + share * step[0], before.y + share * step[1], before.yaw + share * step[2]])


@compiled
def touches_anew(contact: BoolArray, stays: BoolArray) -> bool:
    """Whether an element touches that did not."""
    return bool((contact != stays).any())


@compiled
def gather(elements: FloatArray, stays: BoolArray) -> FloatArray:
    """Rows and columns [k, 2] of the elements that were and are in contact."""
    n, m = stays.shape
    places = np.empty((n * m, 2), np.int64)
    count = 0
    for i in range(n):
        for j in range(m):
            if stays[i, j] and math.isfinite(elements[STICK_VARIANCE, i, j]):
                places[count, 0], places[count, 1] = i, j
                count += 1
    return places[:count]


@compiled
def anchors_of(elements: FloatArray, places: FloatArray, position: FloatArray, end: FloatArray) -> Anchors:
    """What the fit of the pose needs, at these places."""
    rows = np.empty((6, len(places)))
    for e in range(len(places)):
        i, j = places[e]
        rows[0, e], rows[1, e] = elements[STICK_X, i, j], elements[STICK_Y, i, j]
        rows[2, e] = elements[STICK_VARIANCE, i, j]
        rows[3, e], rows[4, e] = position[i, j, 0] + end[i, j, 0], position[i, j, 1] + end[i, j, 1]
        rows[5, e] = 1.0 - elements[PROBABILITY, i, j]
    return Anchors(rows[0], rows[1], rows[2], rows[3], rows[4], rows[5])


@compiled
def sunk(places: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """How much deeper these places are at the end than at the start, [k] m."""
    deeper = np.empty(len(places))
    for e in range(len(places)):
        i, j = places[e]
        deeper[e] = start[i, j, 2] - end[i, j, 2]
    return deeper


@compiled
def force_change(places: FloatArray, before: FloatArray, now: FloatArray) -> FloatArray:
    """Change of force [3, k] N at these places; empty where a force is missing."""
    if before.size == 0 or now.size == 0:
        return np.empty((3, 0))
    change = np.empty((3, len(places)))
    for e in range(len(places)):
        i, j = places[e]
        for a in range(3):
            change[a, e] = now[i, j, a] - before[i, j, a]
    return change


@compiled
def presses_home(
    body: FloatArray,
    anchors: Anchors,
    motion: tuple[FloatArray, FloatArray],
    deeper: FloatArray,
    change: FloatArray,
    variance: float,
    force_sigma: float,
    interval: float,
    tuning: Tuning,
    next_body: FloatArray,
) -> bool:
    """Whether everything sticks again because the normal load grows (Mindlin and Deresiewicz).

    ``deeper`` [k] m and ``change`` of force [3, k] N, empty without forces, since the last frame.
    """
    gain = low_pass(interval, tuning.loading_smoothing)
    loading = Loading(*unpack(body[LOADING : LOADING + 6], 6))
    loading = step_loading(loading, (anchors.marker_x, anchors.marker_y), motion, deeper, change, interval, gain)
    for value in range(6):
        next_body[LOADING + value] = loading[value]
    count = len(deeper)
    if count == 0:
        return False
    if change.size > 0:
        friction = body[FRICTION] / body[FRICTION + 1] if body[FRICTION + 1] > 0.0 else 0.0
        slope = tuning.pressing_share * friction if friction > 0.0 else tuning.pressing_slope
        return forces_press_home(loading, count, force_sigma, interval, gain, slope)
    return depth_presses_home(loading, count, variance, interval, gain, tuning.pressing_slope, tuning.pressing_floor)


@compiled
def follow_forces(
    elements: FloatArray,
    pressing: FloatArray,
    tangential: FloatArray,
    stays: BoolArray,
    has_force: bool,
    gain: float,
    after: FloatArray,
) -> None:
    """Low-pass the forces of what stays in contact; begin anew with what has just touched."""
    n, m = stays.shape
    for i in range(n):
        for j in range(m):
            after[NORMAL, i, j] = after[TANGENTIAL, i, j] = after[RATIO, i, j] = after[KNOWN, i, j] = 0.0
            if has_force:
                weight = gain if stays[i, j] and elements[NORMAL, i, j] > 0.0 else 1.0
                a, b = elements[NORMAL, i, j], elements[TANGENTIAL, i, j]
                after[NORMAL, i, j] = a + weight * (max(pressing[i, j], 0.0) - a)
                after[TANGENTIAL, i, j] = b + weight * (tangential[i, j] - b)


@compiled
def weigh_forces(
    elements: FloatArray,
    places: FloatArray,
    sigma: float,
    interval: float,
    tuning: Tuning,
    after: FloatArray,
    next_body: FloatArray,
    evidence: FloatArray,
) -> None:
    """Learn the force ratio at which elements slip, each its own and the mean of all; then what it says of each."""
    gain = low_pass(interval, tuning.force_smoothing)
    memory = -math.expm1(-interval / tuning.ratio_memory)
    left = gain / (2.0 - gain)
    least = max(tuning.force_to_noise * sigma * math.sqrt(left), 1e-4)
    noise = np.zeros(len(places))
    total = weight = 0.0
    for e in range(len(places)):
        i, j = places[e]
        p, normal = elements[PROBABILITY, i, j], after[NORMAL, i, j]
        own = ratio = 0.0
        if normal > least:
            ratio = after[TANGENTIAL, i, j] / normal
            noise[e] = sigma * sigma * left * (1.0 + ratio * ratio) / (normal * normal)
            if p > 0.85:
                w = p * p / (noise[e] + 1e-3)
                total += w * ratio
                weight += w
            if p > 0.9:
                own = memory / (noise[e] + 1e-4)
        after[RATIO, i, j] = (1.0 - memory) * elements[RATIO, i, j] + own * ratio
        after[KNOWN, i, j] = (1.0 - memory) * elements[KNOWN, i, j] + own
    next_body[FRICTION] += memory * (total - next_body[FRICTION])
    next_body[FRICTION + 1] += memory * (weight - next_body[FRICTION + 1])
    if not next_body[FRICTION + 1] > 0.0:
        return
    friction = next_body[FRICTION] / next_body[FRICTION + 1]
    for e in range(len(places)):
        i, j = places[e]
        if friction > 0.0 and after[NORMAL, i, j] > least:
            ratio = after[TANGENTIAL, i, j] / after[NORMAL, i, j]
            own, known = after[RATIO, i, j], after[KNOWN, i, j]
            gained = ratio_evidence(
                ratio, noise[e], own, known, friction, memory, tuning.ratio_spread, tuning.ratio_difference
            )
            evidence[e] = min(max(gained, -6.0), 6.0) * tuning.ratio_weight * gain


@compiled
def start_elements(
    position: FloatArray,
    end: FloatArray,
    contact: BoolArray,
    stays: BoolArray,
    pose: Pose,
    variance: float,
    after: FloatArray,
) -> None:
    """Elements that have just touched stick where they are; of those that do not touch nothing is known."""
    after[STICK_X : SLIP_VARIANCE + 1] = 0.0
    n, m = contact.shape
    for i in range(n):
        for j in range(m):
            if not stays[i, j]:
                after[STICK_VARIANCE, i, j] = after[SLIP_VARIANCE, i, j] = np.inf
                after[PROBABILITY, i, j] = after[ONSET, i, j] = 0.0
                after[END, i, j] = 1.0
            if contact[i, j] and not stays[i, j]:
                x, y = place_on_object(pose, position[i, j, 0] + end[i, j, 0], position[i, j, 1] + end[i, j, 1])
                after[STICK_X, i, j], after[STICK_Y, i, j] = x, y
                after[SLIP_X, i, j], after[SLIP_Y, i, j] = x, y
                after[STICK_VARIANCE, i, j] = after[SLIP_VARIANCE, i, j] = variance


@compiled
def at_front(elements: FloatArray, contact: BoolArray, i: int, j: int) -> float:
    """Mean slip probability of the four neighbours; beyond the contact's edge everything slips."""
    n, m = contact.shape
    total = 0.0
    total += elements[PROBABILITY, i - 1, j] if i > 0 and contact[i - 1, j] else 1.0
    total += elements[PROBABILITY, i + 1, j] if i < n - 1 and contact[i + 1, j] else 1.0
    total += elements[PROBABILITY, i, j - 1] if j > 0 and contact[i, j - 1] else 1.0
    total += elements[PROBABILITY, i, j + 1] if j < m - 1 and contact[i, j + 1] else 1.0
    return 0.25 * total


@compiled
def update_element(
    old: FloatArray,
    i: int,
    j: int,
    motion: tuple[float, float],
    motion_noise: float,
    near: float,
    home: bool,
    evidence: float,
    seen: tuple[float, float],
    variance: float,
    interval: float,
    tuning: Tuning,
    new: FloatArray,
) -> None:
    """One step of the interacting-multiple-model filter of one element ``seen`` at a place in the object's frame.

    ``near``: how much more readily it begins to slip than ``onset_length`` and ``onset_time`` say.
    """
    p = old[PROBABILITY, i, j]
    size2 = motion[0] * motion[0] + motion[1] * motion[1]
    size = math.sqrt(size2)
    onset = -math.expm1(-(size / tuning.onset_length + interval / tuning.onset_time) * near)
    rate = size / tuning.end_length + interval / tuning.end_time
    if home:
        rate += tuning.pressing_rate * interval
    end = -math.expm1(-rate)
    new[ONSET, i, j], new[END, i, j] = onset, end
    slip = expected(p, onset, end)
    kept_slip, kept_stick = p * (1.0 - end) / slip, (1.0 - p) * (1.0 - onset) / (1.0 - slip)
    ax, ay, pa = old[STICK_X, i, j], old[STICK_Y, i, j], old[STICK_VARIANCE, i, j]
    bx, by, pb = old[SLIP_X, i, j], old[SLIP_Y, i, j], old[SLIP_VARIANCE, i, j]
    apart = 0.5 * ((ax - bx) ** 2 + (ay - by) ** 2)
    drift = tuning.creep**2 * interval
    k = kept_stick
    sx, sy = k * ax + (1.0 - k) * bx, k * ay + (1.0 - k) * by
    vs = k * pa + (1.0 - k) * pb + k * (1.0 - k) * apart + drift + (0.1 * tuning.rigidity) ** 2 * size2
    k = kept_slip
    lx = k * bx + (1.0 - k) * ax - tuning.slip_share * motion[0]
    ly = k * by + (1.0 - k) * ay - tuning.slip_share * motion[1]
    vl = k * pb + (1.0 - k) * pa + k * (1.0 - k) * apart + drift + tuning.slip_share_spread**2 * size2
    doubt = variance + motion_noise + 0.25 * tuning.rigidity**2 * size2
    px, py = seen
    stick2 = (px - sx) ** 2 + (py - sy) ** 2
    slip2 = (px - lx) ** 2 + (py - ly) ** 2
    gained = 0.5 * stick2 / (vs + doubt) - 0.5 * slip2 / (vl + doubt) + math.log((vs + doubt) / (vl + doubt))
    trust = 1.0
    if stick2 > WILD * (vs + doubt) and slip2 > WILD * (vl + doubt):
        trust, vs, vl = 0.0, vs + 0.25 * stick2, vl + 0.25 * slip2
    odds = math.log(slip / (1.0 - slip)) + trust * min(max(gained, -CERTAIN), CERTAIN) + evidence
    new[PROBABILITY, i, j] = 1.0 / (1.0 + math.exp(-min(max(odds, -CERTAIN), CERTAIN)))
    k = trust * vs / (vs + doubt)
    new[STICK_X, i, j], new[STICK_Y, i, j] = sx + k * (px - sx), sy + k * (py - sy)
    new[STICK_VARIANCE, i, j] = vs * (1.0 - k)
    k = trust * vl / (vl + doubt)
    new[SLIP_X, i, j], new[SLIP_Y, i, j] = lx + k * (px - lx), ly + k * (py - ly)
    new[SLIP_VARIANCE, i, j] = vl * (1.0 - k)


@compiled
def expected(p: float, onset: float, end: float) -> float:
    """How probable slip is after a step in which a sticking element begins to slip, and a slipping one to stick, so."""
    return min(max(p * (1.0 - end) + (1.0 - p) * onset, 1e-6), 1.0 - 1e-6)


@compiled
def look_back(before: FloatArray, elements: FloatArray, later: FloatArray, revised: FloatArray) -> None:
    """Fill ``revised`` [n, m], slip probabilities one frame earlier, from ``later`` ones that know more (Kim, 1994).

    ``before`` and ``elements`` are the memories of the earlier and the later frame.
    """
    n, m = later.shape
    for i in range(n):
        for j in range(m):
            p, onset, end = before[PROBABILITY, i, j], elements[ONSET, i, j], elements[END, i, j]
            slip, known = expected(p, onset, end), later[i, j]
            revised[i, j] = p * ((1.0 - end) * known / slip + end * (1.0 - known) / (1.0 - slip))


@compiled
def decide(posterior: FloatArray, threshold: float, slip: BoolArray, probability: FloatArray) -> None:
    """Slip above the threshold; the probability is the posterior with its odds shifted to ½ there."""
    n, m = posterior.shape
    odds = (1.0 - threshold) / threshold
    for i in range(n):
        for j in range(m):
            p = posterior[i, j]
            slip[i, j] = p > threshold
            probability[i, j] = p * odds / (1.0 - p + p * odds)
