"""Readings at the end of a sensor's range: the same largest value on several elements at once, though loads go on.

A sensor that saturates shows a plateau, whose readings are equal to the last digit. Of readings that else never repeat
this alone says so. Rounded ones are equal anyhow, and a flat punch on a gel makes a plateau as well: of these it must
also stay as it is while the elements around it move on.
"""

import numpy as np

from slipcore.defaults import SATURATION
from slipcore.frames import BoolArray, FloatArray


def saturated(field: FloatArray, observed: BoolArray | None = None) -> BoolArray:
    """Which readings [t, n, m, 3] of a ``field`` [t, n, m, 3], in any unit, are at the end of their range.

    Along each axis and either way the largest of all readings is taken for that end. ``observed`` [t, n, m]: elements
    whose readings count (None: all).
    """
    found = np.zeros(field.shape, dtype=bool)
    shown = field if observed is None else np.where(observed[..., None], field, np.nan)
    changed = np.ones(len(field), dtype=bool)  # frames that repeat the one before say nothing of their own
    changed[1:] = (field[1:] != field[:-1]).any(axis=(1, 2, 3))
    for axis in range(field.shape[-1]):
        for sign in (-1.0, 1.0):
            reading = _upwards(shown, axis, sign)
            at_end = _at_end(reading)
            if at_end.any() and _is_range(reading[changed], at_end[changed]):
                found[..., axis] |= at_end
    return found


class RangeWatch:
    """Finds readings at the end of their range in frames as they come, by what came so far.

    The rule is that of ``saturated``; a range that was found is taken for one until a larger reading comes. Of frames
    before the last ``SATURATION.kept``, fewer and fewer are remembered.
    """

    def __init__(self) -> None:
        self._kept: list[FloatArray] = []
        self._largest: dict[tuple[int, float], float] = {}
        self._ends: set[tuple[int, float]] = set()
        self._reached: dict[tuple[int, float], int] = {}
        self._new = 0

    def step(self, field: FloatArray, observed: BoolArray | None = None) -> BoolArray:
        """Which readings [n, m, 3] of the next frame are at the end of their range."""
        shown = field if observed is None else np.where(observed[..., None], field, np.nan)
        repeats = bool(self._kept) and np.array_equal(shown, self._kept[-1], equal_nan=True)
        due = not repeats and self._remember(shown)
        found = np.zeros(field.shape, dtype=bool)
        for axis in range(field.shape[-1]):
            for sign in (-1.0, 1.0):
                found[..., axis] |= self._along((axis, sign), shown, repeats, due)
        return found

    def _remember(self, shown: FloatArray) -> bool:
        """Keep a frame; True where it is time to look at all that are kept."""
        self._kept.append(shown)
        if len(self._kept) > SATURATION.kept:  # of two frames, what both reach
            older = self._kept[-2::-2][::-1], self._kept[-3::-2][::-1]
            self._kept[:-1] = [np.where(np.abs(a) < np.abs(b), a, b) for a, b in zip(*older, strict=True)]
        self._new = (self._new + 1) % SATURATION.stride
        return self._new == 0

    def _along(self, way: tuple[int, float], shown: FloatArray, repeats: bool, due: bool) -> BoolArray:
        axis, sign = way
        reading = _upwards(shown, axis, sign)
        largest = max(float(reading.max()), 0.0)
        if largest > self._largest.get(way, 0.0) * (1.0 + SATURATION.equal):
            self._largest[way], self._reached[way] = largest, 0
            self._ends.discard(way)
        at_end = _reaches(reading, self._largest.get(way, 0.0))
        if np.count_nonzero(at_end) >= SATURATION.elements and not repeats:
            self._reached[way] += 1  # some may be equal once by chance, while readings grow
            if way not in self._ends and self._reached[way] >= SATURATION.again:
                readings = _upwards(np.stack(self._kept if due else [shown]), axis, sign)
                if _is_range(readings, _reaches(readings, self._largest[way])):
                    self._ends.add(way)
        return at_end if way in self._ends else np.zeros_like(at_end)


def _upwards(shown: FloatArray, axis: int, sign: float) -> FloatArray:
    """Readings [..., n, m] along an axis, of which the largest count; what was not seen is the least."""
    reading = sign * shown[..., axis]
    return np.where(np.isnan(reading), -np.inf, reading)


def _reaches(reading: FloatArray, largest: float) -> BoolArray:
    """Readings equal to the largest, where that is above 0."""
    return np.asarray((reading >= largest * (1.0 - SATURATION.equal)) & (largest > 0.0))


def _at_end(reading: FloatArray) -> BoolArray:
    """Readings [t, n, m] equal to the largest, where that is above 0 and several elements show it at once."""
    at_end = _reaches(reading, float(reading.max()))
    return at_end if at_end.sum(axis=(1, 2)).max() >= SATURATION.elements else np.zeros_like(at_end)


def _is_range(reading: FloatArray, at_end: BoolArray) -> bool:
    """Whether the largest reading is the end of a range and no value that readings happened to reach."""
    largest = float(reading.max())
    others = np.sort(reading[(reading > SATURATION.compared * largest) & ~at_end])
    gaps = np.diff(others)
    apart = gaps > SATURATION.equal * largest
    if len(others) >= SATURATION.least_others and apart.mean() > SATURATION.distinct:
        return True
    step = float(gaps[apart].min(initial=np.inf))
    least = max(SATURATION.steps * step, SATURATION.growth * largest) / largest
    return bool(np.count_nonzero(_missed(reading, at_end) > least) >= SATURATION.elements)


def _missed(reading: FloatArray, at_end: BoolArray) -> FloatArray:
    """By which share of it readings [e] of elements that reach the end would have changed while they stayed there, had
    they gone on as those around the plateau did.
    """
    from scipy.ndimage import binary_dilation, generate_binary_structure  # the server starts without

    ever = np.asarray(at_end.any(axis=0))
    ring = binary_dilation(ever, generate_binary_structure(2, 2), iterations=SATURATION.ring) & ~ever
    ring &= np.isfinite(reading[at_end.any(axis=(1, 2))]).all(axis=0)
    if not ring.any():
        return np.zeros(0)
    around = np.sqrt(np.mean(reading[:, ring] ** 2, axis=1))  # beside a punch the gel may bulge
    return np.array([_longest_growth(around, at_end[:, i, j]) for i, j in np.argwhere(ever)])


def _longest_growth(around: FloatArray, stays: BoolArray) -> float:
    """The largest change of ``around`` [t], as a share of its largest, within frames on end in which one ``stays``."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], stays, [False]))))
    changes = [np.ptp(run) / run.max() for a, b in edges.reshape(-1, 2) if (run := around[a:b]).max() > 0.0]
    return float(max(changes, default=0.0))
