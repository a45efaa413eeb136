"""Connected regions of contact, each under one number as long as it lasts."""

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import compiled
from slipcore.frames import BoolArray

NOWHERE = -1
"""Stands for no region."""


@compiled
def follow_regions(contact: BoolArray) -> tuple[NDArray[np.int64], int]:
    """Number of the region that each element belongs to, [t, n, m] (``NOWHERE`` without contact), and how many.

    Elements that touch side by side or at a corner are of one region. It keeps its number as long as it shares an
    element with itself in the frame before; where regions split or merge the largest common part decides.
    """
    frames, n, m = contact.shape
    found = np.full((frames, n, m), NOWHERE)
    stack = np.empty((n * m, 2), np.int64)
    regions, names = 0, np.empty(0, np.int64)
    for k in range(frames):
        if k > 0 and np.array_equal(contact[k], contact[k - 1]):
            found[k] = found[k - 1]
            continue
        known = np.sort(names)
        names = np.full(_label(contact[k], found[k], stack), NOWHERE)
        if len(names) > 0 and len(known) > 0:
            _match(found[k], found[k - 1], names, known)
        for label in range(len(names)):
            if names[label] == NOWHERE:
                names[label] = regions
                regions += 1
        for i in range(n):
            for j in range(m):
                if found[k, i, j] != NOWHERE:
                    found[k, i, j] = names[found[k, i, j]]
    return found, regions


@compiled
def widened(labels: NDArray[np.int64], margin: int) -> NDArray[np.int64]:
    """Regions [t, n, m] that have grown by ``margin`` elements to all sides, into what belongs to none."""
    frames, n, m = labels.shape
    wide = labels.copy()
    for k in range(frames):
        for _ in range(margin):
            before = wide[k].copy()
            for i in range(n):
                for j in range(m):
                    if before[i, j] != NOWHERE:
                        _spread(before[i, j], i, j, wide[k])
    return wide


@compiled
def _spread(region: int, row: int, column: int, labels: NDArray[np.int64]) -> None:
    """Let a region have the free neighbours of one of its elements."""
    n, m = labels.shape
    for i in range(max(row - 1, 0), min(row + 2, n)):
        for j in range(max(column - 1, 0), min(column + 2, m)):
            if labels[i, j] == NOWHERE:
                labels[i, j] = region


@compiled
def _label(contact: BoolArray, labels: NDArray[np.int64], stack: NDArray[np.int64]) -> int:
    """Number the regions of one frame from 0 in ``labels`` [n, m]; how many there are."""
    n, m = contact.shape
    count = 0
    for row in range(n):
        for column in range(m):
            if not contact[row, column] or labels[row, column] != NOWHERE:
                continue
            labels[row, column], stack[0, 0], stack[0, 1], depth = count, row, column, 1
            while depth > 0:
                depth -= 1
                i, j = stack[depth, 0], stack[depth, 1]
                for a in range(max(i - 1, 0), min(i + 2, n)):
                    for b in range(max(j - 1, 0), min(j + 2, m)):
                        if contact[a, b] and labels[a, b] == NOWHERE:
                            labels[a, b], stack[depth, 0], stack[depth, 1] = count, a, b
                            depth += 1
            count += 1
    return count


@compiled
def _match(
    labels: NDArray[np.int64], before: NDArray[np.int64], names: NDArray[np.int64], known: NDArray[np.int64]
) -> None:
    """Give the regions of a frame the ``names`` of those before that they have most in common with, each only once.

    ``known``: the names of the frame before, ascending. The largest common part comes first, of equal ones that of the
    lowest label and name.
    """
    pairs, shared = _common_parts(labels, before, known)
    taken = np.zeros(len(known), np.bool_)
    for part in np.argsort(-shared, kind="mergesort"):
        label, name = divmod(pairs[part], len(known))
        if names[label] == NOWHERE and not taken[name]:
            names[label] = known[name]
            taken[name] = True


@compiled
def _common_parts(
    labels: NDArray[np.int64], before: NDArray[np.int64], known: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs of a label and a known name that share elements, ascending, as label × names + place of the name; and how
    many elements they share.
    """
    both = np.empty(labels.size, np.int64)
    count = 0
    for label, name in zip(labels.flat, before.flat):  # noqa: B905 - compiled
        if label != NOWHERE and name != NOWHERE:
            both[count] = label * len(known) + np.searchsorted(known, name)
            count += 1
    pairs = np.unique(both[:count])
    shared = np.zeros(len(pairs), np.int64)
    for pair in both[:count]:
        shared[np.searchsorted(pairs, pair)] += 1
    return pairs, shared
