"""Frames that are not the sensor's: those that a recorder wrote again, without which whole logs are looked at, and
those that were interpolated.

By the noise of three frames in a row repeated ones look as if fields were smoothed over neighbours, and were sharpened;
of interpolated ones it is too small.
"""

from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from slipcore.defaults import LIMITS, NOISE, FilterOptions
from slipcore.frames import BoolArray, GraspLog
from slipcore.patch_record import Patch
from slipcore.slip_state import SlipHistory, slip_events

PER_FRAME = ("contact", "slip", "probability", "stick_ratio", "velocity", "macro_slip")
"""Fields of a history that have a value for each frame."""


def repeated(log: GraspLog) -> BoolArray:
    """Which frames [t] read what the one before read, to the last bit, of displacement and forces; zeros, with which
    sensors' software says that nothing touches, and which simulated ones read at rest, are no readings.
    """
    readings = [field for field in (log.displacement, log.force) if field is not None and field.any()]
    same = np.zeros(len(log), bool)
    if readings:
        same[1:] = np.logical_and.reduce([(field[1:] == field[:-1]).all(axis=(1, 2, 3)) for field in readings])
        same &= np.logical_or.reduce([field.any(axis=(1, 2, 3)) for field in readings])
    if log.observed is not None:
        same[1:] &= (log.observed[1:] == log.observed[:-1]).all(axis=(1, 2))
    return same


def own_frames(log: GraspLog) -> BoolArray:
    """Which frames [t] are the sensor's own: all but repeated ones, unless these stay so for ``stale_time`` and more,
    as where nothing moves and nothing has noise, or too few would be left for a log.
    """
    same = repeated(log)
    first = np.flatnonzero(~same)
    last = np.append(first[1:], len(log)) - 1
    short = log.time[last] - log.time[first] < NOISE.stale_time
    own = ~same | ~np.repeat(short, last - first + 1)
    return own if np.count_nonzero(own) >= LIMITS.min_frames else np.ones(len(log), bool)


def interpolated(log: GraspLog) -> BoolArray:
    """Which frames [t] lie on the line between the one before and the one after, between which markers move; by as many
    elements as show the noise. None where such stretches are fewer than the longest has frames: markers without noise
    go straight for long, and a recorder fills in little between any two frames of its sensor.
    """
    step = max(1, log.displacement[0, ..., 0].size // NOISE.series)
    place = log.displacement.reshape(len(log), -1, 3)[:, ::step].reshape(len(log), -1)
    before, at, after = place[:-2], place[1:-1], place[2:]
    share = ((log.time[1:-1] - log.time[:-2]) / (log.time[2:] - log.time[:-2]))[:, None]
    between = np.zeros(len(log), bool)
    off = np.abs(at - (1.0 - share) * before - share * after).max(axis=1)
    between[1:-1] = (off <= NOISE.least_step) & (before != after).any(axis=1)
    stretches = np.diff(np.flatnonzero(~between)) - 1
    is_filled_in = np.count_nonzero(stretches) >= stretches.max(initial=0)
    return between if is_filled_in else np.zeros(len(log), bool)


def noise_of_own_frames(log: GraspLog) -> dict[str, float]:
    """The option that gives method "filter" the noise of markers, where frames between the sensor's hide it."""
    from slipcore.noise import estimate_noise  # with its compiler, which the checks do without

    between = interpolated(log)
    if not between.any() or np.count_nonzero(~between) < LIMITS.min_frames:
        return {}
    own = log.take(~between)
    series = np.moveaxis(own.displacement[..., :2], -1, 1).reshape(len(own), 2, -1)
    noise = float(np.nan_to_num(estimate_noise(own.time, series)))
    return {"displacement_floor": noise} if noise > FilterOptions().displacement_floor else {}


def with_repeated(history: SlipHistory, log: GraspLog, own: BoolArray) -> SlipHistory:
    """The history of a log from that of its ``own`` frames [t]: a repeated one has what that had which it repeats."""
    source = np.cumsum(own) - 1
    found = {name: getattr(history, name)[source] for name in PER_FRAME}
    events = slip_events(log.time, found["contact"], found["slip"], log.observed)
    patches = tuple(_over(patch, source) for patch in history.patches)
    return replace(history, time=log.time, events=events, observed=log.observed, patches=patches, **found)


def of_own(log: GraspLog, history: SlipHistory) -> tuple[GraspLog, SlipHistory]:
    """A log and its history without repeated frames: what is chosen by one frame's noise must not be of the same."""
    own = own_frames(log)
    if own.all():
        return log, history
    found = {name: getattr(history, name)[own] for name in PER_FRAME}
    observed = None if history.observed is None else history.observed[own]
    patches = tuple(each for patch in history.patches if (each := _without(patch, own)) is not None)
    return log.take(own), replace(history, time=log.time[own], observed=observed, patches=patches, **found)


def _without(patch: Patch, own: BoolArray) -> Patch | None:
    """A patch over the ``own`` frames [t] of a log alone; None where it is seen in none of them."""
    kept, first = own[patch.frames], int(np.count_nonzero(own[: patch.first]))
    if not kept.any():
        return None
    within = {each.name: getattr(patch, each.name)[kept] for each in fields(patch) if each.name != "first"}
    within["noise_frames"] = np.maximum(within["noise_frames"] * kept.mean(), 1.0)
    return replace(patch, first=first, **within)


def _over(patch: Patch, source: NDArray[np.int64]) -> Patch:
    """A patch over all frames of which ``source`` [t] is in its own; repeated noise averages no better."""
    begin, end = np.searchsorted(source, [patch.first, patch.first + len(patch.pose)])
    within = source[begin:end] - patch.first
    over = {each.name: getattr(patch, each.name)[within] for each in fields(patch) if each.name != "first"}
    over["noise_frames"] = over["noise_frames"] * (len(within) / len(patch.pose))
    return replace(patch, first=int(begin), **over)
