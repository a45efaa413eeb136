"""Checked samples as the estimators read them: columns, relative weights and the cluster of each sample."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import MIN_SAMPLES
from estimators.errors import InvalidSamples, TooFewSamples

if TYPE_CHECKING:  # a type only: importing it would load the whole of slipcore
    from slipcore.samples import FrictionSamples

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

TIME_BLOCKS = 20
"""Blocks that the record of a single element is cut into: enough for a variance, long enough to be independent."""


@dataclass(frozen=True, slots=True, eq=False)
class Observations:
    """Samples of positive weight, all grasps joined: arrays [k].

    ``friction`` μ [-], ``tangential_velocity`` m/s, ``normal_force`` N, ``tangential_force`` N; ``weight`` relative,
    scaled so that it sums to the effective number of samples (Kish); ``grasp`` and ``cluster``: codes from 0, where a
    cluster is what errors are taken to be shared in (``cluster_kind``); ``element_area`` m².
    """

    friction: FloatArray
    tangential_velocity: FloatArray
    normal_force: FloatArray
    tangential_force: FloatArray
    weight: FloatArray
    grasp: IntArray
    cluster: IntArray
    cluster_kind: str
    element_area: float

    def __len__(self) -> int:
        return len(self.friction)

    @property
    def effective_n(self) -> float:
        """Effective number of samples (Σw)²/Σw² (Kish)."""
        return float(self.weight.sum())

    @property
    def clusters(self) -> int:
        """Number of clusters."""
        return int(self.cluster.max()) + 1

    def take(self, rows: NDArray[np.bool_], weight: FloatArray) -> "Observations":
        """Some of the samples, with other weights [rows.sum()]; clusters left empty keep their code."""
        return replace(
            self,
            friction=self.friction[rows],
            tangential_velocity=self.tangential_velocity[rows],
            normal_force=self.normal_force[rows],
            tangential_force=self.tangential_force[rows],
            weight=weight,
            grasp=self.grasp[rows],
            cluster=self.cluster[rows],
        )

    def columns(self) -> FloatArray:
        """Regressors and response (v, f_n, μ), [k, 3]."""
        return np.stack([self.tangential_velocity, self.normal_force, self.friction]).T


def observe(samples: "FrictionSamples | Sequence[FrictionSamples]") -> Observations:
    """Check and join the samples of one or more grasps, with forces as on elements of the smallest area among them.

    Raises ``InvalidSamples`` for numbers that are not finite, negative forces, velocities or weights, weights that are
    all zero; ``TooFewSamples`` where fewer than four effective samples are left.
    """
    parts = _parts(samples)
    area = common_element_area([part.element_area for part in parts])
    parts = [part.at_element_area(area) for part in parts]
    count = sum(map(len, parts))
    if count == 0:
        raise TooFewSamples("samples", "none (no slip was seen)", f"at least {MIN_SAMPLES}")
    values = check_columns(parts)
    weight = _relative_weight(values.pop("weight"))
    used = weight > 0.0
    _check_count(weight, int(used.sum()))
    grasp = np.repeat(np.arange(len(parts)), [len(part) for part in parts])[used]
    element = np.concatenate([np.asarray(part.element) for part in parts])[used]
    time = np.concatenate([np.asarray(part.time, float) for part in parts])[used]
    cluster, kind = _clusters(grasp, element, time)
    names = {"friction_coefficient": "friction"}
    columns = {names.get(name, name): value[used] for name, value in values.items()}
    return Observations(
        **columns, weight=weight[used], grasp=grasp, cluster=cluster, cluster_kind=kind, element_area=area
    )


_LOWEST = {
    "friction_coefficient": -np.inf,
    "tangential_velocity": 0.0,
    "normal_force": 0.0,
    "tangential_force": -np.inf,
    "weight": 0.0,
}


def _parts(samples: "FrictionSamples | Sequence[FrictionSamples]") -> "list[FrictionSamples]":
    """One entry a grasp that has samples; of several empty ones the first, so that the area is known."""
    parts = list(samples) if isinstance(samples, Sequence) else [samples]
    if not parts:
        raise TooFewSamples("samples", "an empty sequence", "the samples of at least one grasp")
    return [part for part in parts if len(part)] or parts[:1]


def check_columns(parts: "Sequence[FrictionSamples]") -> dict[str, FloatArray]:
    """The numeric columns of all parts joined, refused where not finite or below what they can be."""
    values = {name: np.concatenate([getattr(part, name) for part in parts]).astype(float) for name in _LOWEST}
    for name, lowest in _LOWEST.items():
        _check_column(name, values[name], lowest)
    return values


def common_element_area(areas: Sequence[float]) -> float:
    """The area, m², that all forces are brought to: the smallest, so that no order or grouping matters."""
    values = np.array(areas, dtype=float)
    if not (np.isfinite(values).all() and (values > 0.0).all()):
        raise InvalidSamples("element_area", values.tolist(), "above 0 m²")
    return float(values.min())


def _check_column(name: str, values: FloatArray, lowest: float) -> None:
    if len(values) == 0:
        return
    bad = ~np.isfinite(values)
    if bad.any():
        raise InvalidSamples(name, f"{values[bad][0]} at sample {int(np.argmax(bad))}", "finite numbers")
    smallest = float(values.min())
    if smallest < lowest:
        raise InvalidSamples(name, f"{smallest:.6g} at sample {int(np.argmin(values))}", f"at least {lowest:g}")


def _relative_weight(weight: FloatArray) -> FloatArray:
    largest = float(weight.max())
    if largest == 0.0:
        raise InvalidSamples("weight", "0 for every sample", "at least one above 0")
    scaled = weight / largest
    return np.asarray(scaled * (scaled.sum() / (scaled @ scaled)), dtype=float)


def _check_count(weight: FloatArray, used: int) -> None:
    if used < MIN_SAMPLES:
        raise TooFewSamples("samples", f"{used} of positive weight", f"at least {MIN_SAMPLES}")
    effective = float(weight.sum())
    if effective <= MIN_SAMPLES - 1:
        raise TooFewSamples("samples", f"worth {effective:.3g} by their weights", f"more than {MIN_SAMPLES - 1}")


def _clusters(grasp: IntArray, element: IntArray, time: FloatArray) -> tuple[IntArray, str]:
    """Codes [k] from 0 of what shares an error: the grasp, else the element, else a stretch of time."""
    if grasp[-1] > grasp[0]:
        return np.unique(grasp, return_inverse=True)[1], "grasp"
    codes = np.unique(element, return_inverse=True)[1]
    if codes.max() > 0:
        return codes, "element"
    order = np.argsort(time, kind="stable")
    block = np.empty(len(time), dtype=np.int64)
    block[order] = np.arange(len(time)) * min(TIME_BLOCKS, len(time)) // len(time)
    return block, "time block"
