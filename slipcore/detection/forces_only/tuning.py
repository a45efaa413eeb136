"""``ForcesOnlyOptions`` as numbers for the kernels."""

from functools import cache
from typing import NamedTuple

import numpy as np

from slipcore.compilation import compiled, unpack
from slipcore.defaults import ForcesOnlyOptions
from slipcore.frames import FloatArray


class ForcesTuning(NamedTuple):
    """Options of ``forces_only`` as its kernels read them, in the same units; see ``ForcesOnlyOptions``."""

    force_smoothing: float
    least_load_change: float
    load_deviations: float
    friction_memory: float
    friction_weight: float
    excess: float
    slip_level: float
    slip_level_width: float
    largest_level_odds: float
    part_spread: float
    overload: float
    overload_spread: float
    overload_share: float
    slip_part: float
    slip_exponent: float
    slip_part_spread: float
    part_weight: float
    outlier_share: float
    least_change: float
    largest_share: float
    largest_gain: float
    memory: float
    largest_log_odds: float
    taken_back: float
    pressing_share: float
    pressing_deviations: float
    pressed_log_odds: float
    threshold: float


class Considered(NamedTuple):
    """Friction coefficients [g] that are considered, their log weights [g] before anything is seen, and the options as
    an array.
    """

    friction: FloatArray
    prior: FloatArray
    settings: FloatArray


_TUNING = len(ForcesTuning._fields)


@cache
def considered(options: ForcesOnlyOptions, names: tuple[str, ...] = ForcesTuning._fields) -> Considered:
    """What the kernels take of the options: friction coefficients, and those of these names as an array."""
    settings = [getattr(options, name) for name in names]
    return Considered(frictions(options), prior(options), np.array(settings, float))


def frictions(options: ForcesOnlyOptions) -> FloatArray:
    """The friction coefficients that are considered, [g]."""
    grid: FloatArray = np.geomspace(options.least_friction, options.largest_friction, options.frictions)
    return grid


def prior(options: ForcesOnlyOptions) -> FloatArray:
    """Log weights of them before anything is seen, [g]."""
    away = np.log(frictions(options) / options.usual_friction) / options.friction_spread
    weights: FloatArray = -0.5 * away**2
    return weights


@compiled
def forces_tuning(settings: FloatArray) -> ForcesTuning:
    """The options by name, from their array."""
    return ForcesTuning(*unpack(settings, _TUNING))
