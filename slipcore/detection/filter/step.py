"""One step of method ``filter``: two states an element, stick and slip, on its place on the object and force ratio."""

import math

import numpy as np

from slipcore.compilation import compiled
from slipcore.detection.filter.element import Increment, Measurement, update_element
from slipcore.detection.filter.force_ratio import follow_forces, weigh_forces
from slipcore.detection.filter.loading import low_pass, restick_under_load
from slipcore.detection.filter.pose import Anchors, Pose, object_motion, place_on_object
from slipcore.detection.filter.state import (
    END,
    ONSET,
    POSE,
    PROBABILITY,
    REFERENCE,
    SLIP_VARIANCE,
    SLIP_X,
    SLIP_Y,
    STICK_VARIANCE,
    STICK_X,
    STICK_Y,
    STILL,
)
from slipcore.detection.filter.surface_motion import step_pose, store_pose, stored_pose
from slipcore.detection.filter.tuning import Tuning, tuning_of
from slipcore.detection.shared.observe import same
from slipcore.detection.shared.records import Decision, FrameArrays, Memory, Sensor, Surface
from slipcore.frames import BoolArray, FloatArray


@compiled
def step_filter(
    sensor: Sensor,
    last: FrameArrays,
    frame: FrameArrays,
    surface: Surface,
    before: Memory,
    after: Memory,
    decision: Decision,
) -> None:
    """Fill ``elements`` and ``common`` of the memory ``after``, and the decision."""
    tuning = tuning_of(sensor.settings)
    after.common[:] = before.common
    if same(last.displacement, frame.displacement) and not touches_anew(after.contact, surface.stays):
        after.elements[:] = before.elements  # a frame that repeats the last tells nothing
        after.elements[ONSET] = after.elements[END] = 0.0
    else:
        step_elements(sensor.position, last, frame, surface, before, after, tuning)
    decide(after.elements[PROBABILITY], tuning.threshold, decision)


@compiled
def step_elements(
    position: FloatArray,
    last: FrameArrays,
    frame: FrameArrays,
    surface: Surface,
    before: Memory,
    after: Memory,
    tuning: Tuning,
) -> None:
    """The object's motion, the load's change and the forces' log-odds; then each element that stays in contact."""
    marker_noise = tuning.unknown_noise if math.isnan(surface.marker_noise) else surface.marker_noise
    variance = (tuning.noise_margin * marker_noise) ** 2 + tuning.displacement_floor**2
    pressing_noise = 0.0 if math.isnan(surface.pressing_noise) else surface.pressing_noise
    force_noise = tuning.force_noise_margin * pressing_noise
    interval, has_force = frame.time - last.time, frame.force.size > 0
    common, elements = before.common, before.elements
    last_pose = stored_pose(common, POSE)
    places = places_of(elements, surface.stays)
    anchors = anchors_of(elements, places, position, frame.displacement)
    pose, spread = step_pose(anchors, last_pose, last, frame, variance, tuning, after.common)
    reference = stored_pose(common, REFERENCE)
    motion_x, motion_y, motion_variance, reference = object_motion(anchors, reference, pose, spread, tuning.motion_play)
    store_pose(after.common, REFERENCE, reference)
    moves = motion_x.any() or motion_y.any()
    after.common[STILL] = 0.0 if moves else common[STILL] + interval
    change = force_change(places, last.force, frame.force)
    deeper = indentation_change(places, last.displacement, frame.displacement)
    noise = interval, variance, force_noise
    restick = restick_under_load(common, after.common, anchors, (motion_x, motion_y), deeper, change, noise, tuning)
    readiness = 0.0 if restick or math.isnan(surface.marker_noise) else 1.0  # nor does it begin before noise is known
    log_odds = np.zeros(len(places))
    follow_forces(elements, surface, has_force, low_pass(interval, tuning.force_smoothing), after.elements)
    if change.size:
        log_odds = weigh_forces(elements, places, force_noise, interval, tuning, after.elements, after.common)
    start_elements(position, frame.displacement, after.contact, surface.stays, pose, variance, after.elements)
    increment = Increment(interval, variance, restick, after.common[STILL] > tuning.hold_time)
    for e in range(len(places)):
        i, j = places[e]
        near = tuning.onset_inside + tuning.onset_at_front * slip_of_neighbours(elements, after.contact, i, j)
        x, y = place_on_object(pose, anchors.marker_x[e], anchors.marker_y[e])
        seen = Measurement(motion_x[e], motion_y[e], motion_variance[e], readiness * near, log_odds[e], x, y)
        update_element(elements, after.elements, i, j, seen, increment, tuning)


@compiled
def touches_anew(contact: BoolArray, stays: BoolArray) -> bool:
    """Whether an element touches that did not."""
    return bool((contact != stays).any())


@compiled
def places_of(elements: FloatArray, stays: BoolArray) -> FloatArray:
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
def anchors_of(elements: FloatArray, places: FloatArray, position: FloatArray, displacement: FloatArray) -> Anchors:
    """What the fit of the pose needs, at these places."""
    rows = np.empty((6, len(places)))
    for e in range(len(places)):
        i, j = places[e]
        rows[0, e], rows[1, e] = elements[STICK_X, i, j], elements[STICK_Y, i, j]
        rows[2, e] = elements[STICK_VARIANCE, i, j]
        rows[3, e], rows[4, e] = position[i, j, 0] + displacement[i, j, 0], position[i, j, 1] + displacement[i, j, 1]
        rows[5, e] = 1.0 - elements[PROBABILITY, i, j]
    return Anchors(rows[0], rows[1], rows[2], rows[3], rows[4], rows[5])


@compiled
def indentation_change(places: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
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
def start_elements(
    position: FloatArray,
    displacement: FloatArray,
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
                x, y = position[i, j, 0] + displacement[i, j, 0], position[i, j, 1] + displacement[i, j, 1]
                x, y = place_on_object(pose, x, y)
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
def decide(posterior: FloatArray, threshold: float, decision: Decision) -> None:
    """Slip above the threshold; the probability is the posterior with its odds shifted to ½ there."""
    n, m = posterior.shape
    odds = (1.0 - threshold) / threshold
    for i in range(n):
        for j in range(m):
            p = posterior[i, j]
            decision.slip[i, j] = p > threshold
            decision.probability[i, j] = p * odds / (1.0 - p + p * odds)
