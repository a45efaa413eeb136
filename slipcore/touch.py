"""Which elements touch the object: from forces where there are any, from the pressed shape otherwise."""

import math

from slipcore.defaults import ContactOptions
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
    """Elements in contact by how deep they are pressed, [n, m] m."""
    return pressed(indentation, options.contact_depth, options.contact_depth_share, noise, before, options)
