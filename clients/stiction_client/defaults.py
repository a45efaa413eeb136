"""The numbers that change what the planner and the controller answer, beside the controller's gains (``settings``).

Each with its unit, its range and where it is from.
"""

import sys

UNCERTAIN = 0.1
"""-, 0 to 1, in parts of the expected friction: the half-width of its 95 % interval from which on it is not identified.
The same tenth makes a coefficient identifiable."""

BEND = 0.1
"""-, 0 to 1: standard deviation, in parts of friction, of what the law bends away from its line where an element's
normal force leaves the data by as much as the bound that it passes, and where velocity does by a factor of e. Friction
that varies as f^(-1/3), as an elastic sphere's does (Hertz), departs from its tangent by 0.13 of itself at twice the
force; with velocity friction varies as its logarithm (Dieterich, 1979)."""

NORMAL_DEVIATIONS = 3.0902
"""-, 0 to 8: standard deviations of a normal quantile of 1e-3, the planner's default bound: what is learnt in one grasp
has no better."""

LEAST_CERTAIN = 0.3
"""-, 0 to 0.5: largest probability at whose quantile a model's scatter is read; near a half it lies at the mean, and
shows none."""

MOST_SLIP = 0.1
"""-, 0 to 0.5: largest slip probability that a refusal tells as one that could be held: who may lose one grasp in ten
has no use for a planner, and near a half it is the mean that holds, however little is known."""

MOST_STEPS = 200
"""-, 50 and more: steps of a search; a root that only touches takes 50, any other fewer than 20."""

ROUNDING = 8.0 * sys.float_info.epsilon
"""-, 1e-15 to 1e-9: relative, to which a load counts as held and a force as found."""

ENDLESS = 1e12
"""N an element, 1e9 and more: what holds up to there has no upper bound, and what doesn't hold has no root."""

UNKNOWN_SHARE = 0.05
"""-, 0 to 1: probability beforehand of a surface that is none of the known ones; that of ``estimators.recognise``."""

UNKNOWN_FRICTION = 0.5
"""-, 0 to 2: mean friction of such a surface; that of ``estimators.recognise``."""

UNKNOWN_LEVEL = 0.25
"""-, 0 to 2: standard deviation of the friction of such a surface; that of ``estimators.recognise``."""

LOAD_NOISE = 0.02
"""N a frame, 0 to 1: standard deviation of the load that is expected before frames show it: 2 mN an element, of a
hundred that touch."""

NOISE_FRAMES = 60.0
"""-, 10 and more: frames over which the load's noise is averaged, which is then known to a tenth of itself."""

REST_FRAMES = 20.0
"""-, 5 and more: frames over which a load at rest is averaged: a fifth of one frame's noise is left."""

TAKEN_AWAY = 5.0
"""-, 3 to 20: standard deviations of its noise that a load lacks beyond twice what a slide would cost it: then it was
taken away."""

KNOWN_FRAMES = 10
"""-, 3 to 60: frames at rest from which on the mean of a load is known well enough to see what it lacks."""

LEAST_NOISE = 0.005
"""-, 0 to 0.05, in parts of the load: the least that its noise counts as where a slide is looked for, a tenth of
``steady_share``: else the smallest change of a load next to free of noise would be a slide."""

FALL_FRAMES = 4
"""-, 2 to 10: frames within which the stick ratio falls at once: as soon as a slide shows in it, most of it does."""

FALL = 0.3
"""-, 0.1 to 0.6, in parts of what the contact can bear: the stick ratio falls at once where by it so much more is borne
within ``FALL_FRAMES``. A grip that is relaxed by 1 % a frame makes 0.04; a slide made 0.3 and more in 11 of 13."""

FALLING = 0.4
"""-, 0.3 to 1: of ``slide_deviations``, so many are enough for a slide while the stick ratio falls at once: by both
together 2 of 480 grips that held were taken for sliding; by the stick ratio alone half of all are, by 0.6 of the
deviations alone a sixth."""

BORNE = 0.8
"""-, 0.5 to 1: of the largest load over force that a contact bore: what its friction is no less than, with the noise
of both, and under twice the force where friction falls with its cube root (Hertz)."""
