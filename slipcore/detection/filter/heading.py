"""Which way the object moves over each element: friction of what slips points that way, and never back.

A force ratio alone cannot tell slip from the moment after the load was turned back: everything sticks then, and ratios
are still those at which it slipped.
"""

import math

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import compiled
from slipcore.detection.filter.pose import AnchorMotion, Pose
from slipcore.detection.filter.state import HEADING_X, HEADING_Y, OPPOSED
from slipcore.frames import FloatArray


@compiled
def follow_headings(
    elements: FloatArray,
    places: NDArray[np.int64],
    motion: AnchorMotion,
    pose: Pose,
    force: FloatArray,
    length: float,
    gain: float,
    after: FloatArray,
) -> None:
    """Put into ``after`` the mean direction of motion over the last ``length`` m, and which elements are opposed: where
    the object's ``force`` [n, m, 3] N on the sensor points against it; 1, and the share in which it moved by a length
    within the memory of forces, of which this step is the ``gain``. None is for no length, or without forces.

    By motion, not by time: what stands still keeps its heading, and what hardly moves is hardly opposed.
    """
    after[HEADING_X : OPPOSED + 1] = 0.0
    if not length > 0.0:
        return
    for e in range(len(places)):
        i, j = places[e]
        x = pose.cosine * motion.x[e] - pose.sine * motion.y[e]
        y = pose.sine * motion.x[e] + pose.cosine * motion.y[e]
        moved, heading_x, heading_y = math.hypot(x, y), elements[HEADING_X, i, j], elements[HEADING_Y, i, j]
        if moved > 0.0:
            weight = -math.expm1(-moved / length)
            heading_x += weight * (x / moved - heading_x)
            heading_y += weight * (y / moved - heading_y)
        after[HEADING_X, i, j], after[HEADING_Y, i, j] = heading_x, heading_y
        if force.size and force[i, j, 0] * heading_x + force[i, j, 1] * heading_y < 0.0:
            after[OPPOSED, i, j] = 1.0 - math.expm1(-moved / (gain * length))
