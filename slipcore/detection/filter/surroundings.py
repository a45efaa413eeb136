"""How the gel around the contact moves: under a camera that shakes all markers do, and the object seems to."""

import math

from slipcore.compilation import compiled
from slipcore.detection.filter.state import BEND, JITTER, SHAKING, SHIFT, STEP
from slipcore.detection.filter.tuning import Tuning
from slipcore.detection.shared.records import FrameArrays
from slipcore.frames import BoolArray, FloatArray
from slipcore.noise import median


@compiled(inline=True)
def shift_of_surroundings(
    last: FrameArrays,
    frame: FrameArrays,
    touches: tuple[BoolArray, BoolArray],
    variance: float,
    room: tuple[FloatArray, FloatArray],
    tuning: Tuning,
    common: FloatArray,
) -> tuple[float, float]:
    """How far the camera has moved since the first frame, x and y m, as markers around the contact show; in ``common``.

    It moves as they do in the mean while ``surroundings_jitter`` of their motion is jitter, and more of it than the
    ``variance`` of each, m², makes. Those count that lie ``surroundings_reach`` contact radii or more from what
    ``touches``, [n, m] before and now, without outliers: the mean of the same markers adds up to no random walk. Fewer
    than ``surroundings_least`` say nothing. As their motion has the gel's own in it, too, they say nothing beside a
    pose that is given unless the camera is ``SHAKING``. ``room``: [n, m] for distances, and rows.
    """
    (was, contact), (distance, rows) = touches, room
    touching = distance_from(was, contact, distance)
    reach = max(1.0, tuning.surroundings_reach * math.sqrt(touching / math.pi))
    count = find_steps(last.displacement, frame.displacement, distance, reach, rows)
    if count >= tuning.surroundings_least:
        u, v = usual_step(rows[:, :count], tuning.surroundings_outlier)
        add_step(u, v, tuning, common)
        heard = common[SHAKING] > 0.0 or not frame.object_pose.size
        if heard and jitters(tuning.surroundings_noise * variance / count, tuning, common):
            common[SHIFT] += u
            common[SHIFT + 1] += v
    else:  # what was seen of a shake before may be over
        common[JITTER : JITTER + 2] = 0.0
    return common[SHIFT], common[SHIFT + 1]


@compiled
def jitters(least: float, tuning: Tuning, common: FloatArray) -> bool:
    """Whether ``surroundings_jitter`` of how the markers around the contact move together is jitter, and this has the
    ``least`` variance, m², or more: white noise of variance σ² along x and y adds 12σ² to Σb² each frame.
    """
    together = common[JITTER] / (12.0 * tuning.surroundings_memory)
    return bool(share_of_jitter(tuning, common) >= tuning.surroundings_jitter and together >= least)


@compiled
def add_step(u: float, v: float, tuning: Tuning, common: FloatArray) -> None:
    """Add a step u, v m to the sums over its changes b, Σb² and Σb·b′, which fade over ``surroundings_memory``."""
    kept = 1.0 - 1.0 / tuning.surroundings_memory
    bend_u, bend_v = u - common[STEP], v - common[STEP + 1]
    common[JITTER] = kept * common[JITTER] + bend_u**2 + bend_v**2
    common[JITTER + 1] = kept * common[JITTER + 1] + bend_u * common[BEND] + bend_v * common[BEND + 1]
    common[STEP], common[STEP + 1], common[BEND], common[BEND + 1] = u, v, bend_u, bend_v


@compiled
def share_of_jitter(tuning: Tuning, common: FloatArray) -> float:
    """What share of the steps white noise of place has, by their changes b and b′ in a row: −3/2 Σb·b′/Σb².

    White noise of variance σ² gives b² = 6σ² and b·b′ = −4σ² a direction in the mean; an even motion gives neither.
    """
    total = common[JITTER] + tuning.displacement_floor**2
    return float(min(max(-1.5 * common[JITTER + 1] / total, 0.0), 1.0)) if total > 0.0 else 0.0


@compiled
def distance_from(was: BoolArray, contact: BoolArray, distance: FloatArray) -> int:
    """Fill how far each element is from those that touch or did, in elements; how many of these there are.

    In two passes, by steps of 1 and √2 (Borgefors, Comput. Vis. Graph. Image Process. 34 (1986) 344): 8 % too far at
    most.
    """
    n, m = contact.shape
    touching = 0
    for i in range(n):
        for j in range(m):
            touches = contact[i, j] or was[i, j]
            distance[i, j] = 0.0 if touches else math.inf
            touching += touches
    if 0 < touching < n * m:
        for i in range(n):
            spread_across(distance[max(i - 1, 0)], distance[i])
            near = math.inf
            for j in range(m):
                near = min(distance[i, j], near + 1.0)
                distance[i, j] = near
        for i in range(n - 1, -1, -1):
            spread_across(distance[min(i + 1, n - 1)], distance[i])
            near = math.inf
            for j in range(m - 1, -1, -1):
                near = min(distance[i, j], near + 1.0)
                distance[i, j] = near
    return touching


@compiled
def spread_across(beside: FloatArray, row: FloatArray) -> None:
    """Bring distances in a ``row`` [m] down to those by way of the one ``beside`` it, straight or aslant; its own are
    never nearer by way of themselves.
    """
    last, aslant = len(row) - 1, math.sqrt(2.0)
    for j in range(1, last):
        row[j] = min(min(row[j], beside[j] + 1.0), min(beside[j - 1], beside[j + 1]) + aslant)
    row[0] = min(row[0], min(beside[0] + 1.0, beside[min(1, last)] + aslant))
    row[last] = min(row[last], min(beside[last] + 1.0, beside[max(last - 1, 0)] + aslant))


@compiled
def find_steps(before: FloatArray, now: FloatArray, distance: FloatArray, reach: float, steps: FloatArray) -> int:
    """Fill the steps, x and y m, of the markers at this ``distance`` or farther into ``steps`` [3, k]; their number."""
    n, m = distance.shape
    count = 0
    for i in range(n):
        for j in range(m):
            if distance[i, j] >= reach:
                steps[0, count] = now[i, j, 0] - before[i, j, 0]
                steps[1, count] = now[i, j, 1] - before[i, j, 1]
                count += 1
    return count


@compiled
def usual_step(steps: FloatArray, outlier: float) -> tuple[float, float]:
    """Mean of ``steps`` x and y m, [3, k], without those ``outlier`` median absolute deviations off the median.

    The third row is room.
    """
    u, far_u = middle_and_spread(steps[0], steps[2])
    v, far_v = middle_and_spread(steps[1], steps[2])
    along = across = 0.0
    count = 0
    for k in range(steps.shape[1]):
        if abs(steps[0, k] - u) <= outlier * far_u and abs(steps[1, k] - v) <= outlier * far_v:
            along += steps[0, k]
            across += steps[1, k]
            count += 1
    return (along / count, across / count) if count else (u, v)


@compiled
def middle_and_spread(values: FloatArray, room: FloatArray) -> tuple[float, float]:
    """Median of the values [k], and their median absolute deviation from it."""
    room[:] = values
    middle = median(room)
    for k in range(len(values)):
        room[k] = abs(values[k] - middle)
    return middle, median(room)
