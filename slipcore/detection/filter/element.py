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


class Estimates(NamedTuple):
    """The two states of elements, [k] each: the probability of ``slip``, and where an element is on the object if it
    sticks and if it slips, x and y m with the variance of a coordinate, m².
    """

    slip: FloatArray
    stick_x: FloatArray
    stick_y: FloatArray
    stick_variance: FloatArray
    slip_x: FloatArray
    slip_y: FloatArray
    slip_variance: FloatArray


@compiled(inline=True)
def update_elements(
    old: FloatArray,
    new: FloatArray,
    places: NDArray[np.int64],
    motion: AnchorMotion,
    seen: Measurements,
    states: Estimates,
    increment: Increment,
    tuning: Tuning,
) -> None:
    """Mix, predict and correct the two states (Blom and Bar-Shalom, IEEE Trans. Autom. Control 33 (1988) 780).

    With p the slip probability, a and b those that a sticking element begins to slip and a slipping one sticks:
    predicted p' = p(1 − b) + (1 − p)a; odds *= N(z; slip)/N(z; stick) times those from forces. ``states``: room; what
    is done there runs over elements side by side in memory, without branches, so that it is vectorised.
    """
    find_transitions(motion, seen, increment, tuning)
    take_states(old, places, states)
    update_places(states, motion, seen, increment, tuning)
    exponentials(seen.by_place)
    exponentials(seen.by_force)
    update_odds(states.slip, seen, tuning)
    put_states(places, states, seen, new)


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
def take_states(elements: FloatArray, places: NDArray[np.int64], states: Estimates) -> None:
    """Fill the states of the elements at these places."""
    for e in range(len(places)):
        i, j = places[e]
        states.slip[e] = elements[PROBABILITY, i, j]
        states.stick_x[e], states.stick_y[e] = elements[STICK_X, i, j], elements[STICK_Y, i, j]
        states.slip_x[e], states.slip_y[e] = elements[SLIP_X, i, j], elements[SLIP_Y, i, j]
        states.stick_variance[e] = elements[STICK_VARIANCE, i, j]
        states.slip_variance[e] = elements[SLIP_VARIANCE, i, j]


@compiled(inline=True)
def put_states(places: NDArray[np.int64], states: Estimates, seen: Measurements, elements: FloatArray) -> None:
    """Put the states, and the transitions that were expected, to their places."""
    for e in range(len(places)):
        i, j = places[e]
        elements[PROBABILITY, i, j], elements[ONSET, i, j] = states.slip[e], seen.readiness[e]
        elements[END, i, j] = seen.end[e]
        elements[STICK_X, i, j], elements[STICK_Y, i, j] = states.stick_x[e], states.stick_y[e]
        elements[SLIP_X, i, j], elements[SLIP_Y, i, j] = states.slip_x[e], states.slip_y[e]
        elements[STICK_VARIANCE, i, j] = states.stick_variance[e]
        elements[SLIP_VARIANCE, i, j] = states.slip_variance[e]


@compiled(inline=True)
def update_places(
    states: Estimates, motion: AnchorMotion, seen: Measurements, increment: Increment, tuning: Tuning
) -> None:
    """Predict and correct where each element is on the object if it sticks and if it slips; what the marker says of
    that.

    A marker far from both predictions was lost and found elsewhere: it says nothing, but is believed if it stays there.
    """
    of_fit = (tuning.rigidity_of_fit * tuning.rigidity) ** 2
    for e in range(len(states.slip)):
        stuck = PlaceEstimate(states.stick_x[e], states.stick_y[e], states.stick_variance[e])
        slid = PlaceEstimate(states.slip_x[e], states.slip_y[e], states.slip_variance[e])
        moved, transitions = (motion.x[e], motion.y[e]), (seen.readiness[e], seen.end[e])
        stuck, slid = predict(states.slip[e], stuck, slid, moved, transitions, increment.interval, tuning)
        noise = seen.share[e] * increment.variance + motion.variance[e]
        noise += of_fit * (moved[0] * moved[0] + moved[1] * moved[1])
        x, y = seen.x[e], seen.y[e]
        stick2, slip2 = (x - stuck.x) ** 2 + (y - stuck.y) ** 2, (x - slid.x) ** 2 + (y - slid.y) ** 2
        stick_variance, slip_variance = stuck.variance + noise, slid.variance + noise
        lost = (stick2 > tuning.outlier_gate * stick_variance) & (slip2 > tuning.outlier_gate * slip_variance)
        silent = lost | increment.held
        seen.by_place[e] = 0.0 if silent else 0.5 * stick2 / stick_variance - 0.5 * slip2 / slip_variance
        seen.ratio[e] = 1.0 if silent else stick_variance / slip_variance
        trust, spread = (0.0, tuning.outlier_spread) if lost else (1.0, 0.0)
        stuck, slid = correct(stuck, x, y, noise, trust, spread), correct(slid, x, y, noise, trust, spread)
        states.stick_x[e], states.stick_y[e], states.stick_variance[e] = stuck.x, stuck.y, stuck.variance
        states.slip_x[e], states.slip_y[e], states.slip_variance[e] = slid.x, slid.y, slid.variance


@compiled(inline=True)
def update_odds(slip: FloatArray, seen: Measurements, tuning: Tuning) -> None:
    """Bring probabilities of slip [k] to those after the step, by the odds of place and of force."""
    largest = math.exp(tuning.largest_log_odds)
    least = 1.0 / largest
    for e in range(len(slip)):
        before = expected(slip[e], seen.readiness[e], seen.end[e], tuning.least_transition)
        by_place = min(max(seen.by_place[e] * seen.ratio[e], least), largest)
        odds = min(max(before / (1.0 - before) * by_place * seen.by_force[e], least), largest)
        slip[e] = odds / (1.0 + odds)


@compiled(inline=True)
def predict(
    p: float,
    stick: PlaceEstimate,
    slip: PlaceEstimate,
    moved: tuple[float, float],
    transitions: tuple[float, float],
    interval: float,
    tuning: Tuning,
) -> tuple[PlaceEstimate, PlaceEstimate]:
    """Where an element that slipped with probability ``p`` is if it sticks and if it slips, after the object ``moved``
    by x and y m in its own frame. ``transitions``: probabilities that it began to slip, and that it stuck again.
    """
    (moved_x, moved_y), (onset, end) = moved, transitions
    size2 = moved_x * moved_x + moved_y * moved_y
    slip_probability = expected(p, onset, end, tuning.least_transition)
    kept_stick, kept_slip = (1.0 - p) * (1.0 - onset) / (1.0 - slip_probability), p * (1.0 - end) / slip_probability
    drift = tuning.creep**2 * interval
    stuck = mix(stick, slip, kept_stick, drift, (tuning.rigidity_of_anchor * tuning.rigidity) ** 2 * size2)
    slid = mix(slip, stick, kept_slip, drift, tuning.slip_share_spread**2 * size2)
    x, y = slid.x - tuning.slip_share * moved_x, slid.y - tuning.slip_share * moved_y
    return stuck, PlaceEstimate(x, y, slid.variance)


@compiled(inline=True)
def expected(p: float, onset: float, end: float, least: float) -> float:
    """How probable slip is after a step in which a sticking element begins to slip, and a slipping one to stick, so."""
    return min(max(p * (1.0 - end) + (1.0 - p) * onset, least), 1.0 - least)


@compiled(inline=True)
def mix(own: PlaceEstimate, other: PlaceEstimate, kept: float, drift: float, spread: float) -> PlaceEstimate:
    """Mean of two estimates with weights ``kept`` and the rest; its variance grown by ``drift`` + ``spread``, m²."""
    left = 1.0 - kept
    apart = 0.5 * ((own.x - other.x) ** 2 + (own.y - other.y) ** 2)
    variance = kept * own.variance + left * other.variance + kept * left * apart
    return PlaceEstimate(kept * own.x + left * other.x, kept * own.y + left * other.y, variance + drift + spread)


@compiled(inline=True)
def correct(predicted: PlaceEstimate, x: float, y: float, noise: float, trust: float, spread: float) -> PlaceEstimate:
    """Kalman update of a prediction by a place seen with variance ``noise``, m²; at no ``trust`` none, and the variance
    grows by a ``spread`` of the distance² instead.
    """
    variance = predicted.variance + spread * ((x - predicted.x) ** 2 + (y - predicted.y) ** 2)
    gain = trust * variance / (variance + noise)
    return PlaceEstimate(
        predicted.x + gain * (x - predicted.x), predicted.y + gain * (y - predicted.y), variance * (1.0 - gain)
    )
