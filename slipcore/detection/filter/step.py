"""One step of method ``filter``: two states an element, stick and slip, on its place on the object and force ratio."""

import math

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import compiled
from slipcore.detection.filter.element import Increment, Measurement, update_element
from slipcore.detection.filter.force_ratio import follow_forces, keep_ratios, weigh_forces
from slipcore.detection.filter.heading import follow_headings
from slipcore.detection.filter.hold import keeps_contact, step_hold
from slipcore.detection.filter.loading import low_pass, restick_under_load
from slipcore.detection.filter.pooling import find_offsets, pooled_offset
from slipcore.detection.filter.pose import AnchorMotion, Anchors, Pose, object_motion, place_on_object
from slipcore.detection.filter.slip_limit import step_limits
from slipcore.detection.filter.state import (
    DOUBTED_FRAMES,
    END,
    EXPECTED,
    FORCE_FRAMES,
    LASTING,
    ONSET,
    POSE,
    PROBABILITY,
    REFERENCE,
    RESOLUTION,
    SLIP_VARIANCE,
    SLIP_X,
    SLIP_Y,
    STICK_VARIANCE,
    STICK_X,
    STICK_Y,
)
from slipcore.detection.filter.surface_motion import step_pose, store_pose, stored_pose
from slipcore.detection.filter.surroundings import shift_of_surroundings
from slipcore.detection.filter.tuning import Tuning, tuning_of
from slipcore.detection.shared.lasting_noise import OF_STEP
from slipcore.detection.shared.observe import same
from slipcore.detection.shared.records import Decision, DetectorSetup, FrameArrays, Memory, Surface, Workspace
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
    if keeps_contact(frame, noise_of_frame(room.surface, tuning), has_force, tuning, before.common):
        after.contact[:] = before.contact
        room.surface.stays[:] = before.contact
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
    surface = room.surface
    marker_noise, _, between_neighbours, resolution = surface.noise
    lasting = lasting_noise(marker_noise, between_neighbours, resolution, tuning)
    after.common[RESOLUTION] = resolution
    after.common[LASTING] = lasting if lasting > known_or(marker_noise, tuning.unknown_noise) else 0.0
    variance, force_noise = noise_of_frame(surface, tuning)
    interval, common, elements = frame.time - last.time, before.common, before.elements
    last_pose = stored_pose(common, POSE)
    places = room.places[: find_places(elements, surface.stays, room.places)]
    anchors, motion, deeper, change, told = rooms_of(room.rows, len(places))
    shift = shift_of_surroundings(
        last, frame, before.contact, after.contact, room.weight, room.rows, tuning, after.common
    )
    find_anchors(elements, places, position, frame.displacement, shift, anchors)
    pose, spread = step_pose(anchors, last_pose, last, frame, variance, tuning, after.common)
    noise = interval, variance, force_noise
    held = step_hold(anchors, pose, spread, frame, noise, has_force, tuning, after.common)
    reference = stored_pose(common, REFERENCE)
    reference = object_motion(anchors, reference, pose, spread, tuning.motion_play, motion)
    if held:
        motion.x[:] = 0.0
        motion.y[:] = 0.0
    else:
        store_pose(after.common, REFERENCE, reference)
    if not (has_force and last.force.size):
        change = change[:, :0]
    force_change(places, last.force, frame.force, change)
    indentation_change(places, last.displacement, frame.displacement, deeper)
    restick = restick_under_load(common, after.common, anchors, motion, deeper, change, noise, tuning) and not held
    readiness = 0.0 if restick or math.isnan(marker_noise) else 1.0  # nor does it begin before noise is known
    follow_forces(elements, surface, has_force, low_pass(interval, tuning.force_smoothing), after.elements)
    follow_headings(elements, places, motion, pose, frame.force, tuning.heading_length, after.elements)
    if held:
        keep_ratios(elements, places, after.elements, told)
    elif change.size:
        weigh_forces(elements, places, force_noise, interval, tuning, after.elements, after.common, told)
    else:
        told[:] = 0.0
    start_elements(position, frame.displacement, shift, surface.stays, pose, variance, after)
    increment = Increment(interval, variance, restick, held)
    find_offsets(anchors, pose, places, room.offsets)
    # Neighbours blur where slip begins; only what no force shows is worth that.
    beside = (
        0.0 if resolution > 0.0 or has_force else lasting * lasting / (lasting * lasting + tuning.pooling_length**2)
    )
    scale = 4.0 * tuning.pooling_outlier * variance
    for e in range(len(places)):
        i, j = places[e]
        near = tuning.onset_inside + tuning.onset_at_front * slip_of_neighbours(elements, after.contact, i, j)
        x, y, left = pooled_offset(room.offsets, i, j, scale, beside)
        seen = Measurement(
            motion.x[e],
            motion.y[e],
            motion.variance[e],
            readiness * near,
            told[0, e],
            anchors.x[e] + x,
            anchors.y[e] + y,
            left,
        )
        update_element(elements, after.elements, i, j, seen, increment, tuning)
    sight = last.displacement, frame.displacement, after.contact, surface.stays
    measured = has_force and tuning.force_floor == 0.0  # what is reconstructed from markers says no more than they do
    rooms, noise_now = (room.rows, room.series), (math.sqrt(variance), held, measured)  # anchors are done with
    step_limits(elements, places, motion, sight, noise_now, tuning, rooms, after)


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


@compiled
def rooms_of(rows: FloatArray, count: int) -> tuple[Anchors, AnchorMotion, FloatArray, FloatArray, FloatArray]:
    """Where ``rows`` take what is worked out of so many anchors: themselves, how they move, how much deeper they are,
    change of force [3, k], and the evidence of these [2, k].
    """
    r = rows[:, :count]
    anchors = Anchors(r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7])
    return anchors, AnchorMotion(r[8], r[9], r[10]), r[11], r[12:15], r[15:17]


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
    """Fill the change of force [3, k] N at these places; ``change`` is empty where a force is missing."""
    for e in range(change.shape[1]):
        i, j = places[e]
        for a in range(3):
            change[a, e] = now[i, j, a] - before[i, j, a]


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
    after[STICK_X : SLIP_VARIANCE + 1] = 0.0
    n, m = contact.shape
    for i in range(n):
        for j in range(m):
            if not stays[i, j]:
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
def slip_of_neighbours(elements: FloatArray, contact: BoolArray, i: int, j: int) -> float:
    """Mean slip probability of the four neighbours; beyond the contact's edge everything slips."""
    n, m = contact.shape
    total = 0.0
    total += elements[PROBABILITY, i - 1, j] if i > 0 and contact[i - 1, j] else 1.0
    total += elements[PROBABILITY, i + 1, j] if i < n - 1 and contact[i + 1, j] else 1.0
    total += elements[PROBABILITY, i, j - 1] if j > 0 and contact[i, j - 1] else 1.0
    total += elements[PROBABILITY, i, j + 1] if j < m - 1 and contact[i, j + 1] else 1.0
    return 0.25 * total


@compiled
def decide(posterior: FloatArray, expected: FloatArray, threshold: float, decision: Decision) -> None:
    """Slip above the threshold, by the posterior and the log-odds ``expected`` of it; the probability is that of both
    with its odds shifted to ½ there.
    """
    n, m = posterior.shape
    odds = (1.0 - threshold) / threshold
    for i in range(n):
        for j in range(m):
            p = posterior[i, j]
            if expected[i, j] != 0.0:
                likely = p * math.exp(expected[i, j])
                p = likely / (1.0 - p + likely)
            decision.slip[i, j] = p > threshold
            decision.probability[i, j] = p * odds / (1.0 - p + p * odds)
