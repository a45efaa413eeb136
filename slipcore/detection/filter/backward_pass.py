"""The backward pass of the fixed-lag smoother: slip probabilities revised by later frames."""

from slipcore.compilation import compiled
from slipcore.detection.filter.element import expected
from slipcore.detection.filter.state import END, ONSET, PROBABILITY
from slipcore.frames import FloatArray


@compiled
def step_back(
    before: FloatArray, elements: FloatArray, later: FloatArray, least_transition: float, revised: FloatArray
) -> None:
    """Fill ``revised`` [n, m], slip probabilities one frame earlier, from ``later`` ones that know more.

    ``before`` and ``elements`` are the memories of the earlier and the later frame; ``revised`` may be the same array
    as ``later``. Backward pass of a two-state chain (Kim, J. Econometrics 60 (1994) 1): p ((1 − b) q/p' +
    b (1 − q)/(1 − p')) with the later q.
    """
    n, m = later.shape
    for i in range(n):
        for j in range(m):
            p, onset, end = before[PROBABILITY, i, j], elements[ONSET, i, j], elements[END, i, j]
            slip, known = expected(p, onset, end, least_transition), later[i, j]
            revised[i, j] = p * ((1.0 - end) * known / slip + end * (1.0 - known) / (1.0 - slip))
