"""``FilterOptions`` as numbers for the kernels."""

from typing import NamedTuple

import numpy as np

from slipcore.compilation import compiled, unpack
from slipcore.defaults import FilterOptions
from slipcore.frames import FloatArray


class Tuning(NamedTuple):
    """The options of the filter that its kernels read, in the same units; ``FilterOptions`` says what each means."""

    noise_margin: float
    unknown_noise: float
    displacement_floor: float
    lasting_ratio: float
    lasting_least: float
    lasting_share: float
    pooling_length: float
    pooling_outlier: float
    rigidity: float
    rigidity_of_fit: float
    rigidity_of_anchor: float
    slip_share: float
    slip_share_spread: float
    creep: float
    onset_length: float
    onset_inside: float
    onset_at_front: float
    end_length: float
    hold_time: float
    hold_deviations: float
    least_weight: float
    outlier: float
    outlier_gate: float
    outlier_spread: float
    motion_play: float
    surroundings_reach: float
    surroundings_least: float
    surroundings_memory: float
    surroundings_jitter: float
    surroundings_noise: float
    surroundings_outlier: float
    following_weight: float
    pose_noise_least: float
    following_variance: float
    following_learning: float
    following_stick: float
    following_whole: float
    following_deviations: float
    force_noise_margin: float
    force_floor: float
    force_smoothing: float
    ratio_spread: float
    ratio_difference: float
    ratio_memory: float
    ratio_weight: float
    ratio_motion: float
    ratio_limit: float
    ratio_slip: float
    ratio_slip_of_element: float
    ratio_variance: float
    ratio_variance_of_element: float
    ratio_least_force: float
    heading_length: float
    force_to_noise: float
    loading_smoothing: float
    pressing_share: float
    pressing_slope: float
    pressing_floor: float
    pressing_force_floor: float
    pressing_rate: float
    pressing_deviations: float
    pressing_force_deviations: float
    stiffness_ratio: float
    slip_limit_usual: float
    slip_limit_spread: float
    slip_limit_doubt: float
    slip_limit_width: float
    slip_limit_lag: float
    slip_limit_trust: float
    slip_limit_evidence: float
    slip_limit_memory: float
    slip_limit_depth: float
    slip_limit_odds: float
    slip_limit_least: float
    slip_limit_largest: float
    least_transition: float
    largest_log_odds: float
    threshold: float


TUNING = len(Tuning._fields)
THRESHOLD, LEAST_TRANSITION = Tuning._fields.index("threshold"), Tuning._fields.index("least_transition")


def settings_of(options: FilterOptions) -> FloatArray:
    """The options as the array that kernels are handed."""
    return np.array([getattr(options, name) for name in Tuning._fields], float)


@compiled
def tuning_of(settings: FloatArray) -> Tuning:
    """The options by name, from their array."""
    return Tuning(*unpack(settings, TUNING))
