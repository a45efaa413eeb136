"""One element's step: an interacting-multiple-model filter of its place on the object, stuck or slipping."""

import math
from typing import NamedTuple

from slipcore.compilation import compiled
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
from slipcore.frames import FloatArray


class Increment(NamedTuple):
    """What is common to all elements of a step: its duration s, variance of a marker coordinate m², whether the growing
    normal load makes everything stick again, and whether nothing has moved for so long that places say nothing new.
    """

    interval: float
    variance: float
    restick: bool
    held: bool


class Measurement(NamedTuple):
    """What a step brings to an element: how far the object carried it, m, and the variance of that, m²; how much more
    readily it begins to slip than ``onset_length`` says; log-odds of slip from its forces; where its marker is in the
    object's frame, m, and what share of a marker's variance that has.
    """

    motion_x: float
    motion_y: float
    motion_variance: float
    readiness: float
    force_log_odds: float
    x: float
    y: float
    share: float


class PlaceEstimate(NamedTuple):
    """A place in the object's frame, m, and the variance of each coordinate, m²."""

    x: float
    y: float
    variance: float


@compiled(inline=True)
def update_element(
    old: FloatArray, new: FloatArray, i: int, j: int, seen: Measurement, increment: Increment, tuning: Tuning
) -> None:
    """Mix, predict and correct the two states (Blom and Bar-Shalom, IEEE Trans. Autom. Control 33 (1988) 780).

    With p the slip probability, a and b those that a sticking element begins to slip and a slipping one sticks:
    predicted p' = p(1 − b) + (1 − p)a; log-odds += log N(z; slip) − log N(z; stick) + those from forces. A marker far
    from both predictions was lost and found elsewhere: it says nothing, but is believed if it stays there.
    """
    p, size2 = old[PROBABILITY, i, j], seen.motion_x * seen.motion_x + seen.motion_y * seen.motion_y
    onset, end = transitions(math.sqrt(size2), seen.readiness, increment, tuning)
    slip_probability = expected(p, onset, end, tuning.least_transition)
    stick = PlaceEstimate(old[STICK_X, i, j], old[STICK_Y, i, j], old[STICK_VARIANCE, i, j])
    slip = PlaceEstimate(old[SLIP_X, i, j], old[SLIP_Y, i, j], old[SLIP_VARIANCE, i, j])
    kept_stick, kept_slip = (1.0 - p) * (1.0 - onset) / (1.0 - slip_probability), p * (1.0 - end) / slip_probability
    drift = tuning.creep**2 * increment.interval
    stuck = mix(stick, slip, kept_stick, drift, (tuning.rigidity_of_anchor * tuning.rigidity) ** 2 * size2)
    slid = mix(slip, stick, kept_slip, drift, tuning.slip_share_spread**2 * size2)
    slid = PlaceEstimate(
        slid.x - tuning.slip_share * seen.motion_x, slid.y - tuning.slip_share * seen.motion_y, slid.variance
    )
    noise = (
        seen.share * increment.variance + seen.motion_variance + (tuning.rigidity_of_fit * tuning.rigidity) ** 2 * size2
    )
    stick2 = (seen.x - stuck.x) ** 2 + (seen.y - stuck.y) ** 2
    slip2 = (seen.x - slid.x) ** 2 + (seen.y - slid.y) ** 2
    stick_variance, slip_variance = stuck.variance + noise, slid.variance + noise
    gained = 0.5 * stick2 / stick_variance - 0.5 * slip2 / slip_variance + math.log(stick_variance / slip_variance)
    trust, most = 1.0, tuning.largest_log_odds
    if increment.held:
        gained = 0.0
    if stick2 > tuning.outlier_gate * stick_variance and slip2 > tuning.outlier_gate * slip_variance:
        trust = 0.0
        stuck = PlaceEstimate(stuck.x, stuck.y, stuck.variance + tuning.outlier_spread * stick2)
        slid = PlaceEstimate(slid.x, slid.y, slid.variance + tuning.outlier_spread * slip2)
    odds = math.log(slip_probability / (1.0 - slip_probability)) + trust * min(max(gained, -most), most)
    odds = min(max(odds + seen.force_log_odds, -most), most)
    new[ONSET, i, j], new[END, i, j], new[PROBABILITY, i, j] = onset, end, 1.0 / (1.0 + math.exp(-odds))
    new[STICK_X, i, j], new[STICK_Y, i, j], new[STICK_VARIANCE, i, j] = correct(stuck, seen, noise, trust)
    new[SLIP_X, i, j], new[SLIP_Y, i, j], new[SLIP_VARIANCE, i, j] = correct(slid, seen, noise, trust)


@compiled
def transitions(motion: float, readiness: float, increment: Increment, tuning: Tuning) -> tuple[float, float]:
    """Probability that a sticking element begins to slip in a step, and that a slipping one sticks again.

    Both are hazards of an increment of motion and load, 1 − exp(−|motion|/length), and not of time: what nothing
    speaks for must not change, and rates of time would take every hold to their own ratio.
    """
    onset = -math.expm1(-motion / tuning.onset_length * readiness)
    rate = motion / tuning.end_length
    if increment.restick:
        rate += tuning.pressing_rate * increment.interval
    return onset, -math.expm1(-rate)


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
def correct(predicted: PlaceEstimate, seen: Measurement, noise: float, trust: float) -> tuple[float, float, float]:
    """Kalman update of a prediction by what was seen with variance ``noise``, m²; none at no ``trust``."""
    gain = trust * predicted.variance / (predicted.variance + noise)
    x = predicted.x + gain * (seen.x - predicted.x)
    y = predicted.y + gain * (seen.y - predicted.y)
    return x, y, predicted.variance * (1.0 - gain)
