"""A whole step of method ``strain_rate`` in one call: observe, decide, answer; arguments as ``filter.run``'s."""

import numpy as np

from slipcore.compilation import compiled
from slipcore.detection.shared.answer import answer
from slipcore.detection.shared.observe import observe
from slipcore.detection.strain_rate.step import step_strain_rate
from slipcore.frames import BoolArray, FloatArray


@compiled
def run_strain_rate(
    position: FloatArray,
    rest_steps: FloatArray,
    inverse_jacobian: FloatArray,
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
    _was_force: FloatArray,
    was_pose: FloatArray,
    masks: BoolArray,
    likely: FloatArray,
    noise: FloatArray,
    own: FloatArray,
    _numbers: FloatArray,
    next_masks: BoolArray,
    probability: FloatArray,
    next_noise: FloatArray,
    next_own: FloatArray,
    _next_numbers: FloatArray,
    velocity: FloatArray,
) -> tuple[float, int, int]:
    """Fill the last six; marker noise, m (NaN if unknown), and how many elements touch and slip."""
    shape = probability.shape
    normal, pressing, tangential = np.empty(displacement.shape), np.empty(shape), np.empty(shape)
    stays, decided, guess = np.empty(shape, np.bool_), np.empty(shape, np.bool_), np.empty(shape)
    sigma, _ = observe(
        rest_steps, orientation, touch, time, displacement, force, given_normal, known, masks[0], noise,
        normal, pressing, tangential, next_masks[0], stays, next_noise,
    )  # fmt: skip
    interval = time - was_time
    step_strain_rate(
        own, settings, inverse_jacobian, displacement, normal, stays, interval, sigma, next_own, decided, guess
    )
    touching, slipping = answer(
        position, interval, was_displacement, displacement, was_pose, pose, next_masks[0], stays, decided, guess,
        masks[1], likely, next_masks[1], probability, velocity,
    )  # fmt: skip
    return sigma, touching, slipping
