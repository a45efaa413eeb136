"""Where the filter's memory holds what.

An element's state is a column of ``elements`` [13, n, m]: its slip probability; where in the object's frame it would
be if it stuck (x, y m, variance m²) and if it slipped (the same); its force low-passed (normal, tangential N); the
force ratio that it slipped at with the weight of that knowledge; and how probable it was, before this frame was seen,
that it began to slip if it stuck and that it stuck again if it slipped.

``common`` is what elements share: the pose; the loading; the slipping force ratio (weighted sum, weight); the
share in which the surface follows the known motion (the same); the pose from which motion counts; for how long
neither it nor the load has moved, s; and of a given pose: how it was corrected for noise, how far the markers' pose lay
from it in the last two frames, of how many frames that is known, and what second differences of it say of the noise of
place, m, and yaw, rad; in how many frames of contact there were forces, and pulled; how far the camera moved, x, y m;
and of the markers around the contact the last step, x, y m, by how much it differed from the one before, and what such
differences say of jitter, m²; and of the frames since object or load last moved how many there are, and the means of
pose and of load (N, or without forces m); and of markers the step in which places come, m, and the noise that lasts
from frame to frame, m; and how far forces are trusted (see ``agreement``): whether a frame was seen, sums over the
lattice of force, x, y, z N, and of displacement, m, low-passed fast and slowly and as at rest, mean squares and
products of these, the squared misfit of forces since rest and of late, the largest squared Σu_z, m², what share of
the normal force appears along x and y, and in how many frames forces were not trusted, whether contact is by shape
for that reason, and was in the last frame.
"""

from slipcore.defaults import NOISE, NUMERICS

ROWS = 13
(
    PROBABILITY, STICK_X, STICK_Y, STICK_VARIANCE, SLIP_X, SLIP_Y, SLIP_VARIANCE, NORMAL, TANGENTIAL, RATIO,
    RATIO_WEIGHT, ONSET, END,
) = range(ROWS)  # fmt: skip
POSE, LOADING, FRICTION, FOLLOWING, REFERENCE, STILL = 0, 4, 10, 12, 14, 18
CORRECTION, LAST_OFFSETS, OFFSET_FRAMES, NOISE_OF_PLACE = 19, 22, 28, 29
NOISE_OF_YAW = NOISE_OF_PLACE + 1 + NOISE.memory
FORCE_FRAMES = NOISE_OF_YAW + 1 + NOISE.memory
PULLED_FRAMES = FORCE_FRAMES + 1
SHIFT = PULLED_FRAMES + 1
STEP, BEND, JITTER = SHIFT + 2, SHIFT + 4, SHIFT + 6
HELD_FRAMES = JITTER + 2
HELD_POSE, HELD_LOAD = HELD_FRAMES + 1, HELD_FRAMES + 5
TOLD_STEP, LASTING = HELD_LOAD + 3, HELD_LOAD + 4
TRUST, AGREEING = HELD_LOAD + 5, HELD_LOAD + 6
FAST = AGREEING + 1
SLOW, REST, NORMAL_SUMS = FAST + 6, FAST + 12, FAST + 18
SHEAR_SUMS = NORMAL_SUMS + 2
MISFIT = SHEAR_SUMS + 7
MOST_PRESSED, LEAN = MISFIT + 2, MISFIT + 3
DOUBTED_FRAMES = LEAN + 2
BY_SHAPE, WAS_BY_SHAPE = DOUBTED_FRAMES + 1, DOUBTED_FRAMES + 2
COMMON = WAS_BY_SHAPE + 1
TRUSTED = NUMERICS.trusted
"""Trust in forces from which on they are used."""
