"""Compiled kernels of method ``filter``: loops over elements, on plain arrays.

An element's memory is a column of ``elements`` [10, n, m]: its slip probability; where in the object's frame it would
be if it stuck (x, y m, variance m²) and if it slipped (the same); its force low-passed (normal, tangential N); and the
force ratio that it slipped at with the weight of that knowledge. What is common to all is ``Common``.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from slipcore.frames import BoolArray, FloatArray

PROBABILITY, STICK_X, STICK_Y, STICK_VARIANCE, SLIP_X, SLIP_Y, SLIP_VARIANCE, NORMAL, TANGENTIAL, RATIO, KNOWN = range(
    11
)
ROWS = 11
HALF_LOG_TWO_PI = 0.5 * math.log(2.0 * math.pi)
CERTAIN = 12.0
"""Largest log-odds that one frame can bring or a filter can hold; the rest of the way out takes too long to go back."""


class Pose(NamedTuple):
    """Where the object is: x, y m, yaw rad, and a stretch that stands in for linear rotation (1 for a rigid body)."""

    x: float
    y: float
    yaw: float
    stretch: float


class Uncertainty(NamedTuple):
    """Variance of a fitted pose: of the place of (x, y) m², and of the yaw about it rad²."""

    place: float
    yaw: float
    x: float
    y: float


class Loading(NamedTuple):
    """Low-passed rates of the load: depth m/s and root mean square motion m/s; F_N, F_x, F_y and M/lever N/s."""

    depth: float
    motion: float
    normal: float
    force_x: float
    force_y: float
    twist: float


class Tuning(NamedTuple):
    """``FilterOptions`` as numbers for the kernels, in the same order and units."""

    noise_margin: float
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


@njit(cache=True)
def place_on_object(pose: Pose, x: float, y: float) -> tuple[float, float]:
    """A point in the object's frame."""
    cosine, sine = math.cos(pose.yaw) / pose.stretch, math.sin(pose.yaw) / pose.stretch
    dx, dy = x - pose.x, y - pose.y
    return cosine * dx + sine * dy, cosine * dy - sine * dx


@njit(cache=True)
def place_of_object(pose: Pose, x: float, y: float) -> tuple[float, float]:
    """Where a point of the object's frame is."""
    cosine, sine = math.cos(pose.yaw) * pose.stretch, math.sin(pose.yaw) * pose.stretch
    return cosine * x - sine * y + pose.x, sine * x + cosine * y + pose.y


@njit(cache=True)
def fit_pose(
    elements: FloatArray, x: FloatArray, y: FloatArray, weight: FloatArray, given: FloatArray, has_given: bool
) -> tuple[Pose, Uncertainty]:
    """Weighted Procrustes fit of the pose that carries each anchor to its marker, and its variance.

    A stretch is allowed as far as linear theory of so large a rotation would make one; of a given pose only the stretch
    and, within that of linear theory, the yaw.
    """
    total = mx = my = ax = ay = 0.0
    n, m = weight.shape
    for i in range(n):
        for j in range(m):
            w = weight[i, j]
            if w > 0.0:
                total += w
                mx += w * x[i, j]
                my += w * y[i, j]
                ax += w * elements[STICK_X, i, j]
                ay += w * elements[STICK_Y, i, j]
    mx, my, ax, ay = mx / total, my / total, ax / total, ay / total
    sine = cosine = spread = 0.0
    for i in range(n):
        for j in range(m):
            w = weight[i, j]
            if w > 0.0:
                px, py = elements[STICK_X, i, j] - ax, elements[STICK_Y, i, j] - ay
                qx, qy = x[i, j] - mx, y[i, j] - my
                sine += w * (px * qy - py * qx)
                cosine += w * (px * qx + py * qy)
                spread += w * (px * px + py * py)
    spread = max(spread, 1e-30)
    yaw = math.atan2(sine, cosine)
    variance = 1.0 / spread
    turned = given[2] if has_given else yaw
    room = 0.25 * turned**4 + 1e-14
    stretch = 1.0 + (math.hypot(sine, cosine) / spread - 1.0) * room / (room + variance)
    if has_given:
        room = turned**6 / 9.0 + 1e-16
        difference = math.atan2(math.sin(yaw - turned), math.cos(yaw - turned))
        pose = Pose(given[0], given[1], turned + difference * room / (room + variance), stretch)
        return pose, Uncertainty(0.0, 0.0, mx, my)
    c, s = stretch * math.cos(yaw), stretch * math.sin(yaw)
    return Pose(mx - c * ax + s * ay, my - s * ax - c * ay, yaw, stretch), Uncertainty(1.0 / total, variance, mx, my)


@njit(cache=True)
def find_pose(
    elements: FloatArray,
    x: FloatArray,
    y: FloatArray,
    stays: BoolArray,
    before: Pose,
    given: FloatArray,
    has_given: bool,
    variance: float,
    tuning: Tuning,
) -> tuple[Pose, Uncertainty]:
    """Pose of the object by iteratively reweighted fits to what most likely sticks."""
    n, m = x.shape
    base = np.zeros((n, m))
    weight = np.zeros((n, m))
    count = 0
    for i in range(n):
        for j in range(m):
            if stays[i, j]:
                count += 1
                stick = 1.0 - elements[PROBABILITY, i, j]
                base[i, j] = max(stick * stick, tuning.least_weight) / (variance + elements[STICK_VARIANCE, i, j])
                weight[i, j] = base[i, j]
    pose, doubt = before, Uncertainty(0.0, 1e-30, 0.0, 0.0)
    if has_given:
        pose = Pose(given[0], given[1], given[2], 1.0)
    if count < 2:
        return pose, doubt
    for _ in range(3):
        pose, doubt = fit_pose(elements, x, y, weight, given, has_given)
        for i in range(n):
            for j in range(m):
                if stays[i, j]:
                    ax, ay = elements[STICK_X, i, j], elements[STICK_Y, i, j]
                    px, py = place_of_object(pose, ax, ay)
                    bx, by = place_of_object(before, ax, ay)
                    scale = 2.0 * (variance + elements[STICK_VARIANCE, i, j])
                    scale += tuning.rigidity**2 * ((px - bx) ** 2 + (py - by) ** 2)
                    misfit = ((px - x[i, j]) ** 2 + (py - y[i, j]) ** 2) / (tuning.outlier * scale)
                    weight[i, j] = base[i, j] / (1.0 + misfit) ** 2
    return pose, doubt


@njit(cache=True)
def object_motion(
    elements: FloatArray, stays: BoolArray, before: Pose, pose: Pose, doubt: Uncertainty
) -> tuple[FloatArray, FloatArray]:
    """How far the object carried each anchor, in its own frame, [2, n, m] m, and the variance of that, [n, m] m²."""
    n, m = stays.shape
    motion = np.zeros((2, n, m))
    noise = np.zeros((n, m))
    cosine, sine = math.cos(pose.yaw), math.sin(pose.yaw)
    for i in range(n):
        for j in range(m):
            if stays[i, j]:
                ax, ay = elements[STICK_X, i, j], elements[STICK_Y, i, j]
                px, py = place_of_object(pose, ax, ay)
                bx, by = place_of_object(before, ax, ay)
                noise[i, j] = doubt.place + doubt.yaw * ((px - doubt.x) ** 2 + (py - doubt.y) ** 2)
                dx, dy = px - bx, py - by
                motion[0, i, j] = cosine * dx + sine * dy
                motion[1, i, j] = cosine * dy - sine * dx
    return motion, noise


@njit(cache=True)
def shrink_motion(motion: FloatArray, noise: FloatArray, margin: float) -> None:
    """Take from each squared motion what noise alone makes of it."""
    n, m = noise.shape
    for i in range(n):
        for j in range(m):
            size = motion[0, i, j] ** 2 + motion[1, i, j] ** 2
            share = max(0.0, 1.0 - margin * noise[i, j] / size) if size > 0.0 else 0.0
            motion[0, i, j] *= share
            motion[1, i, j] *= share


@njit(cache=True)
def step_loading(
    loading: Loading,
    motion: FloatArray,
    depth_change: FloatArray,
    force_change: FloatArray,
    has_force: bool,
    x: FloatArray,
    y: FloatArray,
    stays: BoolArray,
    interval: float,
    smoothing: float,
) -> tuple[Loading, int]:
    """Rates of the load on what is and was in contact."""
    n, m = stays.shape
    count = 0
    cx = cy = 0.0
    for i in range(n):
        for j in range(m):
            if stays[i, j]:
                count += 1
                cx += x[i, j]
                cy += y[i, j]
    if count == 0:
        return Loading(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 0
    cx, cy = cx / count, cy / count
    depth = moved = normal = force_x = force_y = moment = lever = 0.0
    for i in range(n):
        for j in range(m):
            if stays[i, j]:
                depth += depth_change[i, j]
                moved += motion[0, i, j] ** 2 + motion[1, i, j] ** 2
                rx, ry = x[i, j] - cx, y[i, j] - cy
                lever += rx * rx + ry * ry
                if has_force:
                    normal -= force_change[i, j, 2]
                    force_x += force_change[i, j, 0]
                    force_y += force_change[i, j, 1]
                    moment += rx * force_change[i, j, 1] - ry * force_change[i, j, 0]
    twist = moment / max(math.sqrt(lever / count), 1e-9)
    gain = 1.0 - math.exp(-interval / smoothing) if smoothing > 0.0 else 1.0
    now = (depth / count, math.sqrt(moved / count), normal, force_x, force_y, twist)
    return Loading(
        loading.depth + gain * (now[0] / interval - loading.depth),
        loading.motion + gain * (now[1] / interval - loading.motion),
        loading.normal + gain * (now[2] / interval - loading.normal),
        loading.force_x + gain * (now[3] / interval - loading.force_x),
        loading.force_y + gain * (now[4] / interval - loading.force_y),
        loading.twist + gain * (now[5] / interval - loading.twist),
    ), count


@njit(cache=True)
def presses_home(
    loading: Loading,
    count: int,
    has_force: bool,
    friction: float,
    variance: float,
    force_sigma: float,
    interval: float,
    tuning: Tuning,
) -> bool:
    """Whether the normal load grows so much faster than the tangential one that everything sticks again."""
    if count == 0:
        return False
    gain = 1.0 - math.exp(-interval / tuning.loading_smoothing) if tuning.loading_smoothing > 0.0 else 1.0
    limit = friction if friction > 0.0 else tuning.pressing_slope / tuning.pressing_share
    if has_force:
        noise = math.sqrt(2.0 * count) * force_sigma / interval * math.sqrt(gain / (2.0 - gain)) * gain + 1e-3
        sideways = loading.force_x**2 + loading.force_y**2 + loading.twist**2
        sideways = math.sqrt(max(0.0, sideways - 3.0 * noise * noise))
        return loading.normal > 4.0 * noise and sideways < tuning.pressing_share * limit * loading.normal
    noise = math.sqrt(2.0 * variance / count) / interval * gain + tuning.pressing_floor
    return loading.depth > 3.0 * noise and STIFFNESS * loading.motion < tuning.pressing_slope * loading.depth


STIFFNESS = 0.67
"""Tangential over normal stiffness of a stuck contact, 2(1 − ν)/(2 − ν) at ν ≈ ½ (Mindlin)."""


@njit(cache=True)
def learn_ratios(
    elements: FloatArray,
    stays: BoolArray,
    ratio: FloatArray,
    ratio_noise: FloatArray,
    friction: tuple[float, float],
    interval: float,
    tuning: Tuning,
) -> tuple[float, float]:
    """Learn the force ratio at which elements slip: each its own, and the mean (weighted sum, weight) of all."""
    gain = 1.0 - math.exp(-interval / tuning.ratio_memory)
    n, m = stays.shape
    total = weight = 0.0
    for i in range(n):
        for j in range(m):
            if not stays[i, j]:
                elements[RATIO, i, j] = elements[KNOWN, i, j] = 0.0
                continue
            p = elements[PROBABILITY, i, j]
            own = 0.0
            if ratio[i, j] >= 0.0 and p > 0.85:
                w = p * p / (ratio_noise[i, j] + 1e-3)
                total += w * ratio[i, j]
                weight += w
            if ratio[i, j] >= 0.0 and p > 0.9:
                own = gain / (ratio_noise[i, j] + 1e-4)
            elements[RATIO, i, j] = (1.0 - gain) * elements[RATIO, i, j] + own * max(ratio[i, j], 0.0)
            elements[KNOWN, i, j] = (1.0 - gain) * elements[KNOWN, i, j] + own
    return friction[0] * (1.0 - gain) + gain * total, friction[1] * (1.0 - gain) + gain * weight


@njit(cache=True)
def log_normal_cdf(z: float) -> float:
    """log Φ(z), with the asymptote far out."""
    if z > -8.0:
        return math.log(0.5 * math.erfc(-z / math.sqrt(2.0)))
    return -0.5 * z * z - math.log(-z) - HALF_LOG_TWO_PI


@njit(cache=True)
def ratio_evidence(
    ratio: float, noise: float, own: float, known: float, friction: float, gain: float, tuning: Tuning
) -> float:
    """Log-likelihood ratio of slip at a force ratio: near the one it slips at, against anywhere below it."""
    prior = 2.0 * gain / (tuning.ratio_difference * friction) ** 2
    limit = (prior * friction + own) / (prior + known)
    spread = math.sqrt(noise + (tuning.ratio_spread * friction) ** 2 + 0.5 * gain / (prior + known))
    z = (limit - ratio) / spread
    best = math.log(limit / spread) - HALF_LOG_TWO_PI
    if z < 0.0:
        return best + math.log(2.0)
    return best - 0.5 * z * z - log_normal_cdf(z)


@njit(cache=True)
def force_ratios(
    elements: FloatArray, stays: BoolArray, sigma: float, gain: float, force_to_noise: float
) -> tuple[FloatArray, FloatArray]:
    """Force ratio [n, m], −1 where the normal force is too small to tell, and its variance."""
    n, m = stays.shape
    ratio = np.full((n, m), -1.0)
    noise = np.zeros((n, m))
    left = gain / (2.0 - gain)
    least = max(force_to_noise * sigma * math.sqrt(left), 1e-4)
    for i in range(n):
        for j in range(m):
            normal = elements[NORMAL, i, j]
            if stays[i, j] and normal > least:
                r = elements[TANGENTIAL, i, j] / normal
                ratio[i, j] = r
                noise[i, j] = sigma * sigma * left * (1.0 + r * r) / (normal * normal)
    return ratio, noise


@njit(cache=True)
def at_front(elements: FloatArray, contact: BoolArray, i: int, j: int) -> float:
    """Mean slip probability of the four neighbours; beyond the contact's edge everything slips."""
    n, m = contact.shape
    total = 0.0
    for a, b in ((i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)):
        inside = 0 <= a < n and 0 <= b < m and contact[a, b]
        total += elements[PROBABILITY, a, b] if inside else 1.0
    return 0.25 * total


@njit(cache=True)
def update_element(
    column: FloatArray,
    new: FloatArray,
    mx: float,
    my: float,
    motion_noise: float,
    front: float,
    home: bool,
    evidence: float,
    px: float,
    py: float,
    variance: float,
    interval: float,
    tuning: Tuning,
) -> None:
    """One step of the interacting-multiple-model filter of one element seen at (px, py) in the object's frame."""
    p = column[PROBABILITY]
    size2 = mx * mx + my * my
    size = math.sqrt(size2)
    near = tuning.onset_inside + tuning.onset_at_front * front
    onset = 1.0 - math.exp(-(size / tuning.onset_length + interval / tuning.onset_time) * near)
    rate = size / tuning.end_length + interval / tuning.end_time
    if home:
        rate += tuning.pressing_rate * interval
        onset *= 0.02
    end = 1.0 - math.exp(-rate)
    slip = min(max(p * (1.0 - end) + (1.0 - p) * onset, 1e-6), 1.0 - 1e-6)
    kept_slip, kept_stick = p * (1.0 - end) / slip, (1.0 - p) * (1.0 - onset) / (1.0 - slip)
    ax, ay, pa = column[STICK_X], column[STICK_Y], column[STICK_VARIANCE]
    bx, by, pb = column[SLIP_X], column[SLIP_Y], column[SLIP_VARIANCE]
    apart = 0.5 * ((ax - bx) ** 2 + (ay - by) ** 2)
    drift = tuning.creep**2 * interval
    k = kept_stick
    sx, sy = k * ax + (1.0 - k) * bx, k * ay + (1.0 - k) * by
    vs = k * pa + (1.0 - k) * pb + k * (1.0 - k) * apart + drift + (0.1 * tuning.rigidity) ** 2 * size2
    k = kept_slip
    lx, ly = k * bx + (1.0 - k) * ax - tuning.slip_share * mx, k * by + (1.0 - k) * ay - tuning.slip_share * my
    vl = k * pb + (1.0 - k) * pa + k * (1.0 - k) * apart + drift + tuning.slip_share_spread**2 * size2
    seen = variance + motion_noise + 0.25 * tuning.rigidity**2 * size2
    stick2 = (px - sx) ** 2 + (py - sy) ** 2
    slip2 = (px - lx) ** 2 + (py - ly) ** 2
    gained = 0.5 * stick2 / (vs + seen) - 0.5 * slip2 / (vl + seen) + math.log((vs + seen) / (vl + seen))
    odds = math.log(slip / (1.0 - slip)) + min(max(gained, -CERTAIN), CERTAIN) + evidence
    new[PROBABILITY] = 1.0 / (1.0 + math.exp(-min(max(odds, -CERTAIN), CERTAIN)))
    k = vs / (vs + seen)
    new[STICK_X], new[STICK_Y], new[STICK_VARIANCE] = sx + k * (px - sx), sy + k * (py - sy), vs * (1.0 - k)
    k = vl / (vl + seen)
    new[SLIP_X], new[SLIP_Y], new[SLIP_VARIANCE] = lx + k * (px - lx), ly + k * (py - ly), vl * (1.0 - k)


@njit(cache=True)
def start_element(new: FloatArray, contact: bool, px: float, py: float, variance: float) -> None:
    """An element that has just touched, or does not touch."""
    new[PROBABILITY] = 0.0
    new[STICK_X] = new[SLIP_X] = px
    new[STICK_Y] = new[SLIP_Y] = py
    new[STICK_VARIANCE] = new[SLIP_VARIANCE] = variance if contact else np.inf


@njit(cache=True)
def step_filter(
    elements: FloatArray,
    pose: Pose,
    loading: Loading,
    friction: tuple[float, float],
    x: FloatArray,
    y: FloatArray,
    depth_change: FloatArray,
    contact: BoolArray,
    touched: BoolArray,
    normal: FloatArray,
    tangential: FloatArray,
    force_change: FloatArray,
    has_force: bool,
    given: FloatArray,
    has_given: bool,
    sigma: float,
    force_sigma: float,
    interval: float,
    tuning: Tuning,
) -> tuple[FloatArray, Pose, Loading, tuple[float, float]]:
    """One frame: new elements, pose, loading and friction (weighted sum of ratios, weight)."""
    n, m = contact.shape
    stays = np.zeros((n, m), np.bool_)
    old = elements.copy()
    gain = 1.0 - math.exp(-interval / tuning.force_smoothing) if tuning.force_smoothing > 0.0 else 1.0
    for i in range(n):
        for j in range(m):
            stays[i, j] = contact[i, j] and not touched[i, j] and math.isfinite(elements[STICK_VARIANCE, i, j])
            if has_force:
                kept = 1.0 - gain if stays[i, j] else 0.0
                old[NORMAL, i, j] = kept * old[NORMAL, i, j] + (1.0 - kept) * max(normal[i, j], 0.0)
                old[TANGENTIAL, i, j] = kept * old[TANGENTIAL, i, j] + (1.0 - kept) * tangential[i, j]
    variance = (tuning.noise_margin * sigma) ** 2 + tuning.displacement_floor**2
    now, doubt = find_pose(old, x, y, stays, pose, given, has_given, variance, tuning)
    motion, noise = object_motion(old, stays, pose, now, doubt)
    shrink_motion(motion, noise, tuning.motion_margin)
    loading, count = step_loading(
        loading, motion, depth_change, force_change, has_force, x, y, stays, interval, tuning.loading_smoothing
    )
    mean = friction[0] / friction[1] if friction[1] > 0.0 else 0.0
    home = presses_home(loading, count, has_force, mean, variance, force_sigma, interval, tuning)
    ratio, ratio_noise = force_ratios(old, stays, force_sigma, gain, tuning.force_to_noise)
    if has_force:
        friction = learn_ratios(old, stays, ratio, ratio_noise, friction, interval, tuning)
        mean = friction[0] / friction[1] if friction[1] > 0.0 else 0.0
    own_gain = 1.0 - math.exp(-interval / tuning.ratio_memory)
    new = old.copy()
    for i in range(n):
        for j in range(m):
            px, py = place_on_object(now, x[i, j], y[i, j])
            if not stays[i, j]:
                start_element(new[:, i, j], contact[i, j], px, py, variance)
                continue
            evidence = 0.0
            if mean > 0.0 and ratio[i, j] >= 0.0:
                own, known = old[RATIO, i, j], old[KNOWN, i, j]
                evidence = ratio_evidence(ratio[i, j], ratio_noise[i, j], own, known, mean, own_gain, tuning)
                evidence = min(max(evidence, -6.0), 6.0) * tuning.ratio_weight * gain
            front = at_front(old, contact, i, j)
            update_element(
                old[:, i, j], new[:, i, j], motion[0, i, j], motion[1, i, j], noise[i, j],
                front, home, evidence, px, py, variance, interval, tuning,
            )  # fmt: skip
    return new, now, loading, friction
