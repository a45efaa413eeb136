"""Which elements touch the object: from forces where there are any, from the pressed shape otherwise."""

import math

import numpy as np

from slipcore.defaults import NOISE, ContactOptions
from slipcore.frames import BoolArray, FloatArray


def pressed(
    pressing: FloatArray, least: float, share: float, noise: float, before: BoolArray | None, options: ContactOptions
) -> BoolArray:
    """Elements [n, m] that are pressed by more than a threshold tied to the frame, with hysteresis.

    ``pressing`` [n, m]: normal force in N or indentation in m, positive inwards; the threshold is the largest of
    ``least``, ``share`` of the frame's peak and a multiple of ``noise`` (NaN where unknown). Elements in contact
    ``before`` are released only under ``release_share`` of it.
    """
    threshold = max(least, share * float(pressing.max()), 0.0 if math.isnan(noise) else options.contact_noise * noise)
    touching = pressing > threshold
    return touching if before is None else touching | (before & (pressing > options.release_share * threshold))


def contact_from_force(
    pressing: FloatArray, element_area: float, noise: float, before: BoolArray | None, options: ContactOptions
) -> BoolArray:
    """Elements in contact by the force that presses them inwards, [n, m] N."""
    least = options.contact_pressure * element_area
    return pressed(pressing, least, options.contact_force_share, noise, before, options)


def contact_from_shape(
    indentation: FloatArray, noise: float, before: BoolArray | None, options: ContactOptions
) -> BoolArray:
    """Elements in contact by how deep they are pressed, [n, m] m; where the shape is hollow the contact has ended."""
    touching = pressed(indentation, options.contact_depth, options.contact_depth_share, noise, before, options)
    if options.rim_curvature >= 1.0 or min(indentation.shape) < 3:
        return touching
    least = 0.0 if math.isnan(noise) else 2.0 * CURVATURE_NOISE * noise
    return touching & (curvature(indentation) <= max(least, options.rim_curvature * float(indentation.max())))


CURVATURE_NOISE = 0.6374
"""Standard deviation of ``curvature`` for white noise of 1 (from the 25 weights of its stencil)."""


def curvature(field: FloatArray) -> FloatArray:
    """Laplacian of a field [n, m] smoothed over 3 × 3 neighbours (weights 1-2-1), times the pitch squared: [n, m].

    The edge is continued with its own slope.
    """
    rows = _continued(field, 0)
    smooth = (rows[:-2] + 2.0 * rows[1:-1] + rows[2:]) / 4.0
    columns = _continued(smooth, 1)
    smooth = (columns[:, :-2] + 2.0 * columns[:, 1:-1] + columns[:, 2:]) / 4.0
    bend = np.zeros_like(smooth)
    for axis in (0, 1):
        bend += np.diff(_continued(smooth, axis), 2, axis=axis)
    return bend


def _continued(field: FloatArray, axis: int) -> FloatArray:
    first, second, third, last = (field.take([k], axis) for k in (0, 1, -2, -1))
    return np.concatenate([2.0 * first - second, field, 2.0 * last - third], axis=axis)


def spatial_noise(pressing: FloatArray) -> float:
    """Noise of a single frame, from the elements that seem to pull: an object does not, so only noise does.

    ``pressing`` [n, m], N or m. Half of a symmetric noise is negative; its median magnitude is Φ⁻¹(¾) σ. NaN with too
    few of them. What a contact moves outwards beside itself only makes the estimate larger, which is on the safe side
    for the two frames before a noise over time is known.
    """
    pulling = pressing[pressing < 0.0]
    if len(pulling) < NOISE.least_series:
        return math.nan
    return NOISE.deviation_to_sigma * float(np.median(-pulling))
