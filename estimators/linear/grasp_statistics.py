"""Mergeable statistics of a grasp by place: what the model of scatter between grasps, places and samples needs."""

import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import CLUSTERS, ROUNDING
from estimators.errors import InvalidSamples
from estimators.linear.least_squares import upper_triangle
from estimators.linear.place_correlation import independent_share
from estimators.linear.within_places import within_places

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


HEADER = struct.Struct("<2I8d")
SHARE = struct.Struct("<d")
TRIANGLE = struct.Struct("<6d")
POOLED, UNKNOWN, ALIKE, ALONE = 1, 2, 4, 8
"""Flags in its second number: places in groups, velocity unknown; behind it a share of places, and a triangle."""
UPPER = np.triu_indices(3)
NO_NOISE = np.zeros(2)


class Columns(NamedTuple):
    """Samples of one grasp: ``values`` [k, 3] of (v, f_n, μ), ``weight`` [k] > 0, ``place`` [k], codes from 0 in the
    order of the ``element`` [k], row-major, and ``time`` [k] s. Without ``element`` no place has a known neighbour.
    """

    values: FloatArray
    weight: FloatArray
    place: IntArray
    time: FloatArray
    element: IntArray | None = None


@dataclass(frozen=True, slots=True, eq=False)
class GraspStatistics:
    """Weights and means of the places (elements) of one grasp, and the spread of its samples about them.

    Groups [g] of places: ``count`` places of about the same ``weight`` Σw each, the weighted ``mean`` [g, 3] of
    (v, f_n, μ), and the triangular factor ``spread`` [g, 3, 3] of the places' means about it, which is zero where a
    group is one place. ``within`` [3, 3]: triangular factor of all samples about the means of their places,
    freed of noise and of errors that go together; ``alone`` the same without another grasp, where few places leave open
    how errors last (``slopes_of_places``); None where it was not stored.
    ``total_weight`` Σw and ``weight_square`` Σw² give the effective number of samples. ``velocity_unknown``: v is
    that relative to what seems to stick, and counts as 0. ``share``: the part of the places that they count as, where
    neighbours are off alike (``place_correlation``). ``sensor``: the name of the grasp's sensor, "" where it is not
    known; whoever stores these statistics keeps it beside them, for ``to_bytes`` does not.

    Exact up to ``most_places`` places; beyond, places whose weights differ by a few per cent count as alike.
    """

    count: FloatArray
    weight: FloatArray
    mean: FloatArray
    spread: FloatArray
    within: FloatArray
    total_weight: float
    weight_square: float
    velocity_unknown: bool = False
    share: float = 1.0
    sensor: str = ""
    alone: FloatArray | None = None

    def among(self, grasps: int) -> "GraspStatistics":
        """The same as one of so many grasps: the more there are, the less depends on how few places each of them has.

        What few places leave open shrinks as all places of all grasps: of a variance that is up to twice as large
        alone, about a part 1/grasps. One place among several shows by its slopes alone how errors last
        (``slopes_of_grasps``).
        """
        if self.alone is None or (self.of_one_place and grasps > 1):
            return self
        part = 2.0 / (grasps + 1.0)
        rows = [np.sqrt(1.0 - part) * self.within, np.sqrt(part) * self.alone]
        return replace(self, within=np.asarray(upper_triangle(np.concatenate(rows)), dtype=float))

    @property
    def independent(self) -> FloatArray:
        """As how many independent places each group [g] counts."""
        return self.count * self.share

    @property
    def of_one_place(self) -> bool:
        """Whether all samples are of one place, whose level then shows its grasp's and its own scatter together."""
        return len(self.count) == 1 and float(self.count[0]) == 1.0

    @classmethod
    def from_columns(
        cls, columns: Columns, noise: FloatArray = NO_NOISE, velocity_unknown: bool = False
    ) -> "GraspStatistics":
        """Statistics of samples whose v and f_n carry ``noise`` [2] of these standard deviations, m/s and N.

        The places' means average that noise away; the deviations from them are freed of it (``within_places``), or it
        would pass for slopes.
        """
        values, weight, place, time, element = columns
        centre = weight @ values / weight.sum()
        offset = values - centre
        sums = np.bincount(place, weight).astype(float)
        mean = np.stack([np.bincount(place, weight * column) for column in offset.T], axis=1) / sums[:, None]
        left = weight.sum() * max(1.0 - len(sums) / len(weight), 0.0)
        within, alone = within_places(values, offset - mean[place], weight, time, noise * np.sqrt(left), place)
        share = 1.0
        if element is not None and left > 0.0:
            label = np.zeros(len(sums), dtype=np.int64)
            label[place] = element
            share = independent_share(mean, within[2, 2] ** 2 / left / sums, label)
        count, sums, mean, spread = _pooled(sums, mean)
        return cls(
            count=count,
            weight=sums,
            mean=mean + centre,
            spread=spread,
            within=within,
            total_weight=float(weight.sum()),
            weight_square=float(weight @ weight),
            velocity_unknown=velocity_unknown,
            share=share,
            alone=alone,
        )

    def scaled(self, normal_force: float) -> "GraspStatistics":
        """The same with all f_n times a factor, as on elements of another area."""
        factor = np.array([1.0, normal_force, 1.0])
        alone = None if self.alone is None else self.alone * factor
        mean, spread, within = (part * factor for part in (self.mean, self.spread, self.within))
        return replace(self, mean=mean, spread=spread, within=within, alone=alone)

    def to_bytes(self) -> bytes:
        """These statistics in little-endian doubles, less than 16 kB."""
        pooled = bool((self.count > 1.0).any())
        alike = self.share < 1.0
        flags = POOLED * pooled | UNKNOWN * self.velocity_unknown | ALIKE * alike | ALONE * (self.alone is not None)
        header = HEADER.pack(
            len(self.count), flags, self.total_weight, self.weight_square, *(float(x) for x in self.within[UPPER])
        )
        columns = [self.weight[:, None], self.mean]
        if pooled:
            columns += [self.count[:, None], self.spread[:, UPPER[0], UPPER[1]]]
        header += SHARE.pack(self.share) if alike else b""
        header += b"" if self.alone is None else TRIANGLE.pack(*(float(x) for x in self.alone[UPPER]))
        return header + np.concatenate(columns, axis=1).astype("<f8").tobytes()

    @classmethod
    def from_bytes(cls, content: bytes) -> tuple["GraspStatistics", bytes]:
        """Statistics from the start of ``content``, and the rest; raises ``InvalidSamples`` for anything else."""
        if len(content) < HEADER.size:
            raise InvalidSamples("moments of a grasp", f"{len(content)} bytes", f"at least {HEADER.size} bytes")
        groups, flags, total, square, *within = HEADER.unpack_from(content)
        pooled, unknown = bool(flags & POOLED), bool(flags & UNKNOWN)
        width, start = 11 if pooled else 4, HEADER.size
        sizes = SHARE.size * bool(flags & ALIKE), TRIANGLE.size * bool(flags & ALONE)
        end = start + sum(sizes) + 8 * width * groups
        if flags > POOLED | UNKNOWN | ALIKE | ALONE or len(content) < end:
            raise InvalidSamples("moments of a grasp", f"{len(content)} bytes", f"{end} bytes for {groups} groups")
        table = np.frombuffer(content[start + sum(sizes) : end], "<f8").reshape(groups, width).astype(float)
        share = SHARE.unpack_from(content, start)[0] if flags & ALIKE else 1.0
        alone = TRIANGLE.unpack_from(content, start + sizes[0]) if flags & ALONE else ()
        _check(table, total, square, [*within, *alone], share)
        spread = np.zeros((groups, 3, 3))
        count = table[:, 4] if pooled else np.ones(groups)
        if pooled:
            spread[:, UPPER[0], UPPER[1]] = table[:, 5:]
        found = cls(count, table[:, 0], table[:, 1:4], spread, _triangle(within), total, square, unknown, share)
        return replace(found, alone=_triangle(alone) if alone else None), content[end:]


def _triangle(upper: Sequence[float]) -> FloatArray:
    """The triangular matrix [3, 3] of its six entries, row by row."""
    triangle = np.zeros((3, 3))
    triangle[UPPER] = upper
    return triangle


def _pooled(weight: FloatArray, mean: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Count, weight, mean and spread of groups: one a place, or places of about the same weight where there are many.

    Σ W mean meanᵀ over the places stays exact; that all places of a group have its mean weight is approximate.
    """
    if len(weight) <= CLUSTERS.most_places:
        return np.ones(len(weight)), weight, mean, np.zeros((len(weight), 3, 3))
    height = np.log(weight / weight.min())
    bins = np.floor(height / (height.max() or 1.0) * (1.0 - ROUNDING) * CLUSTERS.most_groups).astype(np.int64)
    groups = [np.flatnonzero(bins == code) for code in np.unique(bins)]
    count = np.array([float(len(group)) for group in groups])
    typical = np.array([weight[group].mean() for group in groups])
    centre = np.stack([weight[group] @ mean[group] / weight[group].sum() for group in groups])
    spread: FloatArray = np.stack(
        [
            upper_triangle(np.sqrt(weight[group] / typical[k])[:, None] * (mean[group] - centre[k])).astype(float)
            for k, group in enumerate(groups)
        ]
    )
    return count, typical, centre, spread


def _check(table: FloatArray, total: float, square: float, within: list[float], share: float) -> None:
    if not (np.isfinite(table).all() and np.isfinite([total, square, *within]).all()):
        raise InvalidSamples("moments of a grasp", "not finite", "finite numbers")
    if not 0.0 < share <= 1.0:
        raise InvalidSamples("share of a grasp's places", share, "above 0, at most 1")
    if not (total > 0.0 and square > 0.0 and (table[:, 0] > 0.0).all()):
        raise InvalidSamples("moments of a grasp", "a weight of 0 or less", "weights above 0")
