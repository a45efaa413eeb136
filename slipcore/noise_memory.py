"""Noise that lasts from frame to frame: how much of it there is, and for how long.

White noise beside a first-order autoregressive process, whose correlation over k frames is φᵏ.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar, nnls

from slipcore.compilation import compiled
from slipcore.defaults import NOISE
from slipcore.frames import FloatArray
from slipcore.noise import noise_of_three

IntArray = NDArray[np.int64]


class NoiseMemory(NamedTuple):
    """Variances of what is ``white`` and what is ``correlated``, the latter by φ = ``memory`` from frame to frame."""

    white: float
    correlated: float
    memory: float

    @property
    def deviation(self) -> float:
        """Standard deviation of a value."""
        return math.sqrt(self.white + self.correlated)

    @property
    def correlation(self) -> float:
        """Of values in successive frames."""
        variance = self.white + self.correlated
        return self.memory * self.correlated / variance if variance > 0.0 else 0.0

    @property
    def frames(self) -> float:
        """Integrated autocorrelation time: so many frames in a row say no more than one."""
        return 1.0 + 2.0 * self.correlation / (1.0 - self.memory)


class Lasting(NamedTuple):
    """Standard deviation of noise over what three frames in a row show of it, and ``NoiseMemory.frames``."""

    gain: float
    frames: float


WHITE = Lasting(1.0, 1.0)


def fit_memory(squares: FloatArray, terms: Callable[[float], FloatArray], longest: float) -> NoiseMemory:
    """The noise of which mean squares [k] are made, by least relative errors, with φ below ``longest``.

    ``terms``(φ) [k, 2 or more]: what a variance of 1 of white noise, of correlated noise, and of anything else, adds.
    """

    def misfit(memory: float) -> float:
        return _variances(squares, terms(memory))[1]

    tried = np.linspace(0.0, longest, NOISE.memories + 2)
    near = int(np.argmin([misfit(memory) for memory in tried[:-1]]))
    low, high = tried[max(near - 1, 0)], tried[near + 1]
    memory = float(minimize_scalar(misfit, bounds=(low, high), method="bounded").x)
    (white, correlated, *_), _ = _variances(squares, terms(memory))
    return NoiseMemory(float(white), float(correlated), memory)


def longest_memory(lag: int) -> float:
    """Largest φ that frames up to so many apart are taken to show: of more, load that drifts is not told apart."""
    return math.exp(-1.0 / (NOISE.longest_memory * lag))


def _variances(squares: FloatArray, terms: FloatArray) -> tuple[FloatArray, float]:
    """Variances, none below 0, that fit best, and the root of their relative squares."""
    weight = 1.0 / np.maximum(squares, np.finfo(float).tiny)
    found, misfit = nnls(terms * weight[:, None], squares * weight)
    return found, float(misfit)


def lasting_noise_of(time: FloatArray, series: FloatArray, window: float, least: float) -> Lasting:
    """How noise of recorded series [t, axes, k] lasts, within ``window`` s.

    Values are compared with the line through those some frames before and after, as ``noise.noise_of_three`` does, for
    more and more frames: white noise parts from it by as much each time, a load that changes smoothly by the square of
    the time. What the series have in common drops out, and what a few of them do, or all for a short time.

    ``WHITE`` where noise is less than ``least``, where too few series or frames show it, and where over two frames it
    is hardly more than over one: with a correlation below ``NOISE.least_memory`` three frames show it as well.
    """
    lags = lags_within(time, window, len(time))
    if not len(lags):
        return WHITE
    chosen = np.ascontiguousarray(series[..., np.unique(np.linspace(0, series.shape[2] - 1, NOISE.series).astype(int))])
    squares, shortest = np.array([_noise_at(time, chosen, lag) for lag in lags]) ** 2, _terms(lags, NOISE.least_memory)
    if squares[0] < least**2 or squares[1] * shortest[0, 1] < squares[0] * shortest[1, 1]:
        return WHITE
    return fit_lasting(lags, squares)


def lags_within(time: FloatArray, window: float, frames: int) -> IntArray:
    """Numbers of frames, 1 first, over which noise is compared within ``window`` s; none where so many ``frames`` are
    too few to show how it lasts.
    """
    most = min(round(window / float(np.median(np.diff(time)))) if len(time) > 1 else 0, frames // NOISE.least_series)
    lags = np.unique(np.round(np.geomspace(1.0, max(most, 1), NOISE.lags)).astype(np.int64))
    return lags if len(lags) > _terms(lags, 0.0).shape[1] else lags[:0]


def fit_lasting(lags: IntArray, squares: FloatArray) -> Lasting:
    """How noise lasts by which values part, in mean ``squares`` [k], from the lines through those ``lags`` [k] frames
    before and after; ``WHITE`` where some do not.
    """
    if not squares.min() > 0.0:
        return WHITE
    found = fit_memory(squares, lambda memory: _terms(lags, memory), longest_memory(int(lags[-1])))
    return Lasting(max(found.deviation / math.sqrt(float(squares[0])), 1.0), found.frames)


def _terms(lags: IntArray, memory: float) -> FloatArray:
    """What white noise, correlated noise and a load that changes smoothly add at each of the lags, [k, 3]."""
    terms = np.ones((len(lags), 3))
    terms[:, 1] -= (4.0 * memory**lags - memory ** (2 * lags)) / 3.0
    terms[:, 2] = (lags / lags[-1]) ** 4
    return terms


def _noise_at(time: FloatArray, series: FloatArray, lag: int) -> float:
    """Median of what evenly chosen frames show against those ``lag`` before and after; 0 where none does."""
    frames = np.unique(np.linspace(lag, len(time) - lag - 1, NOISE.memory).astype(int))
    shares = (time[frames] - time[frames - lag]) / (time[frames + lag] - time[frames - lag])
    found = np.empty(len(frames))
    _fill_noise(series, frames, lag, shares, np.empty(series.shape[1:]), found)
    known = found[~np.isnan(found)]
    return float(np.median(known)) if len(known) else 0.0


@compiled
def _fill_noise(
    series: FloatArray, frames: IntArray, lag: int, shares: FloatArray, room: FloatArray, found: FloatArray
) -> None:
    """As ``noise_of_three`` of each of the frames, in ``found`` [k]."""
    for e, k in enumerate(frames):
        found[e] = noise_of_three(series[k - lag], series[k], series[k + lag], shares[e], room)
