"""The evidence of forces, motion and layers on a frame, joined: their log-odds of slip are added."""

import math
from typing import NamedTuple

import numpy as np

from slipcore.compilation import borrowed, compiled
from slipcore.detection.coarse.layers import Layers, PressedElements, layer_tuning, look_at_layers
from slipcore.detection.forces_only.tuning import Considered
from slipcore.detection.shared.records import Decision
from slipcore.frames import BoolArray, FloatArray


class Evidence(NamedTuple):
    """A frame of n × m elements: rest ``position``, ``displacement`` and ``outward`` normal [n, m, 3], m; which touch
    and which ``stay`` in contact; low-passed ``normal`` [n, m] and ``tangential`` [n, m, 3] forces, N, with ``noise`` N
    of a component; and the probability of slip ``by_forces`` and ``by_filter`` [n, m].
    """

    position: FloatArray
    displacement: FloatArray
    outward: FloatArray
    contact: BoolArray
    stay: BoolArray
    normal: FloatArray
    tangential: FloatArray
    noise: float
    by_forces: FloatArray
    by_filter: FloatArray


@compiled
def join(frame: Evidence, layers: Layers, considered: Considered, after: Layers, decision: Decision) -> None:
    """Fill the layers ``after`` the frame, and the decision; what it is given may be plain tuples of the same."""
    seen, before, known = Evidence(*borrowed(frame)), Layers(*borrowed(layers)), Considered(*borrowed(considered))
    kept, decided = Layers(*borrowed(after)), Decision(*borrowed(decision))
    kept.load[:] = before.load
    kept.level[:] = before.level
    kept.traction[:] = before.traction
    kept.normal[:] = before.normal
    kept.odds[:] = before.odds
    look_at_layers(pressed_elements(seen), kept, known)
    tuning = layer_tuning(known.settings)
    touching = int(np.count_nonzero(seen.contact))
    few = share_of_few(touching, tuning.many_elements)
    by_place = few * tuning.filter_weight + 1.0 - few
    beforehand = few * tuning.few_odds * (2.0 * share_of_few(touching, tuning.few_elements) - 1.0)
    n, m = seen.contact.shape
    for i in range(n):
        for j in range(m):
            odds = beforehand + few * tuning.forces_weight * log_odds(seen.by_forces[i, j], tuning.largest_sum)
            odds += by_place * log_odds(seen.by_filter[i, j], tuning.largest_sum)
            odds += few * tuning.layers_weight * kept.odds[i * m + j] if seen.stay[i, j] else 0.0
            decided.slip[i, j], decided.probability[i, j] = odds > 0.0, 1.0 / (1.0 + math.exp(-odds))


@compiled
def share_of_few(touching: int, many: float) -> float:
    """How much of what is so of few elements counts where so many touch: a half at ``many``.

    The smaller elements are beside the contact, the more surely place and force ratio of each tell whether it slips;
    and of very few none takes less of a load than another before all slide, so that forces speak for stick too long.
    """
    return 1.0 / (1.0 + (touching / many) ** 4)


@compiled
def log_odds(probability: float, most: float) -> float:
    """Of a probability, within that."""
    least = 1.0 / (1.0 + math.exp(most))
    p = min(max(probability, least), 1.0 - least)
    return math.log(p / (1.0 - p))


@compiled
def pressed_elements(seen: Evidence) -> PressedElements:
    """Its elements one after the other, as layers take them."""
    n, m = seen.contact.shape
    place, sideways = np.empty((n * m, 2)), np.zeros((n * m, 2))
    normal, depth = np.zeros(n * m), np.zeros(n * m)
    for i in range(n):
        for j in range(m):
            e = i * m + j
            place[e, 0], place[e, 1] = seen.position[i, j, 0], seen.position[i, j, 1]
            for a in range(3):
                depth[e] -= seen.displacement[i, j, a] * seen.outward[i, j, a]
            if seen.contact[i, j]:
                normal[e] = seen.normal[i, j]
                sideways[e, 0], sideways[e, 1] = seen.tangential[i, j, 0], seen.tangential[i, j, 1]
    return PressedElements(place, normal, sideways, depth, seen.noise)
