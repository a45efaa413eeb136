"""Mergeable sufficient statistics of the linear Gaussian model: all of a grasp's samples that its fit needs."""

import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

import numpy as np

from estimators.errors import InvalidSamples
from estimators.friction_model import Domain
from estimators.linear.grasp_statistics import Columns, GraspStatistics
from estimators.linear.least_squares import Factor, factorise, merge
from estimators.linear.observations import (
    check_columns,
    codes_of,
    common_element_area,
    noise_of,
    positive,
    velocity_unknown,
)

if TYPE_CHECKING:
    from slipcore.samples import FrictionSamples

MAGIC, WITH_GRASPS, WITH_UNKNOWN = b"SMo1", b"SMo2", b"SMo3"
NUMBERS = struct.Struct("<17d")
UNKNOWN = struct.Struct("<2d")
GRASPS = struct.Struct("<I")
UPPER = np.triu_indices(3)
NOTHING = (np.inf, -np.inf)
"""Range of no values."""


@dataclass(frozen=True, slots=True, eq=False)
class SufficientStatistics:
    """Weighted mean and triangular factor (QR) of (v, f_n, μ) about it; XᵀX is never formed.

    ``factor`` carries Σw; ``weight_square`` is Σw², so that the effective number of samples survives a merge; ``n``
    counts samples of positive weight; ``domain`` is the range of v and f_n; ``element_area`` in m². ``grasps``: what
    each grasp says place by place, or none where some sample was added without its place. Velocities that are not known
    count as 0 and are in no range: ``unknown_weight`` is Σw of their samples, and ``unknown_force`` Σw f_n, N.
    """

    factor: Factor
    weight_square: float
    n: int
    domain: Domain
    element_area: float
    grasps: tuple[GraspStatistics, ...] = ()
    unknown_weight: float = 0.0
    unknown_force: float = 0.0

    @classmethod
    def from_samples(cls, samples: "FrictionSamples", places: bool = True) -> Self:
        """Moments of one grasp's samples, none of them allowed; raises ``InvalidSamples`` as ``fit`` does.

        Without ``places`` they may be of a part of a grasp, whose parts are then merged.
        """
        area = common_element_area([samples.element_area])
        columns = check_columns([samples])
        used = positive(columns["weight"])
        v, f_n, mu, weight = (
            columns[name][used] for name in ("tangential_velocity", "normal_force", "friction_coefficient", "weight")
        )
        if len(weight) == 0:
            return cls.empty(area)
        unknown = velocity_unknown(samples)
        domain = Domain(NOTHING if unknown else (float(v.min()), float(v.max())), (float(f_n.min()), float(f_n.max())))
        place, time = codes_of(samples.element[used]), np.asarray(samples.time, dtype=float)[used]
        element = np.asarray(samples.element, dtype=np.int64)[used]
        columns_of_grasp = Columns(np.stack([v, f_n, mu]).T, weight, place, time, element)
        grasp = GraspStatistics.from_columns(columns_of_grasp, noise_of(samples), unknown)
        grasp = replace(grasp, sensor=samples.sensor)
        return cls(
            factorise(columns_of_grasp.values, weight),
            float(weight @ weight),
            len(weight),
            domain,
            area,
            (grasp,) if places else (),
            float(weight.sum()) if unknown else 0.0,
            float(weight @ f_n) if unknown else 0.0,
        )

    @classmethod
    def empty(cls, element_area: float) -> Self:
        """Moments of no samples: merging them changes nothing."""
        return cls(Factor(0.0, np.zeros(3), np.zeros((3, 3))), 0.0, 0, Domain(NOTHING, NOTHING), element_area)

    @property
    def effective_n(self) -> float:
        """Effective number of samples (Σw)²/Σw² (Kish); 0 where there are none."""
        return self.factor.weight**2 / self.weight_square if self.weight_square > 0.0 else 0.0

    def at_element_area(self, element_area: float) -> Self:
        """The same pressures on elements of another area, m²: the column of f_n scales, exactly but for rounding."""
        if element_area == self.element_area:
            return self
        scale = np.array([1.0, element_area / self.element_area, 1.0])
        factor = Factor(self.factor.weight, self.factor.mean * scale, self.factor.triangle * scale)
        low, high = self.domain.normal_force
        domain = Domain(self.domain.tangential_velocity, (low * scale[1], high * scale[1]))
        grasps = tuple(grasp.scaled(scale[1]) for grasp in self.grasps)
        force = self.unknown_force * float(scale[1])
        return replace(
            self, factor=factor, domain=domain, element_area=element_area, grasps=grasps, unknown_force=force
        )

    def of_sensor(self, name: str) -> Self:
        """The same of a sensor of this name, which ``to_bytes`` does not keep."""
        return replace(self, grasps=tuple(replace(grasp, sensor=name) for grasp in self.grasps))

    def merge(self, *others: Self) -> Self:
        """Moments of all samples behind these; any order and any grouping agree to rounding."""
        area = common_element_area([part.element_area for part in (self, *others)])
        parts = [part.at_element_area(area) for part in (self, *others)]
        return type(self)(
            merge(part.factor for part in parts),
            sum(part.weight_square for part in parts),
            sum(part.n for part in parts),
            union([part.domain for part in parts]),
            area,
            _joined([part for part in parts if part.n]),
            sum(part.unknown_weight for part in parts),
            sum(part.unknown_force for part in parts),
        )

    def add(
        self, tangential_velocity: float, normal_force: float, friction_coefficient: float, weight: float = 1.0
    ) -> Self:
        """Moments with one more sample, at a cost that does not depend on those before."""
        row = np.array([tangential_velocity, normal_force, friction_coefficient])
        _check_sample(row, weight)
        v, f_n = float(tangential_velocity), float(normal_force)
        factor = Factor(float(weight), row, np.zeros((3, 3)))
        return self.merge(type(self)(factor, weight**2, 1, Domain((v, v), (f_n, f_n)), self.element_area))

    def forget(self, factor: float) -> Self:
        """Moments with every weight multiplied by ``factor`` in (0, 1]: exponential, if done at each sample."""
        if not 0.0 < factor <= 1.0:
            raise InvalidSamples("factor", factor, "above 0 and at most 1")
        kept = self.factor
        faded = Factor(kept.weight * factor, kept.mean, kept.triangle * np.sqrt(factor))
        return replace(
            self,
            factor=faded,
            weight_square=self.weight_square * factor**2,
            grasps=(),
            unknown_weight=self.unknown_weight * factor,
            unknown_force=self.unknown_force * factor,
        )

    def to_bytes(self) -> bytes:
        """These moments in little-endian doubles: 140 bytes, and less than 16 kB for each grasp."""
        numbers = [self.n, self.factor.weight, self.weight_square, self.element_area, *self.factor.mean]
        numbers += [*self.domain.tangential_velocity, *self.domain.normal_force, *self.factor.triangle[UPPER]]
        content = NUMBERS.pack(*(float(number) for number in numbers))
        grasps = GRASPS.pack(len(self.grasps)) + b"".join(grasp.to_bytes() for grasp in self.grasps)
        if self.unknown_weight > 0.0:
            return WITH_UNKNOWN + content + UNKNOWN.pack(self.unknown_weight, self.unknown_force) + grasps
        return WITH_GRASPS + content + grasps if self.grasps else MAGIC + content

    @classmethod
    def from_bytes(cls, content: bytes) -> Self:
        """Moments from ``to_bytes``, of this version or those before; raises ``InvalidSamples`` for anything else."""
        magic, numbers, rest = content[:4], content[4 : 4 + NUMBERS.size], content[4 + NUMBERS.size :]
        known = magic in (MAGIC, WITH_GRASPS, WITH_UNKNOWN)
        if not known or len(numbers) < NUMBERS.size or (magic == MAGIC and rest):
            raise InvalidSamples("moments", f"{len(content)} bytes from {magic!r}", "bytes made by to_bytes")
        n, weight, square, area, *values = NUMBERS.unpack(numbers)
        triangle = np.zeros((3, 3))
        triangle[UPPER] = values[7:]
        is_finite = np.isfinite([n, weight, square, area, *values[:3], *values[7:]]).all()
        if not (is_finite and min(n, weight, square) >= 0.0 and area > 0.0):
            allowed = "finite numbers, counts and weights of at least 0, and an element area above 0 m²"
            raise InvalidSamples("moments", "not finite, negative or of no area", allowed)
        factor = Factor(weight, np.array(values[:3]), triangle)
        domain = Domain((values[3], values[4]), (values[5], values[6]))
        unknown, rest = _read_unknown(rest) if magic == WITH_UNKNOWN else ((0.0, 0.0), rest)
        return cls(factor, square, int(n), domain, area, () if magic == MAGIC else _read_grasps(rest), *unknown)


def _joined(parts: "list[SufficientStatistics]") -> tuple[GraspStatistics, ...]:
    """The grasps of all parts; none where one of the parts does not know of its places."""
    if all(part.grasps for part in parts):
        return tuple(grasp for part in parts for grasp in part.grasps)
    return ()


def _read_unknown(content: bytes) -> tuple[tuple[float, float], bytes]:
    """Weight and force of the samples of unknown velocity, and the bytes after them."""
    if len(content) < UNKNOWN.size:
        raise InvalidSamples("moments", "cut short", "bytes made by to_bytes")
    weight, force = UNKNOWN.unpack_from(content)
    if not (np.isfinite([weight, force]).all() and weight > 0.0):
        raise InvalidSamples("weight of unknown velocities", weight, "finite and above 0")
    return (weight, force), content[UNKNOWN.size :]


def _read_grasps(content: bytes) -> tuple[GraspStatistics, ...]:
    if len(content) < GRASPS.size:
        raise InvalidSamples("moments", "cut short", "bytes made by to_bytes")
    (count,), rest = GRASPS.unpack_from(content), content[GRASPS.size :]
    grasps = []
    for _ in range(count):
        grasp, rest = GraspStatistics.from_bytes(rest)
        grasps.append(grasp)
    if rest:
        raise InvalidSamples("moments", f"followed by {len(rest)} more bytes", "bytes made by to_bytes")
    return tuple(grasps)


def union(domains: Sequence[Domain]) -> Domain:
    """The smallest domain that holds all of them."""
    v = np.array([domain.tangential_velocity for domain in domains])
    f_n = np.array([domain.normal_force for domain in domains])
    return Domain(
        (float(v[:, 0].min()), float(v[:, 1].max())),
        (float(f_n[:, 0].min()), float(f_n[:, 1].max())),
    )


def _check_sample(row: np.ndarray, weight: float) -> None:
    for name, value in zip(("tangential_velocity", "normal_force", "friction_coefficient"), row, strict=True):
        if not np.isfinite(value) or (value < 0.0 and name != "friction_coefficient"):
            raise InvalidSamples(name, value, "finite" if name == "friction_coefficient" else "finite and at least 0")
    if not (np.isfinite(weight) and weight > 0.0):
        raise InvalidSamples("weight", weight, "finite and above 0")
