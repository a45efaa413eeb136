"""Dots of a marker gel, found in a first image and followed through those after it (docs/formats.md)."""

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from service.formats.marker_images import Grey
from service.formats.tracked_markers import MAX_ROWS
from slipcore.errors import InvalidInput
from slipcore.frames import BoolArray, FloatArray

Signal = NDArray[np.float32]

FEWEST = 3
"""Markers: fewer span no plane."""
LIGHTING = 1 / 16
"""-, of an image's shorter side: light that changes over more than that is no dot. A dot is smaller."""
INNER, OUTER = 0.5, 0.9
"""-, of a dot's radius: standard deviations of the two blurs whose difference shows dots and no even slope of light."""
FAINTEST = 2.0
"""Grey levels, of 256, that a dot stands out by in that difference: rounding makes up to 0.3."""
OF_NOISE = 5.0
"""-, times the noise in that difference, that a dot stands out by at least: noise alone has maxima of 2 to 4."""
WIDEST = 64.0
"""px, of a blur that is made at full size: a wider one is made of a smaller image, in which it is 32 to 64 px, for its
time grows with its width, to 100 s of one core at 49 megapixels.
"""
DIMMEST, BRIGHTEST = 0.4, 2.5
"""-, of the usual dot: what stands out by less or more is none."""
ROUND = 0.5
"""-, least share of a dot's length that its width has, both squared: an edge's is 0.3 at most."""
REACH = 0.3
"""-, of the distance between markers: how far from where it is expected a marker may be. Below a half, or it could be
its neighbour."""
WINDOW = 0.6
"""-, of a dot's radius: standard deviation of the window under which its centroid is taken; that of the dot itself."""
ROUNDS = 6
"""Of a centroid's search, which halves its error at least each time."""
NEIGHBOURS = 8
"""Of a marker, by whose median motion it is expected where it was lost."""
FAR = 0.4
"""-, of the distance between markers: who moves farther from frame to frame may be taken for a neighbour."""


@dataclass(frozen=True, slots=True, eq=False)
class Dots:
    """Dots of the first image: ``rest`` [k, 2] px (x to the right, y down, from the middle of the first pixel), their
    ``radius`` and the usual distance to the nearest one, ``pitch``, in px, whether they are ``dark``, and by how many
    grey levels they stand out.
    """

    rest: FloatArray
    radius: float
    pitch: float
    dark: bool
    height: float


@dataclass(frozen=True, slots=True, eq=False)
class TrackedFrame:
    """An image with its dots: ``place`` [k, 2] px, of those that are not ``seen`` [k] where they are expected."""

    image: Grey
    place: FloatArray
    seen: BoolArray


@dataclass(frozen=True, slots=True, eq=False)
class DotTracks:
    """Dots over time: ``place`` [t, k, 2] px, NaN where lost, and the largest step of one from frame to frame, px."""

    dots: Dots
    place: FloatArray
    largest_step: float

    @property
    def lost_places(self) -> int:
        """How many of them are NaN."""
        return int(np.isnan(self.place[..., 0]).sum())


def track(images: Iterable[Grey], dark: bool | None = None) -> DotTracks:
    """Find dots in the first image, and follow them; where ``dark`` is None, whether they are is seen in that image.

    Raises ``InvalidInput`` where there are no images, too few dots, or more rows than a table may have.
    """
    images = iter(images)
    first = next(images, None)
    if first is None:
        raise InvalidInput("images", "without any frame", "at least one")
    dots = find_dots(first, dark)
    frame = TrackedFrame(first, dots.rest, np.ones(len(dots.rest), dtype=np.bool_))
    places, largest = [dots.rest], 0.0
    for image in images:
        after = step(dots, frame, image)
        both = frame.seen & after.seen
        largest = max(largest, float(np.linalg.norm((after.place - frame.place)[both], axis=1).max(initial=0.0)))
        frame = after
        places.append(np.where(frame.seen[:, None], frame.place, np.nan))
        if len(places) * len(dots.rest) > MAX_ROWS:
            raise InvalidInput("images", f"over {len(places) - 1} with {len(dots.rest)} markers", f"{MAX_ROWS} places")
    return DotTracks(dots, np.array(places), largest)


def find_dots(image: Grey, dark: bool | None = None) -> Dots:
    """Dots of an image; raises ``InvalidInput`` where there are fewer than three."""
    if int(image.max()) - int(image.min()) <= FAINTEST:  # nor does the difference of two blurs differ by more
        raise _too_few(0, bool(dark))
    smooth = _blurred(image.astype(np.float32), 1.0)
    flat = smooth - _blurred(smooth, max(min(image.shape) * LIGHTING, 1.0))
    if dark is None:  # dots cover less than the ground does
        dark = bool(np.mean((flat - np.median(flat)) ** 3) < 0.0)
    radius = _radius(-flat if dark else flat)
    signal = _dots_alone(image, radius, dark)
    least = max(FAINTEST, OF_NOISE * _noise(image, radius), _between(signal))
    place, height = _candidates(signal, radius, least)
    place = place[_usual(height)]
    if len(place) < FEWEST:
        raise _too_few(len(place), dark)
    nearest = np.asarray(cKDTree(place).query(place, 2)[0])[:, 1]
    return Dots(place, radius, float(np.median(nearest)), dark, float(np.median(height[_usual(height)])))


def _too_few(count: int, dark: bool) -> InvalidInput:
    kind = "dark" if dark else "light"
    return InvalidInput("markers", f"{count} {kind} dots in the first image", f"at least {FEWEST} dots")


def step(dots: Dots, before: TrackedFrame, image: Grey) -> TrackedFrame:
    """The next frame: each dot is where one is seen nearest to where flow, or its neighbours' motion, leads it."""
    expected = _expected(dots, before, image)
    signal = _dots_alone(image, dots.radius, dots.dark)
    found, _ = _candidates(signal, dots.radius, max(FAINTEST, DIMMEST * dots.height), BRIGHTEST * dots.height)
    marker, candidate = _matched(expected, found, REACH * dots.pitch)
    place, seen = expected.copy(), np.zeros(len(expected), dtype=np.bool_)
    place[marker], seen[marker] = found[candidate], True
    return TrackedFrame(image, place, seen)


def _expected(dots: Dots, before: TrackedFrame, image: Grey) -> FloatArray:
    """Where each dot [k, 2] goes by optical flow, if that leads back; else by what dots around it moved since rest."""
    points = before.place.astype(np.float32)[:, None]
    window = 2 * round(dots.pitch / 2) + 1
    size = {"winSize": (window, window), "maxLevel": 2}
    after, forward, _ = cv2.calcOpticalFlowPyrLK(before.image, image, points, None, **size)  # type: ignore[call-overload]
    back, backward, _ = cv2.calcOpticalFlowPyrLK(image, before.image, after, None, **size)  # type: ignore[call-overload]
    returns = np.linalg.norm((back - points)[:, 0], axis=1) < REACH * dots.pitch / 2
    known = before.seen & returns & (forward[:, 0] == 1) & (backward[:, 0] == 1)
    place: FloatArray = np.where(known[:, None], after[:, 0].astype(np.float64), before.place)
    if known.any() and not known.all():
        moved = (place - dots.rest)[known]
        count = min(NEIGHBOURS, len(moved))
        around = np.asarray(cKDTree(dots.rest[known]).query(dots.rest[~known], np.arange(1, count + 1))[1])
        place[~known] = dots.rest[~known] + np.median(moved[around], axis=1)
    return place


def _matched(expected: FloatArray, found: FloatArray, reach: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Pairs of those who are each other's nearest, within reach."""
    if not len(found):
        return np.zeros(0, np.intp), np.zeros(0, np.intp)
    distance, candidate = (np.asarray(each) for each in cKDTree(found).query(expected))
    nearest = np.asarray(cKDTree(expected).query(found)[1])
    marker = np.flatnonzero((distance < reach) & (nearest[candidate] == np.arange(len(expected))))
    return marker, candidate[marker]


def _dots_alone(image: Grey, radius: float, dark: bool) -> Signal:
    """A difference of two blurs: positive at dots, 0 where light is even or an even slope [rows, columns]."""
    grey = image.astype(np.float32)
    near, wide = (_blurred(grey, share * radius) for share in (INNER, OUTER))
    return np.asarray(wide - near if dark else near - wide, dtype=np.float32)


def _blurred(image: Signal, deviation: float) -> Signal:
    """Under a Gaussian window of this standard deviation, px."""
    if deviation <= WIDEST:
        return np.asarray(cv2.GaussianBlur(image, (0, 0), deviation), dtype=np.float32)
    times = 2.0 * deviation / WIDEST // 1.0
    rows, columns = (max(round(count / times), 1) for count in image.shape)
    small = cv2.resize(image, (columns, rows), interpolation=cv2.INTER_AREA)
    blurred = cv2.GaussianBlur(small, (0, 0), deviation / times)
    return np.asarray(cv2.resize(blurred, image.shape[::-1], interpolation=cv2.INTER_LINEAR), dtype=np.float32)


def _candidates(signal: Signal, radius: float, least: float, most: float = np.inf) -> tuple[FloatArray, FloatArray]:
    """Centroids [c, 2] and heights [c] of all round maxima from ``least`` to ``most``, but those cut by the border."""
    size = 2 * max(round(radius), 1) + 1
    around = cv2.dilate(signal, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)))
    row, column = np.nonzero((signal == around) & (signal > least) & (signal < most))
    half = _half(radius)
    inside = (np.minimum(row, column) >= half) & (row < signal.shape[0] - half) & (column < signal.shape[1] - half)
    row, column = row[inside], column[inside]
    place, is_round = _centroids(signal, np.stack([column, row], axis=1).astype(np.float64), radius)
    height: FloatArray = signal[row, column].astype(np.float64)
    is_round[[second for _, second in cKDTree(place).query_pairs(radius)] if len(place) else []] = False
    return place[is_round], height[is_round]


def _half(radius: float) -> int:
    return int(np.ceil(1.5 * radius)) + 1


def _centroids(signal: Signal, place: FloatArray, radius: float) -> tuple[FloatArray, BoolArray]:
    """Centroids [c, 2] near each place under a Gaussian window that moves along with them, and which [c] are round.

    The window's step is doubled, as Bertin and Arnouts' SExtractor does for XWIN_IMAGE: a window that trails behind
    would take twice the rounds. Rounding of pixels leaves no bias, since the window is no step.
    """
    half, start = _half(radius), place
    offset, limit = np.arange(-half, half + 1), np.array(signal.shape[::-1]) - 1 - half
    for _ in range(ROUNDS):
        corner = np.clip(np.rint(place), half, limit).astype(np.intp)
        index = corner[:, :, None] + offset  # [c, xy, w]
        patch = np.maximum(signal[index[:, 1, :, None], index[:, 0, None, :]], 0.0).astype(np.float64)
        away = index - place[:, :, None]
        window = np.exp(-0.5 * (away / (WINDOW * radius)) ** 2)
        patch *= window[:, 1, :, None] * window[:, 0, None, :]
        along = np.stack([patch.sum(axis=1), patch.sum(axis=2)], axis=1)  # [c, xy, w]
        total = np.maximum(along[:, 0].sum(axis=1), 1e-12)[:, None]
        mean = (along * away).sum(axis=2) / total
        place = place + 2.0 * mean
    xx, yy = np.moveaxis((along * away**2).sum(axis=2) / total - mean**2, 1, 0)
    xy = np.einsum("cyx,cx,cy->c", patch, away[:, 0], away[:, 1]) / total[:, 0] - mean[:, 0] * mean[:, 1]
    middle, spread = (xx + yy) / 2.0, np.hypot((xx - yy) / 2.0, xy)
    near = np.linalg.norm(place - start, axis=1) < max(radius, 1.0)
    return place, (middle - spread >= ROUND * (middle + spread)) & near


def _radius(flat: Signal) -> float:
    """Radius in px of the spot in which the middle one of all spots' pixels is: specks have few pixels."""
    mask = (flat > _between(flat)).astype(np.uint8)
    areas = cv2.connectedComponentsWithStats(mask)[2][1:, cv2.CC_STAT_AREA]
    if not len(areas):
        return 1.0
    areas = np.sort(areas)
    middle = np.searchsorted(np.cumsum(areas), areas.sum() / 2)
    return max(float(np.sqrt(areas[middle] / np.pi)), 1.0)


def _between(signal: Signal) -> float:
    """The level, above 0, that parts dots from ground best (Otsu)."""
    top = float(signal.max())
    if top <= 0.0:
        return 0.0
    level, _ = cv2.threshold((signal.clip(0.0) * (255.0 / top)).astype(np.uint8), 0, 255, cv2.THRESH_OTSU)
    return float(level) * top / 255.0


def _noise(image: Grey, radius: float) -> float:
    """Standard deviation that noise has in the difference of blurs, by the image's second differences (Immerkær)."""
    kernel = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], dtype=np.float32) / 6.0
    rough = np.abs(cv2.filter2D(image.astype(np.float32), -1, kernel))
    point = np.zeros((8 * _half(radius) + 1,) * 2, dtype=np.uint8)
    point[point.shape[0] // 2, point.shape[1] // 2] = 1
    return 1.4826 * float(np.median(rough)) * float(np.linalg.norm(_dots_alone(point, radius, dark=False)))


def _usual(height: FloatArray) -> BoolArray:
    usual = np.median(height) if len(height) else 0.0
    return (height >= DIMMEST * usual) & (height <= BRIGHTEST * usual)
