"""Mixtures of normal distributions: their quantiles, and the Student-t that stands for one."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from estimators.defaults import GRID

FloatArray = NDArray[np.float64]


class Student(NamedTuple):
    """A Student-t distribution about 0: ``scale`` and ``degrees_of_freedom``."""

    scale: float
    degrees_of_freedom: float


def mixture_quantile(weight: FloatArray, mean: FloatArray, deviation: FloatArray, level: ArrayLike) -> FloatArray:
    """Quantiles at ``level`` [q] of a mixture of m normals, by Newton's method kept within a bracket that closes.

    ``weight`` [m] sums to 1. A quantile of the mixture lies between the least and the largest of its parts'.
    """
    wanted = np.atleast_1d(np.asarray(level, dtype=float))
    safe = np.maximum(deviation, np.finfo(float).tiny)
    ends = mean + special.ndtri(wanted)[:, None] * deviation
    low, high = ends.min(axis=1), ends.max(axis=1)
    at, close = ends @ weight, GRID.quantile_rounding * (np.abs(ends).max() + np.finfo(float).tiny)
    for _ in range(GRID.quantile_steps):
        score = (at[:, None] - mean) / safe
        over = special.ndtr(score) @ weight - wanted
        low, high = np.where(over < 0.0, at, low), np.where(over < 0.0, high, at)
        slope = np.exp(-0.5 * score**2) @ (weight / safe) / np.sqrt(2.0 * np.pi)
        step = at - over / np.maximum(slope, np.finfo(float).tiny)
        moved = np.where((step >= low) & (step <= high), step, 0.5 * (low + high))
        if np.abs(moved - at).max() <= close:
            return np.asarray(moved)
        at = moved
    return np.asarray(at)


def matched_student(weight: FloatArray, mean: FloatArray, deviation: FloatArray) -> Student:
    """The Student-t whose ``middle`` and ``extreme`` quantiles are half the distances between a mixture's and their
    mirrors.
    """
    levels = np.array([GRID.middle, GRID.extreme])
    above = mixture_quantile(weight, mean, deviation, levels)
    below = mixture_quantile(weight, mean, deviation, 1.0 - levels) if mean.any() else -above
    inner, outer = 0.5 * (above - below)
    if not inner > 0.0:
        return Student(0.0, GRID.most_freedom)
    low, high = 0.0, float(np.log(GRID.most_freedom))
    for _ in range(GRID.quantile_steps):
        middle = 0.5 * (low + high)
        near, far = special.stdtrit(np.exp(middle), levels)
        low, high = (middle, high) if far / near > outer / inner else (low, middle)
    freedom = float(np.exp(0.5 * (low + high)))
    return Student(float(inner / special.stdtrit(freedom, GRID.middle)), freedom)
