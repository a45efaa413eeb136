"""The step of elements: an interacting-multiple-model filter of each one's place on the object, stuck or slipping."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import compiled
from slipcore.detection.filter.pose import AnchorMotion
from slipcore.detection.filter.state import (
    END,
    ONSET,
    PROBABILITY,
    SLIP_VARIANCE,
    SLIP_X,
    SLIP_Y,
    STICK_VARIANCE,
    STICK_X,
    STICK_Y,
)
from slipcore.detection.filter.tuning import Tuning
from slipcore.elementary import exponentials, probabilities_of_hazards
from slipcore.frames import FloatArray


class Increment(NamedTuple):
    """What is common to all elements of a step: its duration s, variance of a marker coordinate m², whether the growing
    normal load makes everything stick again, and whether nothing has moved for so long that places say nothing new.
    """

    interval: float
    variance: float
    restick: bool
    held: bool


class Measurements(NamedTuple):
    """What a step brings to elements, [k] each: where their markers are in the object's frame, ``x`` and ``y`` m, and
    what ``share`` of a marker's variance that has; how much more readily they begin to slip than ``onset_length`` says;
    log-odds of slip ``by_force``; and what ``update_elements`` fills: in place of the ``readiness`` the probability
    that they begin to slip if they stick, that they stick again at their ``end`` of slip, the log-odds by place without
    the variances, and the ``ratio`` of these.
    """

    x: FloatArray
    y: FloatArray
    share: FloatArray
    readiness: FloatArray
    by_force: FloatArray
    end: FloatArray
    by_place: FloatArray
    ratio: FloatArray


class PlaceEstimate(NamedTuple):
    """A place in the object's frame, m, and the variance of each coordinate, m²."""

    x: float
    y: float
    variance: float


@compiled(inline=True)
def update_elements(
    old: FloatArray,
    new: FloatArray,
    places: NDArray[np.int64],
    motion: AnchorMotion,
    seen: Measurements,
    increment: Increment,
    tuning: Tuning,
) -> None:
    """Mix, predict and correct the two states (Blom and Bar-Shalom, IEEE Trans. Autom. Control 33 (1988) 780).

    With p the slip probability, a and b those that a sticking element begins to slip and a slipping one sticks:
    predicted p' = p(1 − b) + (1 − p)a; odds *= N(z; slip)/N(z; stick) times those from forces.
    """
    find_transitions(motion, seen, increment, tuning)
    for e in range(len(places)):
        update_places(old, new, (places[e, 0], places[e, 1]), e, motion, seen, increment, tuning)
    exponentials(seen.by_place)
    exponentials(seen.by_force)
    largest = math.exp(tuning.largest_log_odds)
    least = 1.0 / largest
    for e in range(len(places)):
        i, j = places[e]
        onset, end = seen.readiness[e], seen.end[e]
        slip = expected(old[PROBABILITY, i, j], onset, end, tuning.least_transition)
        by_place = min(max(seen.by_place[e] * seen.ratio[e], least), largest)
        odds = min(max(slip / (1.0 - slip) * by_place * seen.by_force[e], least), largest)
        new[ONSET, i, j], new[END, i, j], new[PROBABILITY, i, j] = onset, end, odds / (1.0 + odds)


@compiled
def find_transitions(motion: AnchorMotion, seen: Measurements, increment: Increment, tuning: Tuning) -> None:
    """Fill the probability that a sticking element begins to slip in a step, and that a slipping one sticks again.

    Both are hazards of an increment of motion and load, 1 − exp(−|motion|/length), and not of time: what nothing
    speaks for must not change, and rates of time would take every hold to their own ratio.
    """
    pressed = tuning.pressing_rate * increment.interval if increment.restick else 0.0
    for e in range(len(motion.x)):
        moved = math.sqrt(motion.x[e] * motion.x[e] + motion.y[e] * motion.y[e])
        seen.readiness[e] *= moved / tuning.onset_length
        seen.end[e] = moved / tuning.end_length + pressed
    probabilities_of_hazards(seen.readiness)
    probabilities_of_hazards(seen.end)


@compiled(inline=True)
def update_places(
    old: FloatArray,
    new: FloatArray,
    place: tuple[int, int],
    e: int,
    motion: AnchorMotion,
    seen: Measurements,
    increment: Increment,
    tuning: Tuning,
) -> None:
    """Predict and correct where an element is on the object if it sticks and if it slips; what the marker says of that.

    A marker far from both predictions was lost and found elsewhere: it says nothing, but is believed if it stays there.
    """
    (i, j), moved = place, (motion.x[e], motion.y[e])
    size2 = moved[0] * moved[0] + moved[1] * moved[1]
    stuck, slid = predict(old, place, moved, (seen.readiness[e], seen.end[e]), increment.interval, tuning)
    noise = seen.share[e] * increment.variance + motion.variance[e]
    noise += (tuning.rigidity_of_fit * tuning.rigidity) ** 2 * size2
    x, y = seen.x[e], seen.y[e]
    stick2, slip2 = (x - stuck.x) ** 2 + (y - stuck.y) ** 2, (x - slid.x) ** 2 + (y - slid.y) ** 2
    stick_variance, slip_variance = stuck.variance + noise, slid.variance + noise
    trust = 1.0
    seen.by_place[e] = 0.5 * stick2 / stick_variance - 0.5 * slip2 / slip_variance
    seen.ratio[e] = stick_variance / slip_variance
    if stick2 > tuning.outlier_gate * stick_variance and slip2 > tuning.outlier_gate * slip_variance:
        trust = 0.0
        stuck = PlaceEstimate(stuck.x, stuck.y, stuck.variance + tuning.outlier_spread * stick2)
        slid = PlaceEstimate(slid.x, slid.y, slid.variance + tuning.outlier_spread * slip2)
    if increment.held or trust == 0.0:
        seen.by_place[e], seen.ratio[e] = 0.0, 1.0
    new[STICK_X, i, j], new[STICK_Y, i, j], new[STICK_VARIANCE, i, j] = correct(stuck, x, y, noise, trust)
    new[SLIP_X, i, j], new[SLIP_Y, i, j], new[SLIP_VARIANCE, i, j] = correct(slid, x, y, noise, trust)


@compiled(inline=True)
def predict(
    old: FloatArray,
    place: tuple[int, int],
    moved: tuple[float, float],
    transitions: tuple[float, float],
    interval: float,
    tuning: Tuning,
) -> tuple[PlaceEstimate, PlaceEstimate]:
    """Where an element is if it sticks and if it slips, after the object ``moved`` by x and y m in its own frame.

    ``transitions``: probabilities that it began to slip, and that it stuck again.
    """
    (i, j), (moved_x, moved_y), (onset, end) = place, moved, transitions
    p, size2 = old[PROBABILITY, i, j], moved_x * moved_x + moved_y * moved_y
    slip_probability = expected(p, onset, end, tuning.least_transition)
    stick = PlaceEstimate(old[STICK_X, i, j], old[STICK_Y, i, j], old[STICK_VARIANCE, i, j])
    slip = PlaceEstimate(old[SLIP_X, i, j], old[SLIP_Y, i, j], old[SLIP_VARIANCE, i, j])
    kept_stick, kept_slip = (1.0 - p) * (1.0 - onset) / (1.0 - slip_probability), p * (1.0 - end) / slip_probability
    drift = tuning.creep**2 * interval
    stuck = mix(stick, slip, kept_stick, drift, (tuning.rigidity_of_anchor * tuning.rigidity) ** 2 * size2)
    slid = mix(slip, stick, kept_slip, drift, tuning.slip_share_spread**2 * size2)
    x, y = slid.x - tuning.slip_share * moved_x, slid.y - tuning.slip_share * moved_y
    return stuck, PlaceEstimate(x, y, slid.variance)


@compiled
def expected(p: float, onset: float, end: float, least: float) -> float:
    """How probable slip is after a step in which a sticking element begins to slip, and a slipping one to stick, so."""
    return min(max(p * (1.0 - end) + (1.0 - p) * onset, least), 1.0 - least)


@compiled
def mix(own: PlaceEstimate, other: PlaceEstimate, kept: float, drift: float, spread: float) -> PlaceEstimate:
    """Mean of two estimates with weights ``kept`` and the rest; its variance grown by ``drift`` + ``spread``, m²."""
    left = 1.0 - kept
    apart = 0.5 * ((own.x - other.x) ** 2 + (own.y - other.y) ** 2)
    variance = kept * own.variance + left * other.variance + kept * left * apart
    return PlaceEstimate(kept * own.x + left * other.x, kept * own.y + left * other.y, variance + drift + spread)


@compiled
def correct(predicted: PlaceEstimate, x: float, y: float, noise: float, trust: float) -> tuple[float, float, float]:
    """Kalman update of a prediction by a place seen with variance ``noise``, m²; none at no ``trust``."""
    gain = trust * predicted.variance / (predicted.variance + noise)
    return (
        predicted.x + gain * (x - predicted.x),
        predicted.y + gain * (y - predicted.y),
        predicted.variance * (1.0 - gain),
    )
