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
from estimators.linear.observations import check_columns, codes_of, common_element_area, positive

if TYPE_CHECKING:
    from slipcore.samples import FrictionSamples

MAGIC, WITH_GRASPS = b"SMo1", b"SMo2"
NUMBERS = struct.Struct("<17d")
GRASPS = struct.Struct("<I")
UPPER = np.triu_indices(3)


@dataclass(frozen=True, slots=True, eq=False)
class SufficientStatistics:
    """Weighted mean and triangular factor (QR) of (v, f_n, μ) about it; XᵀX is never formed.

    ``factor`` carries Σw; ``weight_square`` is Σw², so that the effective number of samples survives a merge; ``n``
    counts samples of positive weight; ``domain`` is the range of v and f_n; ``element_area`` in m². ``grasps``: what
    each grasp says place by place, or none where some sample was added without its place.
    """

    factor: Factor
    weight_square: float
    n: int
    domain: Domain
    element_area: float
    grasps: tuple[GraspStatistics, ...] = ()

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
        domain = Domain((float(v.min()), float(v.max())), (float(f_n.min()), float(f_n.max())))
        values = np.stack([v, f_n, mu]).T
        place = codes_of(samples.element[used])
        grasp = (GraspStatistics.from_columns(Columns(values, weight, place), samples.normal_force_noise),)
        factor = factorise(values, weight)
        return cls(factor, float(weight @ weight), len(weight), domain, area, grasp if places else ())

    @classmethod
    def empty(cls, element_area: float) -> Self:
        """Moments of no samples: merging them changes nothing."""
        nothing = (np.inf, -np.inf)
        return cls(Factor(0.0, np.zeros(3), np.zeros((3, 3))), 0.0, 0, Domain(nothing, nothing), element_area)

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
        return replace(self, factor=factor, domain=domain, element_area=element_area, grasps=grasps)

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
        return replace(self, factor=faded, weight_square=self.weight_square * factor**2, grasps=())

    def to_bytes(self) -> bytes:
        """These moments in little-endian doubles: 140 bytes, and less than 16 kB for each grasp."""
        numbers = [self.n, self.factor.weight, self.weight_square, self.element_area, *self.factor.mean]
        numbers += [*self.domain.tangential_velocity, *self.domain.normal_force, *self.factor.triangle[UPPER]]
        content = NUMBERS.pack(*(float(number) for number in numbers))
        if not self.grasps:
            return MAGIC + content
        grasps = b"".join(grasp.to_bytes() for grasp in self.grasps)
        return WITH_GRASPS + content + GRASPS.pack(len(self.grasps)) + grasps

    @classmethod
    def from_bytes(cls, content: bytes) -> Self:
        """Moments from ``to_bytes``, of this version or the one before; raises ``InvalidSamples`` for anything else."""
        magic, numbers, rest = content[:4], content[4 : 4 + NUMBERS.size], content[4 + NUMBERS.size :]
        if magic not in (MAGIC, WITH_GRASPS) or len(numbers) < NUMBERS.size or (magic == MAGIC and rest):
            raise InvalidSamples("moments", f"{len(content)} bytes from {magic!r}", "bytes made by to_bytes")
        n, weight, square, area, *values = NUMBERS.unpack(numbers)
        triangle = np.zeros((3, 3))
        triangle[UPPER] = values[7:]
        if not (np.isfinite([n, weight, square, area, *values[:3], *values[7:]]).all() and weight >= 0.0 and n >= 0.0):
            raise InvalidSamples(
                "moments", "not finite or negative", "finite numbers, counts and weights of at least 0"
            )
        factor = Factor(weight, np.array(values[:3]), triangle)
        domain = Domain((values[3], values[4]), (values[5], values[6]))
        return cls(factor, square, int(n), domain, area, _read_grasps(rest) if magic == WITH_GRASPS else ())


def _joined(parts: "list[SufficientStatistics]") -> tuple[GraspStatistics, ...]:
    """The grasps of all parts; none where one of the parts does not know of its places."""
    if all(part.grasps for part in parts):
        return tuple(grasp for part in parts for grasp in part.grasps)
    return ()


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
