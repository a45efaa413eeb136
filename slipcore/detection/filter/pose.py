"""Where the object is: a robust fit of its pose to the elements that most likely stick, and how it moved."""

import math
from typing import NamedTuple

from slipcore.compilation import compiled
from slipcore.defaults import NUMERICS
from slipcore.detection.filter.tuning import Tuning
from slipcore.frames import FloatArray

_LEAST_SPREAD, _OPEN_YAW, _STRETCH_VARIANCE, _YAW_VARIANCE = (
    NUMERICS.least_spread,
    NUMERICS.open_yaw,
    NUMERICS.stretch_variance,
    NUMERICS.yaw_variance,
)


class Pose(NamedTuple):
    """Where the object is: x, y m, yaw rad, and a stretch that stands in for linear rotation (1 for a rigid body); with
    the cosine and sine of the yaw, see ``pose_at``.
    """

    x: float
    y: float
    yaw: float
    stretch: float
    cosine: float
    sine: float


class PoseVariance(NamedTuple):
    """Variance of a fitted pose: of the place of (x, y) m², and of the yaw about it rad²."""

    place: float
    yaw: float
    x: float
    y: float


class Anchors(NamedTuple):
    """Elements that stay in contact, [k]: place on the object if they stuck, x, y m and its variance m²; where their
    markers are, m; how likely they stuck; and what ``find_pose`` fills: the weight that each has in a fit, 1/m², by how
    likely it stuck, and by how well it then fits, too.
    """

    x: FloatArray
    y: FloatArray
    variance: FloatArray
    marker_x: FloatArray
    marker_y: FloatArray
    stick: FloatArray
    base: FloatArray
    weight: FloatArray


class AnchorMotion(NamedTuple):
    """How far the object carried each anchor, x and y in its own frame, m, and the variance of that, m²: [k] each."""

    x: FloatArray
    y: FloatArray
    variance: FloatArray


@compiled
def pose_at(x: float, y: float, yaw: float, stretch: float) -> Pose:
    """The pose with its cosine and sine, which a loop over elements would otherwise work out for each."""
    return Pose(x, y, yaw, stretch, math.cos(yaw), math.sin(yaw))


@compiled
def place_on_object(pose: Pose, x: float, y: float) -> tuple[float, float]:
    """A point in the object's frame."""
    cosine, sine = pose.cosine / pose.stretch, pose.sine / pose.stretch
    dx, dy = x - pose.x, y - pose.y
    return cosine * dx + sine * dy, cosine * dy - sine * dx


@compiled
def place_of_object(pose: Pose, x: float, y: float) -> tuple[float, float]:
    """Where a point of the object's frame is."""
    cosine, sine = pose.cosine * pose.stretch, pose.sine * pose.stretch
    return cosine * x - sine * y + pose.x, sine * x + cosine * y + pose.y


@compiled(fastmath={"reassoc"})
def fit_pose(anchors: Anchors, weight: FloatArray, given: FloatArray) -> tuple[Pose, PoseVariance]:
    """Weighted Procrustes fit of the pose that carries each anchor to its marker, and its variance.

    With anchors p and markers q about their weighted means: yaw φ = atan2(Σw p×q, Σw p·q), stretch s = √((Σw p×q)² +
    (Σw p·q)²)/Σw p² (Umeyama, IEEE Trans. Pattern Anal. Mach. Intell. 13 (1991) 376). Linear theory makes of a
    rotation φ a stretch of √(1 + φ²) ≈ 1 + φ²/2 and a yaw of atan φ ≈ φ − φ³/3. So s − 1 is normal about 0 with
    variance φ⁴/4 beforehand, and the yaw about that of a ``given`` pose (empty if there is none; its place is kept)
    with φ⁶/9; each is shrunk to that by its share of the sum with 1/Σw p², the variance of the fit.
    """
    total = mx = my = ax = ay = 0.0
    for e in range(len(weight)):
        w = weight[e]
        total += w
        mx += w * anchors.marker_x[e]
        my += w * anchors.marker_y[e]
        ax += w * anchors.x[e]
        ay += w * anchors.y[e]
    mx, my, ax, ay = mx / total, my / total, ax / total, ay / total
    sine = cosine = spread = 0.0
    for e in range(len(weight)):
        w = weight[e]
        px, py = anchors.x[e] - ax, anchors.y[e] - ay
        qx, qy = anchors.marker_x[e] - mx, anchors.marker_y[e] - my
        sine += w * (px * qy - py * qx)
        cosine += w * (px * qx + py * qy)
        spread += w * (px * px + py * py)
    spread = max(spread, _LEAST_SPREAD)
    yaw = math.atan2(sine, cosine)
    variance = 1.0 / spread
    turned = given[2] if given.size else yaw
    room = 0.25 * turned**4 + _STRETCH_VARIANCE
    stretched = room / (room + variance)
    stretch = 1.0 + (math.hypot(sine, cosine) / spread - 1.0) * stretched
    if given.size:
        room = turned**6 / 9.0 + _YAW_VARIANCE
        share = room / (room + variance)
        difference = math.atan2(math.sin(yaw - turned), math.cos(yaw - turned))
        pose = pose_at(given[0], given[1], turned + difference * share, stretch)
        # A stretch moves what lies at a distance as far as a yaw does.
        return pose, PoseVariance(0.0, (share * share + stretched * stretched) * variance, mx, my)
    c, s = stretch * math.cos(yaw), stretch * math.sin(yaw)
    return pose_at(mx - c * ax + s * ay, my - s * ax - c * ay, yaw, stretch), PoseVariance(
        1.0 / total, variance, mx, my
    )


@compiled
def find_pose(
    anchors: Anchors,
    before: Pose,
    given: FloatArray,
    variance: float,
    tuning: Tuning,
) -> tuple[Pose, PoseVariance]:
    """Pose of the object by iteratively reweighted fits to what most likely sticks; ``variance`` of a marker, m².

    Weights fall with the squared misfit r² over its scale s as 1/(1 + r²/s)² (Geman and McClure, 1987).
    """
    if len(anchors.x) < 2:
        known = pose_at(given[0], given[1], given[2], 1.0) if given.size else before
        return known, PoseVariance(0.0, _LEAST_SPREAD, 0.0, 0.0)
    base, weight = anchors.base, anchors.weight
    for e in range(len(base)):
        base[e] = max(anchors.stick[e] * anchors.stick[e], tuning.least_weight) / (variance + anchors.variance[e])
    pose, spread = fit_pose(anchors, base, given)
    for _ in range(2):
        for e in range(len(base)):
            px, py = place_of_object(pose, anchors.x[e], anchors.y[e])
            bx, by = place_of_object(before, anchors.x[e], anchors.y[e])
            scale = 2.0 * (variance + anchors.variance[e]) + tuning.rigidity**2 * ((px - bx) ** 2 + (py - by) ** 2)
            misfit = ((px - anchors.marker_x[e]) ** 2 + (py - anchors.marker_y[e]) ** 2) / (tuning.outlier * scale)
            weight[e] = base[e] / (1.0 + misfit) ** 2
        pose, spread = fit_pose(anchors, weight, given)
    return pose, spread


@compiled
def _without_open_yaw(
    anchors: Anchors, reference: Pose, pose: Pose, spread: PoseVariance, play: float
) -> tuple[Pose, PoseVariance]:
    """The pose with the yaw of the reference, turned back about the place that is known best, where the few elements
    that stick leave it open: where most of the variance of what the anchors are moved by is the yaw's, and this is
    within ``play`` standard deviations of the reference's.

    All that moves would else count as jitter of the yaw, also what the place shows far beyond its own variance.
    """
    turn = math.atan2(math.sin(pose.yaw - reference.yaw), math.cos(pose.yaw - reference.yaw))
    arm = 0.0
    for e in range(len(anchors.x)):
        px, py = place_of_object(pose, anchors.x[e], anchors.y[e])
        arm += (px - spread.x) ** 2 + (py - spread.y) ** 2
    is_open = spread.yaw * arm > _OPEN_YAW * len(anchors.x) * spread.place
    if not is_open or turn * turn > play * play * spread.yaw:
        return pose, spread
    x, y = place_on_object(pose, spread.x, spread.y)
    turned = pose_at(0.0, 0.0, reference.yaw, pose.stretch)
    dx, dy = place_of_object(turned, x, y)
    return pose_at(spread.x - dx, spread.y - dy, reference.yaw, pose.stretch), PoseVariance(
        spread.place, 0.0, spread.x, spread.y
    )


@compiled
def object_motion(
    anchors: Anchors,
    reference: Pose,
    before: Pose,
    pose: Pose,
    spread: PoseVariance,
    play: float,
    motion: AnchorMotion,
) -> Pose:
    """Fill the ``motion`` of each anchor; the reference of the next step.

    A fitted pose jitters though nothing moves. What it strays from the ``reference`` by less than ``play`` standard
    deviations (root mean square over the anchors) is no motion; the rest is, and takes the reference with it: motion
    = (1 − ``play`` √(Σσ²/Σd²)) d for distances d of variance σ², as in positive-part shrinkage. So all of a long motion
    counts, however many frames it is cut into, and of a jitter nothing. Nor does what the pose had strayed ``before``
    this step, when it was less sure: markers have shown already where that took them, and show no motion now.
    """
    count = len(anchors.x)
    if count == 0:  # what moves without touching carries nothing
        return pose
    strayed = jitter = 0.0
    held, _ = _without_open_yaw(anchors, reference, before, spread, play)
    pose, spread = _without_open_yaw(anchors, reference, pose, spread, play)
    for e in range(count):
        px, py = place_of_object(pose, anchors.x[e], anchors.y[e])
        bx, by = place_of_object(held, anchors.x[e], anchors.y[e])
        rx, ry = place_of_object(reference, anchors.x[e], anchors.y[e])
        motion.variance[e] = spread.place + spread.yaw * ((px - spread.x) ** 2 + (py - spread.y) ** 2)
        strayed += (bx - rx) ** 2 + (by - ry) ** 2
        jitter += motion.variance[e]
    reference = between(reference, held, beyond(strayed, jitter, play))
    strayed = 0.0
    cosine, sine = pose.cosine, pose.sine
    for e in range(count):
        px, py = place_of_object(pose, anchors.x[e], anchors.y[e])
        rx, ry = place_of_object(reference, anchors.x[e], anchors.y[e])
        dx, dy = px - rx, py - ry
        motion.x[e], motion.y[e] = cosine * dx + sine * dy, cosine * dy - sine * dx
        strayed += dx * dx + dy * dy
    share = beyond(strayed, jitter, play)
    for e in range(count):
        motion.x[e] *= share
        motion.y[e] *= share
    return between(reference, pose, share)


@compiled
def beyond(strayed: float, jitter: float, play: float) -> float:
    """Share of what a pose strayed that is more than ``play`` times its jitter; sums of squares, m²."""
    return max(0.0, 1.0 - play * math.sqrt(jitter / strayed)) if strayed > 0.0 else 0.0


@compiled
def between(one: Pose, other: Pose, share: float) -> Pose:
    """The pose at that ``share`` of the way from one to the other."""
    return pose_at(
        one.x + share * (other.x - one.x),
        one.y + share * (other.y - one.y),
        one.yaw + share * math.atan2(math.sin(other.yaw - one.yaw), math.cos(other.yaw - one.yaw)),
        one.stretch + share * (other.stretch - one.stretch),
    )
