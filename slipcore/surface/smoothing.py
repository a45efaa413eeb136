"""Fields that a sensor smooths over neighbours: how widely, from their noise, and what they were before."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dctn, idctn
from scipy.optimize import brentq

from slipcore.defaults import DEVIATION_TO_SIGMA, SMOOTHING
from slipcore.frames import FloatArray
from slipcore.medians import medians


def transfer(width: float, frequency: FloatArray) -> FloatArray:
    """What a Gaussian kernel of a standard deviation in elements, sampled and normalised, leaves of a wave.

    ``frequency`` [k] rad an element, of the same shape the share that is left.
    """
    if width == 0.0:
        return np.ones_like(frequency)
    reach = np.arange(-math.ceil(SMOOTHING.reach * width), math.ceil(SMOOTHING.reach * width) + 1)
    weight = np.exp(-0.5 * (reach / width) ** 2)
    left: FloatArray = np.cos(np.multiply.outer(frequency, reach)) @ weight / weight.sum()
    return left


def bend_of_noise(width: float) -> float:
    """Standard deviation of second differences along and across (1, −2, 1 each) of white noise that was smoothed, over
    six times its own, which it is without smoothing: ∫(2 − 2 cos ω)² G² dω / 6 ∫G² dω.
    """
    frequency = np.linspace(0.0, np.pi, SMOOTHING.frequencies)
    power = transfer(width, frequency) ** 2
    return float(((2.0 - 2.0 * np.cos(frequency)) ** 2 * power).mean() / power.mean() / 6.0)


def kernel_width(time: FloatArray, field: FloatArray, least_noise: float) -> float:
    """Standard deviation, in elements, of the kernel that a sensor smooths a recorded ``field`` [t, n, m, c] with; 0
    where its noise does not show it.

    What parts a frame from the line between its neighbours in time is noise; how much of that bends from element to
    element shows the kernel. White noise that came after the smoothing hides it. ``least_noise``: below it is motion.
    Of a dense sensor rows stand for all, for medians of them are sure long before all elements are read.
    """
    n, m = field.shape[1:3]
    if len(time) < SMOOTHING.least_frames or max(n - 2, 0) * max(m - 2, 0) < SMOOTHING.least_elements:
        return 0.0
    chosen = np.unique(np.linspace(1, len(time) - 2, SMOOTHING.frames).astype(int))
    share = ((time[chosen] - time[chosen - 1]) / (time[chosen + 1] - time[chosen - 1]))[:, None, None, None]
    rows, share = _bands(n, m), share[..., None]
    before, now, after = (field[frames[:, None, None], rows] for frames in (chosen - 1, chosen, chosen + 1))
    noise = now - (1.0 - share) * before - share * after
    if (noise == 0.0).mean() > SMOOTHING.largest_still:  # rounded, or held back
        return 0.0
    bend = np.diff(np.diff(noise, 2, axis=2), 2, axis=3) / 6.0
    size = _size(noise)
    if not np.median(size) > least_noise * math.sqrt(1.5):
        return 0.0
    median = float(np.median(_size(bend) / np.maximum(size, np.finfo(float).tiny)))
    if not bend_of_noise(SMOOTHING.widest) <= median <= SMOOTHING.whole:
        return 0.0
    width: float = brentq(lambda width: bend_of_noise(width) - median, 0.0, SMOOTHING.widest)
    return width


def _bands(n: int, m: int) -> NDArray[np.int64]:
    """Rows of a lattice that are looked at, [bands, rows]: all of them in one band; or, where that shows more than as
    many elements as the least lattice does in all its frames, evenly chosen ones, each between its neighbours.
    """
    enough = SMOOTHING.least_elements * SMOOTHING.frames
    if (n - 2) * (m - 2) <= enough:
        return np.arange(n)[None]
    middle = np.unique(np.linspace(1, n - 2, math.ceil(enough / (m - 2))).astype(int))
    return middle[:, None] + np.arange(-1, 2)


def _size(field: FloatArray) -> FloatArray:
    """Standard deviation of each frame [t], m or N, by medians about what all elements have in common."""
    components = np.ascontiguousarray(np.moveaxis(field.reshape(len(field), -1, field.shape[-1]), -1, 1))
    apart = np.abs(components - medians(components)[:, :, None])
    size: FloatArray = DEVIATION_TO_SIGMA * medians(apart.reshape(len(field), -1))
    return size


def unsmoothed(field: FloatArray, width: float, noise: float) -> FloatArray:
    """The ``field`` [..., n, m, c] as it was before a Gaussian kernel, ``width`` elements wide, smoothed it.

    Deconvolved in the cosine transform, for which the field goes on mirrored beyond its edges: G(1 + ε)/(G² + ε) for
    the kernel's transfer G (Wiener), ε the power of ``noise`` that came after the smoothing over that of the field.
    """
    gain = _inverse(field.shape[-3], field.shape[-2], width, noise)
    spectrum = dctn(field, axes=(-3, -2), norm="ortho") * gain[..., None]
    sharp: FloatArray = idctn(spectrum, axes=(-3, -2), norm="ortho")
    return sharp


@lru_cache(maxsize=16)
def _inverse(n: int, m: int, width: float, noise: float) -> FloatArray:
    left = np.multiply.outer(*(transfer(width, np.pi * np.arange(size) / size) for size in (n, m)))
    return left * (1.0 + noise) / (left**2 + noise)
