"""What the data say, in the form that every method reads: a factor, its clusters and, where kept, the samples."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import CLUSTERS, LINEAR
from estimators.errors import InvalidSamples, TooFewSamples
from estimators.friction_model import Domain
from estimators.linear.grasp_statistics import Columns, GraspStatistics
from estimators.linear.least_squares import Factor, factorise
from estimators.linear.observations import IntArray, Observations, codes_of, observe
from estimators.linear.statistics import SufficientStatistics

if TYPE_CHECKING:
    from slipcore.samples import FrictionSamples

FloatArray = NDArray[np.float64]
GraspData: TypeAlias = (
    "FrictionSamples | SufficientStatistics | Sequence[FrictionSamples] | Sequence[SufficientStatistics]"
)
"""Samples or moments of one grasp, or of several."""


@dataclass(frozen=True, slots=True, eq=False)
class FitData:
    """Data behind a fit: ``factor`` of (v, f_n, μ) whose weight is the effective number of samples.

    ``clusters``: how many groups of samples share errors, of ``cluster_kind``; ``observations``: the samples, or None
    where only moments are known; ``blocks``: the moments, one a grasp, where they came so, and of the kind "merged"
    where those of several grasps came as one, which no longer tell how grasps differ. ``unknown`` [3]: sums over the
    samples of unknown velocity, for which v counts as 0, of their weights times (1, v, f_n).
    """

    factor: Factor
    n: int
    domain: Domain
    element_area: float
    clusters: int
    cluster_kind: str
    observations: Observations | None
    blocks: tuple[SufficientStatistics, ...]
    unknown: FloatArray

    @property
    def unknown_velocity(self) -> float:
        """The part of the samples, by weight, whose velocity is unknown."""
        return float(self.unknown[0]) / self.effective_n

    @property
    def effective_n(self) -> float:
        """Effective number of samples (Kish)."""
        return self.factor.weight

    @property
    def mean_friction(self) -> float:
        """Weighted mean of μ."""
        return float(self.factor.mean[-1])

    @property
    def of_one_grasp(self) -> bool:
        """Whether all samples are known to be of one grasp."""
        if self.observations is not None:
            return self.cluster_kind != "grasp"
        return self.cluster_kind == "none" and len(self.blocks[0].grasps) == 1

    @property
    def of_one_record(self) -> bool:
        """Whether all samples are known to be of one grasp at one place: nothing else has errors of its own."""
        if self.observations is not None:
            return self.cluster_kind == "time block"
        return self.of_one_grasp and self.blocks[0].grasps[0].of_one_place

    def places_leave_open(self) -> bool:
        """Whether all samples are of one grasp at several places, too few to show what their lasting errors do.

        What they say of a slope is then less than ``few_places`` of what they would say beside many grasps.
        """
        if self.cluster_kind not in {"element", "none"}:
            return False
        grasps = self._statistics()
        if len(grasps) != 1 or grasps[0].of_one_place or grasps[0].alone is None:
            return False
        alone, several = (np.square(part[:, :2]).sum(axis=0) for part in (grasps[0].alone, grasps[0].within))
        return bool((alone < CLUSTERS.few_places * several).any())

    def centred_rows(self) -> FloatArray:
        """Four rows a grasp, [g, 4, 4], in (1, v, f_n, μ) about the common mean, with all its sums of squares."""
        whole = self.blocks[0].merge(*self.blocks[1:])
        rows = np.zeros((len(self.blocks), 4, 4))
        for row, block in zip(rows, self.blocks, strict=True):
            part = relative(block.factor, whole)
            row[0] = np.sqrt(part.weight) * np.array([1.0, *(part.mean - self.factor.mean)], dtype=float)
            row[1:, 1:] = part.triangle
        return rows

    def mean_row(self) -> FloatArray:
        """(1, v, f_n) at the weighted mean of the data, [3]."""
        return np.array([1.0, *self.factor.mean[:2]], dtype=float)

    def speed(self) -> tuple[float, float]:
        """Weighted mean and standard deviation of v, m/s, those that are unknown as of 0."""
        return float(self.factor.mean[0]), float(self.factor.triangle[0, 0]) / math.sqrt(self.effective_n)

    def grasp_statistics(self) -> tuple[GraspStatistics, ...]:
        """Each grasp place by place, as one of so many; moments that know of no places count as those of one."""
        grasps = self._statistics()
        return tuple(grasp.among(len(grasps)) for grasp in grasps)

    def _statistics(self) -> tuple[GraspStatistics, ...]:
        if self.observations is not None:
            return _statistics_of_samples(self.observations)
        return tuple(grasp for block in self.blocks for grasp in block.grasps or (_of_one_place(block),))

    def kept(self, rows: NDArray[np.bool_]) -> "FitData":
        """The data of some of the samples only."""
        observations = self.raw("a choice of samples")
        return _from_samples(observations.take(rows, observations.weight[rows]))

    def raw(self, method: str) -> Observations:
        """The samples; raises ``InvalidSamples`` where there are moments only."""
        if self.observations is None:
            raise InvalidSamples("samples", "moments only", f'the samples themselves, which "{method}" needs')
        return self.observations


def gather(
    samples: GraspData,
) -> FitData:
    """What a fit reads, from samples or moments of one grasp or of several; raises what ``observe`` raises."""
    parts = list(samples) if isinstance(samples, Sequence) else [samples]
    for part in parts:
        if not hasattr(part, "element_area"):
            value = type(samples).__name__ + f" of {type(part).__name__}" * (samples is not part)
            raise InvalidSamples("samples", value, "FrictionSamples or Moments of one grasp, or a list of these")
    moments = [part for part in parts if isinstance(part, SufficientStatistics)]
    if not moments:
        return _from_samples(observe(cast("list[FrictionSamples]", parts)))
    if len(moments) < len(parts):
        raise InvalidSamples("samples", "a mixture of samples and moments", "one kind")
    return _from_moments(moments)


def _from_samples(observations: Observations) -> FitData:
    relative, weight = observations.velocity_is_relative, observations.weight
    v, f_n = observations.tangential_velocity[~relative], observations.normal_force
    unknown = weight[relative]
    return FitData(
        factor=factorise(observations.columns(), observations.weight),
        n=len(observations),
        domain=Domain(_range(v), _range(f_n)),
        element_area=observations.element_area,
        clusters=observations.clusters,
        cluster_kind=observations.cluster_kind,
        observations=observations,
        blocks=(),
        unknown=np.array([unknown.sum(), 0.0, unknown @ f_n[relative]]),
    )


def _from_moments(moments: list[SufficientStatistics]) -> FitData:
    whole = moments[0].merge(*moments[1:])
    if whole.n < LINEAR.min_samples or whole.effective_n <= LINEAR.min_samples - 1:
        value = f"{whole.n}, worth {whole.effective_n:.3g} by their weights"
        raise TooFewSamples("samples", value, f"at least {LINEAR.min_samples}")
    blocks = tuple(part.at_element_area(whole.element_area) for part in moments if part.n)
    v = np.array(whole.domain.tangential_velocity)
    return FitData(
        factor=relative(whole.factor, whole),
        n=whole.n,
        domain=Domain(_range(v[np.isfinite(v)]), whole.domain.normal_force),
        element_area=whole.element_area,
        clusters=len(blocks),
        cluster_kind="grasp" if len(blocks) > 1 else "merged" if len(blocks[0].grasps) > 1 else "none",
        observations=None,
        blocks=blocks,
        unknown=_unit(whole) * np.array([whole.unknown_weight, 0.0, whole.unknown_force]),
    )


def relative(factor: Factor, whole: SufficientStatistics) -> Factor:
    """A factor with its weights in units that make those of ``whole`` sum to their effective number."""
    unit = _unit(whole)
    return Factor(factor.weight * unit, factor.mean, factor.triangle * np.sqrt(unit))


def _range(values: FloatArray) -> tuple[float, float]:
    """Least and greatest; at rest where no velocity is known: what is answered then holds for the limit v → 0."""
    return (float(values.min()), float(values.max())) if len(values) else (0.0, 0.0)


def _unit(whole: SufficientStatistics) -> float:
    return whole.factor.weight / whole.weight_square


def _statistics_of_samples(observations: Observations) -> tuple[GraspStatistics, ...]:
    values, order = observations.columns(), np.argsort(observations.grasp, kind="stable")
    ends = np.flatnonzero(np.diff(observations.grasp[order])) + 1
    return tuple(_statistics_of_grasp(observations, values, rows) for rows in np.split(order, ends))


def _statistics_of_grasp(observations: Observations, values: FloatArray, rows: IntArray) -> GraspStatistics:
    columns = Columns(
        values[rows],
        observations.weight[rows],
        codes_of(observations.element[rows]),
        observations.time[rows],
        observations.element[rows],
    )
    grasp, unknown = observations.grasp[rows[0]], bool(observations.velocity_is_relative[rows[0]])
    found = GraspStatistics.from_columns(columns, observations.noise[grasp], unknown)
    return replace(found, sensor=observations.sensors[grasp])


def _of_one_place(block: SufficientStatistics) -> GraspStatistics:
    factor = block.factor
    return GraspStatistics(
        count=np.ones(1),
        weight=np.array([factor.weight]),
        mean=np.asarray(factor.mean, dtype=float)[None],
        spread=np.zeros((1, 3, 3)),
        within=factor.triangle.astype(float),
        total_weight=factor.weight,
        weight_square=block.weight_square,
        velocity_unknown=block.unknown_weight > 0.0,
    )
