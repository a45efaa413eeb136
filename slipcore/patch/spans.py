"""The frames of a log's contact patches, laid end to end: what is known of all of them are arrays over these."""

from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import compiled
from slipcore.defaults import PATCHES
from slipcore.frames import FloatArray
from slipcore.patch.regions import NOWHERE

IntArray = NDArray[np.int64]
Scalar = TypeVar("Scalar", bound=np.generic)


class Spans(NamedTuple):
    """Frames of patches: of arrays [k] over them the entries from ``bounds``[p] up to ``bounds``[p + 1] are patch p's.

    ``frame`` [k]: which frame of the log it is; ``number`` [k]: that of the patch's elements in ``labels`` [t, n, m].
    """

    labels: IntArray
    bounds: IntArray
    frame: IntArray
    number: IntArray


def find_spans(labels: IntArray, count: int, pressing: FloatArray) -> Spans:
    """Where the regions are that last, and bear a share of the load.

    ``labels`` [t, n, m] of ``count`` regions (see ``follow_regions``), ``pressing`` [t, n, m] ≥ 0.
    """
    last, frames, loaded, most = (np.zeros(count, dtype) for dtype in (np.int64, np.int64, np.int64, float))
    largest = _count_frames(labels, pressing, last, frames, loaded, most)
    kept = np.flatnonzero((loaded >= PATCHES.least_frames) & (most > PATCHES.least_load_share * largest))
    bounds = np.concatenate([[0], np.cumsum(frames[kept])])
    frame = np.arange(bounds[-1]) + np.repeat(last[kept] + 1 - bounds[1:], frames[kept])
    return Spans(labels, bounds, frame, np.repeat(kept, frames[kept]))


@compiled
def _count_frames(
    labels: IntArray, pressing: FloatArray, last: IntArray, frames: IntArray, loaded: IntArray, most: FloatArray
) -> float:
    """Fill for each region its last frame, how many it has and is loaded in, and the most that it bears; the largest
    load of all of them together.
    """
    borne, largest = np.zeros(len(most)), 0.0
    for k in range(len(labels)):
        total = 0.0
        for region, pressed in zip(labels[k].flat, pressing[k].flat):  # noqa: B905 - compiled
            if region == NOWHERE:
                continue
            if frames[region] == 0 or last[region] < k:
                last[region], borne[region] = k, 0.0
                frames[region] += 1
            loaded[region] += borne[region] == 0.0 < pressed
            borne[region] += pressed
            most[region] = max(most[region], borne[region])
            total += pressed
        largest = max(largest, total)
    return largest


@compiled
def elements_at(spans: Spans, entry: int) -> IntArray:
    """Rows and columns [e, 2] of the elements of a patch in a frame."""
    labels, number = spans.labels[spans.frame[entry]], spans.number[entry]
    places = np.empty((labels.size, 2), np.int64)
    count = 0
    for i in range(labels.shape[0]):
        for j in range(labels.shape[1]):
            if labels[i, j] == number:
                places[count, 0], places[count, 1] = i, j
                count += 1
    return places[:count]


def for_kernels(field: NDArray[Scalar]) -> NDArray[Scalar]:
    """The field as one type of array, contiguous and not to be written to: kernels are compiled for each type."""
    view = np.ascontiguousarray(field).view()
    view.flags.writeable = False
    return view
