"""One step of method ``filter``: two states an element, stick and slip, on its place on the object and force ratio."""

import math

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import compiled
from slipcore.detection.filter.element import Estimates, Increment, Measurements, update_elements
from slipcore.detection.filter.force_ratio import (
    ForceEvidence,
    count_by_motion,
    follow_forces,
    keep_ratios,
    weigh_forces,
)
from slipcore.detection.filter.heading import follow_headings
from slipcore.detection.filter.hold import follow_held_pressing, hold_contact, keeps_contact, step_hold
from slipcore.detection.filter.loading import low_pass, restick_under_load
from slipcore.detection.filter.pooling import find_offsets, pooled_offset
from slipcore.detection.filter.pose import AnchorMotion, Anchors, Pose, PoseVariance, object_motion, place_on_object
from slipcore.detection.filter.slip_limit import step_limits
from slipcore.detection.filter.state import (
    DOUBTED_FRAMES,
    END,
    EXPECTED,
    FORCE_FRAMES,
    HELD_FRAMES,
    HELD_POSE,
    LASTING,
    ONSET,
    POSE,
    PROBABILITY,
    REFERENCE,
    RESOLUTION,
    SHAKING,
    SLIP_VARIANCE,
    SLIP_X,
    SLIP_Y,
    STICK_VARIANCE,
    STICK_X,
    STICK_Y,
)
from slipcore.detection.filter.surface_motion import step_pose, store_pose, stored_pose
from slipcore.detection.filter.surroundings import jitters, shift_of_surroundings
from slipcore.detection.filter.tuning import Tuning, tuning_of
from slipcore.detection.shared.lasting_noise import OF_STEP
from slipcore.detection.shared.observe import same
from slipcore.detection.shared.records import Decision, DetectorSetup, FrameArrays, Memory, Surface, Workspace
from slipcore.elementary import exponentials
from slipcore.frames import BoolArray, FloatArray


@compiled(inline=True)
def step_filter(
    sensor: DetectorSetup,
    last: FrameArrays,
    frame: FrameArrays,
    before: Memory,
    after: Memory,
    room: Workspace,
    has_force: bool,
) -> None:
    """Fill ``elements`` and ``common`` of the memory ``after``, and the decision, from the surface in the ``room``;
    ``has_force``: whether there are forces to believe.
    """
    tuning = tuning_of(sensor.settings)
    after.common[:] = before.common
    if frame.force.size and after.contact.any():
        after.common[FORCE_FRAMES] += 1.0
        after.common[DOUBTED_FRAMES] += 0.0 if has_force else 1.0
    noise = noise_of_frame(room.surface, tuning)
    if keeps_contact(frame, noise, has_force, tuning, before.common):
        spread = noise[1] if frame.force.size else math.sqrt(noise[0])  # of what presses: force, or else depth
        most = tuning.hold_deviations * spread * math.sqrt(1.0 + 1.0 / before.common[HELD_FRAMES])
        hold_contact(before.elements, before.contact, room.surface, most, after.contact)
    if same(last.displacement, frame.displacement) and not touches_anew(after.contact, room.surface.stays):
        after.elements[:] = before.elements  # a frame that repeats the last says nothing
        after.elements[ONSET] = after.elements[END] = 0.0
    else:
        step_elements(sensor.position, last, frame, before, after, room, has_force, tuning)
    decide(after.elements[PROBABILITY], after.elements[EXPECTED], tuning.threshold, room.decision)


@compiled(inline=True)
def step_elements(
    position: FloatArray,
    last: FrameArrays,
    frame: FrameArrays,
    before: Memory,
    after: Memory,
    room: Workspace,
    has_force: bool,
    tuning: Tuning,
) -> None:
    """The object's motion, the load's change and the forces' log-odds; then each element that stays in contact."""
    stays, common, elements = room.surface.stays, after.common, before.elements
    variance, force_noise = noise_of_frame(room.surface, tuning)
    noise = frame.time - last.time, variance, force_noise
    lasting = tell_noise(room.surface, tuning, common)
    places = room.places[: find_places(elements, stays, room.places)]
    anchors, motion, deeper, change, evidence, seen, states = rooms_of(room.rows, len(places))
    touches, aside = (before.contact, after.contact), (room.weight, room.rows)
    shift = shift_of_surroundings(last, frame, touches, variance, aside, tuning, common)
    common[SHAKING] = 1.0 if jitters(tuning.surroundings_jitter * variance, tuning, common) else 0.0
    find_anchors(elements, places, position, frame.displacement, shift, anchors)
    pose, spread = step_pose(anchors, stored_pose(before.common, POSE), last, frame, variance, tuning, common)
    held = step_hold(anchors, pose, spread, frame, noise, has_force, tuning, common)
    move_anchors(anchors, stored_pose(before.common, POSE), pose, spread, held, tuning, motion, common)
    if held:  # by its jitter places and pose would walk off together
        pose = stored_pose(common, HELD_POSE)
    compared = has_force and last.force.size > 0 and len(places) > 0
    change = change if compared else change[:0]
    force_change(places, last.force, frame.force, change)
    indentation_change(places, last.displacement, frame.displacement, deeper)
    restick = restick_under_load(before.common, common, anchors, motion, deeper, change, noise, tuning) and not held
    gain = low_pass(noise[0], tuning.force_smoothing)
    follow_forces(elements, room.surface, has_force, gain, after.elements)
    follow_held_pressing(elements, room.surface.pressing, common[HELD_FRAMES], after.elements)
    follow_headings(elements, places, motion, pose, frame.force, tuning.heading_length, gain, after.elements)
    look_at_forces(elements, places, compared, held, noise, tuning, evidence, after)
    count_by_motion(motion, noise[0], gain, tuning, common, evidence.log_odds)
    start_elements(position, frame.displacement, shift, stays, pose, variance, after)
    begins = not (restick or math.isnan(room.surface.noise[0]))  # slip does not before noise is known
    find_readiness(elements, after.contact, places, begins, tuning, room.weight, seen.readiness)
    # Neighbours blur where slip begins; only what no force shows is worth that.
    pooled = not has_force and common[RESOLUTION] == 0.0 and lasting > 0.0
    beside = lasting * lasting / (lasting * lasting + tuning.pooling_length**2) if pooled else 0.0
    look_at_markers(anchors, pose, places, room.offsets, 4.0 * tuning.pooling_outlier * variance, beside, seen)
    increment = Increment(noise[0], variance, restick, held)
    update_elements(elements, after.elements, places, motion, seen, states, increment, tuning)
    sight = last.displacement, frame.displacement, after.contact, stays
    measured = has_force and tuning.force_floor == 0.0  # what is reconstructed from markers says no more than they do
    rooms, noise_now = (room.rows, room.series), (math.sqrt(variance), held, measured)  # anchors are done with
    step_limits(elements, places, motion, sight, noise_now, tuning, rooms, after)


@compiled
def tell_noise(surface: Surface, tuning: Tuning, common: FloatArray) -> float:
    """Noise of a marker coordinate that lasts, m; put into ``common``, as is the step of its places."""
    marker_noise, _, between_neighbours, resolution = surface.noise
    lasting = lasting_noise(marker_noise, between_neighbours, resolution, tuning)
    common[RESOLUTION] = resolution
    common[LASTING] = lasting if lasting > known_or(marker_noise, tuning.unknown_noise) else 0.0
    return float(lasting)


@compiled(inline=True)
def move_anchors(
    anchors: Anchors,
    last: Pose,
    pose: Pose,
    spread: PoseVariance,
    held: bool,
    tuning: Tuning,
    motion: AnchorMotion,
    common: FloatArray,
) -> None:
    """Fill the ``motion`` of anchors from the pose that ``common`` refers to, the ``last`` one and that of now; none,
    and no other pose to refer to, where held.
    """
    reference = object_motion(anchors, stored_pose(common, REFERENCE), last, pose, spread, tuning.motion_play, motion)
    if held:
        motion.x[:] = 0.0
        motion.y[:] = 0.0
    else:
        store_pose(common, REFERENCE, reference)


@compiled(inline=True)
def look_at_forces(
    elements: FloatArray,
    places: NDArray[np.int64],
    compared: bool,
    held: bool,
    noise: tuple[float, float, float],
    tuning: Tuning,
    evidence: ForceEvidence,
    after: Memory,
) -> None:
    """Fill the log-odds of slip of the ``evidence`` by forces, where they can be ``compared`` with the last.

    ``noise``: interval s, variance of a marker coordinate m², and deviation of an element's force N.
    """
    interval, _, force_noise = noise
    if held:
        keep_ratios(elements, places, after.elements, evidence.log_odds)
    elif compared:
        weigh_forces(elements, places, force_noise, interval, tuning, after.elements, after.common, evidence)
    else:
        evidence.log_odds[:] = 0.0


@compiled
def find_readiness(
    elements: FloatArray,
    contact: BoolArray,
    places: NDArray[np.int64],
    begins: bool,
    tuning: Tuning,
    slip: FloatArray,
    readiness: FloatArray,
) -> None:
    """Fill how readily slip begins at these places, by how many neighbours slip; 0 unless it ``begins``. ``slip``
    [n, m]: room.
    """
    if not begins:
        readiness[:] = 0.0
        return
    n, m = contact.shape
    for i in range(n):
        for j in range(m):
            slip[i, j] = elements[PROBABILITY, i, j] if contact[i, j] else 1.0
    for e in range(len(places)):
        i, j = places[e]
        readiness[e] = tuning.onset_inside + tuning.onset_at_front * slip_of_neighbours(slip, i, j)


@compiled
def look_at_markers(
    anchors: Anchors,
    pose: Pose,
    places: NDArray[np.int64],
    offsets: FloatArray,
    scale: float,
    beside: float,
    seen: Measurements,
) -> None:
    """Fill where markers are on the object, by their neighbours, too, if these weigh anything ``beside`` them."""
    if beside == 0.0:
        for e in range(len(places)):
            seen.x[e], seen.y[e] = place_on_object(pose, anchors.marker_x[e], anchors.marker_y[e])
            seen.share[e] = 1.0
        return
    find_offsets(anchors, pose, places, offsets)
    for e in range(len(places)):
        i, j = places[e]
        x, y, seen.share[e] = pooled_offset(offsets, i, j, scale, beside)
        seen.x[e], seen.y[e] = anchors.x[e] + x, anchors.y[e] + y


@compiled(inline=True)
def noise_of_frame(surface: Surface, tuning: Tuning) -> tuple[float, float]:
    """Variance of a marker coordinate, m², and deviation of an element's force, N, that are reckoned with."""
    marker_noise, pressing_noise, between_neighbours, resolution = surface.noise
    lasting = lasting_noise(marker_noise, between_neighbours, resolution, tuning)
    shown = tuning.noise_margin * known_or(marker_noise, tuning.unknown_noise)
    variance = shown**2 + max(lasting, tuning.displacement_floor) ** 2  # a floor that is given is lasting noise, too
    return variance, math.hypot(tuning.force_noise_margin * known_or(pressing_noise, 0.0), tuning.force_floor)


@compiled(inline=True)
def lasting_noise(marker_noise: float, between_neighbours: float, step: float, tuning: Tuning) -> float:
    """What of a marker coordinate's noise three frames do not show, m: rounding to a ``step``, and what parts it from
    its neighbours by far more than from one frame to the next.
    """
    shown, rounding = known_or(marker_noise, 0.0), OF_STEP * step
    most = math.hypot(tuning.lasting_ratio * max(shown, rounding), tuning.lasting_least)
    more = max(known_or(between_neighbours, 0.0) ** 2 - most**2, 0.0)
    return math.sqrt(tuning.lasting_share * (max(rounding**2 - shown**2, 0.0) + more))


@compiled
def touches_anew(contact: BoolArray, stays: BoolArray) -> bool:
    """Whether an element touches that did not."""
    return bool((contact != stays).any())


@compiled
def known_or(noise: float, otherwise: float) -> float:
    """The noise, or what stands for it while it is unknown."""
    return otherwise if math.isnan(noise) else noise


@compiled(inline=True)
def rooms_of(
    rows: FloatArray, count: int
) -> tuple[Anchors, AnchorMotion, FloatArray, FloatArray, ForceEvidence, Measurements, Estimates]:
    """Where ``rows`` take what is worked out of so many anchors: themselves, how they move, how much deeper they are,
    change of force [3, n·m], what forces tell, what the step brings, and both states.

    What is needed later stands in place of what is done with: the fewer rows, the more of them stay near.
    """
    anchors = Anchors(
        rows[0][:count], rows[1][:count], rows[2][:count], rows[3][:count],
        rows[4][:count], rows[5][:count], rows[6][:count], rows[7][:count],
    )  # fmt: skip
    motion = AnchorMotion(rows[8][:count], rows[9][:count], rows[10][:count])
    evidence = ForceEvidence(rows[15][:count], rows[16][:count], rows[12][:count], rows[13][:count], rows[14][:count])
    # stick and weights of anchors are done with once the load has been looked at, their markers once places are known
    seen = Measurements(
        rows[5][:count], rows[6][:count], rows[7][:count], rows[11][:count],
        rows[15][:count], rows[12][:count], rows[13][:count], rows[14][:count],
    )  # fmt: skip
    states = Estimates(
        rows[17][:count], rows[0][:count], rows[1][:count], rows[2][:count],
        rows[3][:count], rows[4][:count], rows[16][:count],
    )  # fmt: skip
    return anchors, motion, rows[11][:count], rows[12:15], evidence, seen, states


@compiled
def find_places(elements: FloatArray, stays: BoolArray, places: NDArray[np.int64]) -> int:
    """Put rows and columns of the elements that were and are in contact into ``places`` [n·m, 2]; their number."""
    n, m = stays.shape
    count = 0
    for i in range(n):
        for j in range(m):
            if stays[i, j] and math.isfinite(elements[STICK_VARIANCE, i, j]):
                places[count, 0], places[count, 1] = i, j
                count += 1
    return count


@compiled
def find_anchors(
    elements: FloatArray,
    places: NDArray[np.int64],
    position: FloatArray,
    displacement: FloatArray,
    shift: tuple[float, float],
    anchors: Anchors,
) -> None:
    """Fill what the fit of the pose needs, at these places; of markers from which the camera's ``shift`` is taken."""
    for e in range(len(places)):
        i, j = places[e]
        anchors.x[e], anchors.y[e] = elements[STICK_X, i, j], elements[STICK_Y, i, j]
        anchors.variance[e] = elements[STICK_VARIANCE, i, j]
        anchors.marker_x[e] = position[i, j, 0] + displacement[i, j, 0] - shift[0]
        anchors.marker_y[e] = position[i, j, 1] + displacement[i, j, 1] - shift[1]
        anchors.stick[e] = 1.0 - elements[PROBABILITY, i, j]


@compiled
def indentation_change(places: NDArray[np.int64], start: FloatArray, end: FloatArray, deeper: FloatArray) -> None:
    """Fill how much deeper these places are at the end than at the start, [k] m."""
    for e in range(len(places)):
        i, j = places[e]
        deeper[e] = start[i, j, 2] - end[i, j, 2]


@compiled
def force_change(places: NDArray[np.int64], before: FloatArray, now: FloatArray, change: FloatArray) -> None:
    """Fill the change of force [3, k or more] N at these places; ``change`` is empty where a force is missing."""
    if change.size == 0:
        return
    for e in range(len(places)):
        i, j = places[e]
        change[0, e] = now[i, j, 0] - before[i, j, 0]
        change[1, e] = now[i, j, 1] - before[i, j, 1]
        change[2, e] = now[i, j, 2] - before[i, j, 2]


@compiled(inline=True)
def start_elements(
    position: FloatArray,
    displacement: FloatArray,
    shift: tuple[float, float],
    stays: BoolArray,
    pose: Pose,
    variance: float,
    memory: Memory,
) -> None:
    """Elements that have just touched stick where they are; of those that do not touch nothing is known."""
    contact, after = memory.contact, memory.elements
    n, m = contact.shape
    for i in range(n):
        for j in range(m):
            if not stays[i, j]:
                after[STICK_X, i, j] = after[STICK_Y, i, j] = after[SLIP_X, i, j] = after[SLIP_Y, i, j] = 0.0
                after[STICK_VARIANCE, i, j] = after[SLIP_VARIANCE, i, j] = np.inf
                after[PROBABILITY, i, j] = after[ONSET, i, j] = 0.0
                after[END, i, j] = 1.0
            if contact[i, j] and not stays[i, j]:
                x, y = position[i, j, 0] + displacement[i, j, 0], position[i, j, 1] + displacement[i, j, 1]
                x, y = place_on_object(pose, x - shift[0], y - shift[1])
                after[STICK_X, i, j], after[STICK_Y, i, j] = x, y
                after[SLIP_X, i, j], after[SLIP_Y, i, j] = x, y
                after[STICK_VARIANCE, i, j] = after[SLIP_VARIANCE, i, j] = variance


@compiled
def slip_of_neighbours(slip: FloatArray, i: int, j: int) -> float:
    """Mean probability of ``slip`` [n, m] of the four neighbours; beyond the lattice everything slips."""
    n, m = slip.shape
    total = slip[i - 1, j] if i > 0 else 1.0
    total += slip[i + 1, j] if i < n - 1 else 1.0
    total += slip[i, j - 1] if j > 0 else 1.0
    total += slip[i, j + 1] if j < m - 1 else 1.0
    return 0.25 * total


@compiled
def decide(posterior: FloatArray, expected: FloatArray, threshold: float, decision: Decision) -> None:
    """Slip above the threshold, by the posterior and the log-odds ``expected`` of it; the probability is that of both
    with its odds shifted to ½ there. The decision's arrays must be others than these.
    """
    n, m = posterior.shape
    odds = (1.0 - threshold) / threshold
    for i in range(n):
        p = decision.probability[i]
        p[:] = expected[i]
        if p.any():  # beside forces nothing is expected
            exponentials(p)
            for j in range(m):
                likely = posterior[i, j] * p[j]
                both = likely / (1.0 - posterior[i, j] + likely)
                p[j] = both if expected[i, j] != 0.0 else posterior[i, j]
        else:
            p[:] = posterior[i]
        for j in range(m):
            decision.slip[i, j] = p[j] > threshold
            p[j] = p[j] * odds / (1.0 - p[j] + p[j] * odds)
