"""How well a prediction agrees with a scene's truth (formulas: docs/slip-benchmark.md)."""

from dataclasses import dataclass

import numpy as np

from service.slip_benchmark.folder import Prediction, Truth
from slipcore.frames import BoolArray, FloatArray

NAN = float("nan")


@dataclass(frozen=True, slots=True)
class Measures:
    """Scores of one method on one scene; NaN where a score has no meaning or the method does not say.

    ``f1`` of slip and ``false_slip``, over elements in contact that were observed; ``onset_delay`` s, median (below 0:
    early), and the share of ``missed_onsets``; ``stick_ratio_error``, root mean square; ``macro_f1`` over frames;
    ``friction_error`` and ``force_error``, relative; ``brier`` score of the probability.
    """

    f1: float = NAN
    false_slip: float = NAN
    onset_delay: float = NAN
    missed_onsets: float = NAN
    stick_ratio_error: float = NAN
    macro_f1: float = NAN
    friction_error: float = NAN
    force_error: float = NAN
    brier: float = NAN


def measure(truth: Truth, prediction: Prediction, observed: BoolArray | None) -> Measures:
    """All scores of a prediction; elements that were not ``observed`` [t, n, m] count in the force alone."""
    judged = truth.contact if observed is None else truth.contact & observed
    true, found = truth.slip & judged, prediction.slip & judged
    delays, missed = onsets(truth.time, true, found, judged)
    macro = whole(found, judged) if prediction.macro_slip is None else prediction.macro_slip & judged.any(axis=(1, 2))
    return Measures(
        f1=f1(true, found),
        false_slip=_share(found & ~true, judged & ~true),
        onset_delay=float(np.median(delays)) if len(delays) else NAN,
        missed_onsets=missed,
        stick_ratio_error=stick_ratio_error(judged, true, found),
        macro_f1=f1(whole(true, judged), macro),
        friction_error=NAN if prediction.friction is None else abs(prediction.friction / float(truth.friction) - 1.0),
        force_error=NAN if prediction.force is None else force_error(truth, prediction.force),
        brier=NAN if prediction.probability is None else _mean((prediction.probability - truth.slip)[judged] ** 2),
    )


def f1(true: BoolArray, found: BoolArray) -> float:
    """F1 of two masks; NaN where neither has anything."""
    total = np.count_nonzero(true) + np.count_nonzero(found)
    return 2.0 * np.count_nonzero(true & found) / total if total else NAN


def whole(slip: BoolArray, contact: BoolArray) -> BoolArray:
    """Frames [t] in which something touches and all of that slips."""
    return np.asarray(contact.any(axis=(1, 2)) & ~(contact & ~slip).any(axis=(1, 2)))


def stick_ratio_error(contact: BoolArray, true: BoolArray, found: BoolArray) -> float:
    """Root mean square over frames in contact of the difference of the shares of elements that stick."""
    count = contact.sum(axis=(1, 2))
    touched = count > 0
    differ = (true.sum(axis=(1, 2)) - found.sum(axis=(1, 2)))[touched] / count[touched]
    return float(np.sqrt(_mean(differ**2)))


def onsets(time: FloatArray, true: BoolArray, found: BoolArray, contact: BoolArray) -> tuple[FloatArray, float]:
    """Delay s of each true onset that was found, and the share that was missed.

    An onset is where an element [t, n, m] that stuck in contact begins to slip. It is found where any of that slip is;
    what was said to slip already counts from when that was said first, which makes it early.
    """
    begins = true[1:] & ~true[:-1] & contact[:-1]
    element, frame = np.nonzero(begins.reshape(len(begins), -1).T)
    truly, prediction = (mask.reshape(len(mask), -1).T for mask in (true, found))
    delays = [_found(truly[i], prediction[i], int(k) + 1, time) for i, k in zip(element, frame, strict=True)]
    known = np.array([delay for delay in delays if delay is not None], float)
    return known, 1.0 - len(known) / len(delays) if delays else NAN


def _found(true: BoolArray, prediction: BoolArray, begin: int, time: FloatArray) -> float | None:
    """Delay of one onset, at frame ``begin`` of an element's masks [t]; None where it was missed."""
    rest = np.flatnonzero(~true[begin:])
    end = begin + int(rest[0]) if len(rest) else len(true)
    hits = np.flatnonzero(prediction[begin:end])
    if not len(hits):
        return None
    first = begin + int(hits[0])
    if first == begin:
        silent = np.flatnonzero(~prediction[:begin])
        first = int(silent[-1]) + 1 if len(silent) else 0
    return float(time[first] - time[begin])


def force_error(truth: Truth, prediction: FloatArray) -> float:
    """L2 over time of the difference of forces, relative to the true ones."""
    return float(np.linalg.norm(prediction - truth.force) / np.linalg.norm(truth.force))


def _share(part: BoolArray, of: BoolArray) -> float:
    count = np.count_nonzero(of)
    return np.count_nonzero(part) / count if count else NAN


def _mean(values: FloatArray) -> float:
    return float(values.mean()) if values.size else NAN
