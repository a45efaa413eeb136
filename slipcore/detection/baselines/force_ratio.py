"""The break-away ratio of forces, after Song et al. 2014 (the paper's [12]), element by element.

Assumed here: the ratio is that of one element and not of the finger, and the break-away ratio is an option, for that
work finds it by exploring the surface before the grasp. Without forces nothing is known: no slip, probability ½.
"""

import numpy as np

from slipcore.defaults import ForceRatioOptions
from slipcore.detection.shared.interface import Method, ObservedFrame
from slipcore.detection.shared.records import Decision
from slipcore.surface.strain import Lattice


def init(_: Lattice, __: ForceRatioOptions) -> None:
    """Nothing to remember."""


def step(state: None, _: Lattice, seen: ObservedFrame, options: ForceRatioOptions) -> tuple[None, Decision]:
    """An element slips where its f_t/f_n is over the break-away ratio."""
    if seen.force.size == 0:
        return state, Decision(np.zeros(seen.contact.shape, bool), np.full(seen.contact.shape, 0.5))
    slip = (seen.pressing > 0.0) & (seen.tangential > options.break_away_ratio * seen.pressing)
    return state, Decision(slip, slip.astype(float))


METHOD = Method(ForceRatioOptions, init, step)
