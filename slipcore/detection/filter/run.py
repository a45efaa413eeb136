"""A whole step of method ``filter`` in one call: observe, decide, answer.

Every compiled method takes the same arguments, in four groups: what stays (lattice, ``touch``, ``settings``), the frame
(fields that it does not have are empty), what is remembered of the last one, and what is filled in to be remembered or
answered.
``own`` fields [rows, n, m] and ``numbers`` [k] are the method's memory.
"""

import numpy as np

from slipcore.compilation import compiled
from slipcore.detection.filter.step import step_filter
from slipcore.detection.shared.answer import answer
from slipcore.detection.shared.observe import observe
from slipcore.frames import BoolArray, FloatArray


@compiled
def run_filter(
    position: FloatArray,
    rest_steps: FloatArray,
    _inverse_jacobian: FloatArray,
    orientation: float,
    touch: FloatArray,
    settings: FloatArray,
    time: float,
    displacement: FloatArray,
    force: FloatArray,
    pose: FloatArray,
    given_normal: FloatArray,
    known: BoolArray,
    was_time: float,
    was_displacement: FloatArray,
    was_force: FloatArray,
    was_pose: FloatArray,
    masks: BoolArray,
    likely: FloatArray,
    noise: FloatArray,
    own: FloatArray,
    numbers: FloatArray,
    next_masks: BoolArray,
    probability: FloatArray,
    next_noise: FloatArray,
    next_own: FloatArray,
    next_numbers: FloatArray,
    velocity: FloatArray,
) -> tuple[float, int, int]:
    """Fill the last six; marker noise, m (NaN if unknown), and how many elements touch and slip."""
    shape = probability.shape
    normal, pressing, tangential = np.empty(displacement.shape), np.empty(shape), np.empty(shape)
    stays, decided, guess = np.empty(shape, np.bool_), np.empty(shape, np.bool_), np.empty(shape)
    sigma, pressing_sigma = observe(
        rest_steps, orientation, touch, time, displacement, force, given_normal, known, masks[0], noise,
        normal, pressing, tangential, next_masks[0], stays, next_noise,
    )  # fmt: skip
    interval = time - was_time
    step_filter(
        own, numbers, settings, position, was_displacement, displacement, was_force, force, pressing, tangential,
        next_masks[0], stays, was_pose, pose, sigma, pressing_sigma, interval,
        next_own, next_numbers, decided, guess,
    )  # fmt: skip
    touching, slipping = answer(
        position, interval, was_displacement, displacement, was_pose, pose, next_masks[0], stays, decided, guess,
        masks[1], likely, next_masks[1], probability, velocity,
    )  # fmt: skip
    return sigma, touching, slipping
