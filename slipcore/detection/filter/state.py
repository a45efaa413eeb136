"""Layout of the filter's memory: the rows of ``elements`` [21, n, m] and the entries of ``common`` [COMMON].

Both are arrays (``records.Memory``), for compiled steps fill them in place; the names here are their fields. A field of
``common`` with more than one entry begins at its name, and the next field begins where it ends.
"""

from slipcore.defaults import NOISE, NUMERICS

ROWS = 21
(
    PROBABILITY,  # of slip
    STICK_X,  # place in the object's frame if the element sticks, m
    STICK_Y,
    STICK_VARIANCE,  # of each coordinate of that, m²
    SLIP_X,  # place in the object's frame if it slips, m
    SLIP_Y,
    SLIP_VARIANCE,
    NORMAL,  # low-passed normal force, N
    TANGENTIAL,  # low-passed tangential force, N
    RATIO,  # force ratio at which it was seen to slip, times the next
    RATIO_WEIGHT,  # weight of that knowledge
    ONSET,  # probability, predicted before the frame was seen, that it began to slip if it stuck
    END,  # and that it stuck again if it slipped
    HEADING_X,  # mean direction in which the object moves over it
    HEADING_Y,
    OPPOSED,  # 0 unless its force points against that direction; else 1 plus the share to which that counts: 1 to 2
    TOUCH_DEPTH,  # how deep it lay in the last frame before it touched, m
    SPRING_X,  # what it has taken up of the object's motion since then, m (``slip_limit``)
    SPRING_Y,
    EXPECTED,  # log-odds of slip that follow from that
    HELD_PRESSING,  # mean of its normal force N, or without forces of its depth m, over ``HELD_FRAMES``
) = range(ROWS)

POSE = 0
"""[4] Pose of the object: x, y m, yaw rad, stretch."""
LOADING = POSE + 4
"""[6] Low-passed rates of the load (``loading.Loading``)."""
FRICTION = LOADING + 6
"""[2] Force ratio of all that slips: weighted sum, weight."""
FOLLOWING = FRICTION + 2
"""[2] Share in which the object's surface follows its known motion: weighted sum, weight."""
REFERENCE = FOLLOWING + 2
"""[4] Pose from which motion counts, as ``POSE``."""
STILL = REFERENCE + 4
"""Time for which neither pose nor load has changed, s."""
CORRECTION = STILL + 1
"""[3] By which a given pose was corrected for its noise: x, y m, yaw rad."""
LAST_OFFSETS = CORRECTION + 3
"""[2 × 3] How far the pose fitted to the markers lay from the given one in the last two frames, likewise."""
OFFSET_FRAMES = LAST_OFFSETS + 6
"""Number of frames in which that was known."""
NOISE_OF_PLACE = OFFSET_FRAMES + 1
"""[1 + NOISE.memory] Ring of estimates of a given pose's noise of place, m (``noise.remember``)."""
NOISE_OF_YAW = NOISE_OF_PLACE + 1 + NOISE.memory
"""[1 + NOISE.memory] The same of its yaw, rad."""
FORCE_FRAMES = NOISE_OF_YAW + 1 + NOISE.memory
"""Number of frames in contact that had forces."""
DOUBTED_FRAMES = FORCE_FRAMES + 1
"""Number of these whose forces were not believed."""
SHIFT = DOUBTED_FRAMES + 1
"""[2] How far the camera has moved, x and y m."""
STEP = SHIFT + 2
"""[2] Last step of the markers around the contact, x and y m."""
BEND = STEP + 2
"""[2] By how much it differed from the one before, m."""
JITTER = BEND + 2
"""[2] Fading sums of squares and products of such differences, m² (``surroundings.add_step``)."""
SHAKING = JITTER + 2
"""1 while most of what markers jitter by they have in common, as under a camera that shakes; else 0."""
HELD_FRAMES = SHAKING + 1
"""Number of frames since pose or load last changed."""
HELD_POSE = HELD_FRAMES + 1
"""[4] Mean pose over these."""
HELD_LOAD = HELD_POSE + 4
"""[3] Mean sum of forces over these, N; without forces the third is the sum of displacements along z, m."""
RESOLUTION = HELD_LOAD + 3
"""Step of which all places of markers are multiples, m; 0 where there is none."""
LASTING = RESOLUTION + 1
"""Noise of markers that lasts from frame to frame, m, where it is more than what three frames show; else 0."""
LIMIT_LIKELIHOODS = LASTING + 1
"""[NUMERICS.slip_limits + 1] Log-likelihoods of the limits of slip, and of there being none (``slip_limit``)."""
SPEED = LIMIT_LIKELIHOODS + NUMERICS.slip_limits + 1
"""Root mean square speed of the object over the elements, low-passed as forces are, m/s."""
COMMON = SPEED + 1
