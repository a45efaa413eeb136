"""Where the filter's memory holds what.

An element's state is a column of ``elements`` [13, n, m]: its slip probability; where in the object's frame it would
be if it stuck (x, y m, variance m²) and if it slipped (the same); its force low-passed (normal, tangential N); the
force ratio that it slipped at with the weight of that knowledge; and how probable it was, before this frame was seen,
that it began to slip if it stuck and that it stuck again if it slipped.

``common`` [19] is what elements share: the pose; the loading; the slipping force ratio (weighted sum, weight); the
share in which the surface follows the known motion (the same); the pose from which motion counts; and for how long
there has been none, s.
"""

ROWS = 13
(
    PROBABILITY, STICK_X, STICK_Y, STICK_VARIANCE, SLIP_X, SLIP_Y, SLIP_VARIANCE, NORMAL, TANGENTIAL, RATIO,
    RATIO_WEIGHT, ONSET, END,
) = range(ROWS)  # fmt: skip
POSE, LOADING, FRICTION, FOLLOWING, REFERENCE, STILL, COMMON = 0, 4, 10, 12, 14, 18, 19
