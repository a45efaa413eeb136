"""Errors of a grasp that last: how those of a place's stretches of time go together, by restricted likelihood.

Where errors last for a part of the record, what is left of them after a fit goes together less than they do: the fit
takes up what looks like its slopes. The likelihood of what no slope can take up (Patterson & Thompson, 1971, Biometrika
58:545; Harville, 1977, Journal of the American Statistical Association 72:320) allows for that.

Compiled: it takes numba a while to load.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import LASTING, OWN_SHARES
from estimators.linear.few_columns import TINY
from slipcore.compilation import compiled

FloatArray = NDArray[np.float64]

LASTS = np.array([1.0, *(lasts for lasts in LASTING for _ in OWN_SHARES)])
OWN = np.array([1.0, *(own for _ in LASTING for own in OWN_SHARES)])
"""How long errors last and the part of their variance that each stretch has for itself; first all of it."""
KEPT = np.exp(-1.0 / LASTS)
"""What is kept of lasting errors from one stretch to the next."""
TOGETHER = 4
"""Factors of a determinant under one logarithm: of 1e77 at most each."""


class LevelErrors(NamedTuple):
    """Covariances of the errors in the levels of p places: of those that are ``own`` to each of b stretches, [p, b],
    and of those that are ``lasting``, [b, b], the same in each place.
    """

    own: FloatArray
    lasting: FloatArray


@compiled(fastmath={"contract"})
def errors_of_levels(level: FloatArray, design: FloatArray, weight: FloatArray, independent: float) -> LevelErrors:
    """Of the ``level`` [p, b] of each of b stretches of p places, alike long and in their order.

    Of a level of ``weight`` [p, b] 0 nothing was seen. ``design`` [p, b, d]: columns of full rank of what the levels of
    all places may follow, beside the mean of each place, that is no error. Errors of places are independent. Those of
    one are each stretch's own, as independent samples make them (``independent``: how probable that is before), or a
    part is, and the rest falls off exponentially with the time between stretches. How long it lasts and how large the
    part is (``LASTING``, ``OWN_SHARES``, each as likely before) are averaged over what the levels say of them, and the
    variance over a prior 1/σ². Takes at least p + d + 3 levels (``within_places.SPARE``).
    """
    places, stretches, columns = design.shape
    own, levels, seen = np.zeros((places, stretches)), 0, 0.0
    for place in range(places):
        for stretch in range(stretches):
            if weight[place, stretch] > 0.0:
                own[place, stretch] = 1.0 / weight[place, stretch]
                levels += 1
                seen += weight[place, stretch]
    square, log_likely = _left(level, design, own * (seen / levels), KEPT, OWN)
    degrees, ways = levels - places - columns, len(OWN)
    for way in range(ways):
        square[way] = max(square[way], TINY)
        log_likely[way] = -0.5 * degrees * math.log(square[way]) - log_likely[way]
    log_likely[0] += math.log(independent / (1.0 - independent) * (ways - 1))
    most, whole, times = log_likely.max(), 0.0, 0.0
    apart, lasting = np.zeros(stretches), np.empty((stretches, stretches))
    for way in range(ways):
        likely = math.exp(log_likely[way] - most)
        variance = likely * square[way] / (degrees - 2)
        whole += likely
        times += variance * OWN[way]
        for stretch in range(stretches):
            apart[stretch] += variance * (1.0 - OWN[way]) * KEPT[way] ** stretch
    for one in range(stretches):
        for other in range(stretches):
            lasting[one, other] = apart[abs(one - other)] / whole
    return LevelErrors(own * (times / whole * seen / levels), lasting)


@compiled(fastmath={"contract"})
def _left(
    level: FloatArray, design: FloatArray, own: FloatArray, kept: FloatArray, share: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The square [m] of the ``level`` [p, b] that is left, in errors made independent and of one variance, when the
    mean of each place and the columns of ``design`` [p, b, d] are taken out, and the logarithm [m] of the root of the
    determinant of what it is divided by, and of the size of what is taken.

    In m ways of a ``share`` [m] of errors that is a stretch's own, of which the rest is ``kept`` [m] from one to the
    next; ``own`` [p, b]: relative variances of a stretch's own errors, 0 where nothing was seen. What is taken is taken
    one by one (Gauss). All ways go on together, for which processors have instructions.
    """
    columns, ways = design.shape[2] + 2, len(kept)
    last = columns - 1
    total, square = np.zeros((columns, columns, ways)), np.empty((columns, columns, ways))
    log_size, rows = np.zeros(ways), np.ones((level.shape[1], columns))
    for place in range(len(level)):
        for stretch in range(level.shape[1]):
            for column in range(1, last):
                rows[stretch, column] = design[place, stretch, column - 1]
            rows[stretch, last] = level[place, stretch]
        _filter(rows, own[place], kept, share, square, log_size)
        for way in range(ways):
            log_size[way] += 0.5 * math.log(square[0, 0, way])
        for i in range(1, columns):
            for j in range(1, i + 1):
                for way in range(ways):
                    taken = square[i, 0, way] * square[j, 0, way] / square[0, 0, way]
                    total[i, j, way] += square[i, j, way] - taken
    for column in range(1, last):
        for way in range(ways):
            log_size[way] += 0.5 * math.log(total[column, column, way])
            for i in range(column + 1, columns):
                part = total[i, column, way] / total[column, column, way]
                for j in range(column + 1, i + 1):
                    total[i, j, way] -= part * total[j, column, way]
    return total[last, last], log_size


@compiled(fastmath={"contract"})
def _filter(
    rows: FloatArray, own: FloatArray, kept: FloatArray, share: FloatArray, square: FloatArray, log_size: FloatArray
) -> None:
    """Write products to the lower half of ``square`` [c, c, m], of columns ``rows`` [b, c] of one place made
    independent and of one variance in m ways, and add the logarithm of the root of the determinant of what they are
    divided by to ``log_size`` [m].

    Each stretch is compared with what those before it say (Kalman, 1960, Journal of Basic Engineering 82:35).
    """
    stretches, columns = rows.shape
    ways = len(kept)
    ahead, mean, variance = np.empty((columns, ways)), np.zeros((columns, ways)), 1.0 - share
    size, gain, root = np.ones(ways), np.empty(ways), np.empty(ways)
    square[:] = 0.0
    for stretch in range(stretches):
        if own[stretch] > 0.0:
            for way in range(ways):
                total = variance[way] + share[way] * own[stretch]
                size[way] *= total
                root[way] = math.sqrt(1.0 / total)
                gain[way] = variance[way] / total
                variance[way] -= gain[way] * variance[way]
            for i in range(columns):
                for way in range(ways):
                    off = rows[stretch, i] - mean[i, way]
                    mean[i, way] += gain[way] * off
                    ahead[i, way] = root[way] * off
                for j in range(i + 1):
                    for way in range(ways):
                        square[i, j, way] += ahead[i, way] * ahead[j, way]
        if stretch % TOGETHER == 0 or stretch == stretches - 1:
            for way in range(ways):
                log_size[way] += 0.5 * math.log(size[way])
                size[way] = 1.0
        for i in range(columns):
            for way in range(ways):
                mean[i, way] *= kept[way]
        for way in range(ways):
            variance[way] = 1.0 - share[way] + kept[way] * kept[way] * (variance[way] - 1.0 + share[way])
