"""Where the filter's memory holds what.

An element's state is a column of ``elements`` [20, n, m]: its slip probability; where in the object's frame it would
be if it stuck (x, y m, variance m²) and if it slipped (the same); its force low-passed (normal, tangential N); the
force ratio that it slipped at with the weight of that knowledge; and how probable it was, before this frame was seen,
that it began to slip if it stuck and that it stuck again if it slipped; which way the object moves over it (x, y), and
whether its force points against that.

``common`` is what elements share: the pose; the loading; the slipping force ratio (weighted sum, weight); the share in
which the surface follows the known motion (the same); the pose from which motion counts; for how long neither it nor
the load has moved, s; and of a given pose: how it was corrected for noise, how far the markers' pose lay from it in the
last two frames, of how many frames that is known, and what second differences of it say of the noise of place, m, and
yaw, rad; in how many frames of contact there were forces, and in how many they were not believed; how far the camera
moved, x, y m; and of the markers around the contact the last step, x, y m, by how much it differed from the one before,
and what such differences say of jitter, m²; and of the frames since object or load last moved how many there are, and
the means of pose and of load (N, or without forces m); and of markers the step in which places come, m, and the noise
that lasts from frame to frame, m; and the log-likelihoods of limits of slip, see ``slip_limit``.
"""

from slipcore.defaults import NOISE, NUMERICS

ROWS = 20
(
    PROBABILITY, STICK_X, STICK_Y, STICK_VARIANCE, SLIP_X, SLIP_Y, SLIP_VARIANCE, NORMAL, TANGENTIAL, RATIO,
    RATIO_WEIGHT, ONSET, END, HEADING_X, HEADING_Y, OPPOSED,
    TOUCH_DEPTH, SPRING_X, SPRING_Y, EXPECTED,
) = range(ROWS)  # fmt: skip
POSE, LOADING, FRICTION, FOLLOWING, REFERENCE, STILL = 0, 4, 10, 12, 14, 18
CORRECTION, LAST_OFFSETS, OFFSET_FRAMES, NOISE_OF_PLACE = 19, 22, 28, 29
NOISE_OF_YAW = NOISE_OF_PLACE + 1 + NOISE.memory
FORCE_FRAMES = NOISE_OF_YAW + 1 + NOISE.memory
DOUBTED_FRAMES = FORCE_FRAMES + 1
SHIFT = DOUBTED_FRAMES + 1
STEP, BEND, JITTER = SHIFT + 2, SHIFT + 4, SHIFT + 6
HELD_FRAMES = JITTER + 2
HELD_POSE, HELD_LOAD = HELD_FRAMES + 1, HELD_FRAMES + 5
TOLD_STEP, LASTING = HELD_LOAD + 3, HELD_LOAD + 4
LIMITS = HELD_LOAD + 5
COMMON = LIMITS + NUMERICS.slip_limits + 1
