"""Checked samples as the estimators read them: columns, relative weights and the cluster of each sample."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import CLUSTERS, LINEAR
from estimators.errors import InvalidSamples, TooFewSamples

if TYPE_CHECKING:  # a type only: importing it would load the whole of slipcore
    from slipcore.samples import FrictionSamples

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Observations:
    """Samples of positive weight, all grasps joined: arrays [k].

    ``friction`` μ [-], ``tangential_velocity`` m/s, ``normal_force`` N, ``tangential_force`` N; ``time`` s; ``weight``
    relative, scaled so that it sums to the effective number of samples (Kish); ``element`` as labelled in its grasp;
    ``grasp`` and ``cluster``: codes from 0, where a cluster is what shares errors (``cluster_kind``);
    ``element_area`` m²; ``noise`` [grasps, 2], that still in the velocities, m/s, and normal forces, N, of each;
    ``velocity_is_relative``: where the velocity is unknown, and 0 in ``tangential_velocity`` (``known_velocity``);
    ``sensors``: the name of the sensor of each grasp, "" where it is not known.
    """

    friction: FloatArray
    tangential_velocity: FloatArray
    normal_force: FloatArray
    tangential_force: FloatArray
    time: FloatArray
    weight: FloatArray
    element: IntArray
    grasp: IntArray
    cluster: IntArray
    cluster_kind: str
    element_area: float
    noise: FloatArray
    velocity_is_relative: NDArray[np.bool_]
    sensors: tuple[str, ...]

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
        """Some of the samples, with other weights [rows.sum()]; clusters are those that are left."""
        return replace(
            self,
            friction=self.friction[rows],
            tangential_velocity=self.tangential_velocity[rows],
            normal_force=self.normal_force[rows],
            tangential_force=self.tangential_force[rows],
            time=self.time[rows],
            weight=weight,
            element=self.element[rows],
            grasp=self.grasp[rows],
            cluster=np.unique(self.cluster[rows], return_inverse=True)[1],
            velocity_is_relative=self.velocity_is_relative[rows],
        )

    def place(self) -> IntArray:
        """Codes [k] from 0 of the elements of all grasps: the same element of another grasp is another place."""
        element = codes_of(self.element)
        return codes_of(self.grasp * (int(element.max()) + 1) + element)

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
    parts = [part if part.element_area == area else part.at_element_area(area) for part in parts]
    if sum(map(len, parts)) == 0:
        raise TooFewSamples("samples", "none (no slip gave one)", f"at least {LINEAR.min_samples}")
    values = check_columns(parts)
    weight = _relative_weight(values.pop("weight"))
    used = positive(weight)
    weight = weight[used]
    _check_count(weight)
    grasp = np.repeat(np.arange(len(parts)), [len(part) for part in parts])[used]
    element = _labels([part.element for part in parts])[used]
    cluster, kind = _clusters(parts, element, grasp, used)
    relative = np.repeat([velocity_unknown(part) for part in parts], [len(part) for part in parts])[used]
    names = {"friction_coefficient": "friction"}
    columns = {names.get(name, name): value[used] for name, value in values.items()}
    return Observations(
        **columns,
        time=joined([part.time for part in parts])[used],
        weight=weight,
        element=element,
        grasp=grasp,
        cluster=cluster,
        cluster_kind=kind,
        element_area=area,
        noise=np.array([noise_of(part) for part in parts]),
        velocity_is_relative=relative,
        sensors=tuple(part.sensor for part in parts),
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
    values = {name: joined([getattr(part, name) for part in parts]) for name in _LOWEST}
    for name, lowest in _LOWEST.items():
        _check_column(name, values[name], lowest)
    if any(map(velocity_unknown, parts)):
        values["tangential_velocity"] = joined([known_velocity(part) for part in parts])
    return values


def velocity_unknown(grasp: "FrictionSamples") -> bool:
    """Whether no velocity of the grasp is used, for some of its samples know only that relative to what seems to stick.

    What both kinds differ by would pass for an effect of velocity.
    """
    return bool(grasp.velocity_is_relative.any())


def known_velocity(grasp: "FrictionSamples") -> FloatArray:
    """Velocity [k] m/s of a grasp's samples, 0 where it is not known: β₁ then does not follow from them."""
    return np.zeros(len(grasp)) if velocity_unknown(grasp) else np.asarray(grasp.tangential_velocity, dtype=float)


def noise_of(grasp: "FrictionSamples") -> FloatArray:
    """Standard deviations [2] of the noise in a grasp's velocities, m/s (0 where they are not known), and forces, N."""
    return np.array([0.0 if velocity_unknown(grasp) else grasp.velocity_noise, grasp.normal_force_noise])


def joined(arrays: Sequence[NDArray[np.generic]]) -> FloatArray:
    """All arrays in one; a single one as it is, not to be written to."""
    return np.asarray(arrays[0] if len(arrays) == 1 else np.concatenate(arrays), dtype=np.float64)


def positive(weight: FloatArray) -> NDArray[np.bool_] | slice:
    """The entries above 0: a slice that copies nothing where all are."""
    return slice(None) if len(weight) and weight.min() > 0.0 else weight > 0.0


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


def _check_count(weight: FloatArray) -> None:
    if len(weight) < LINEAR.min_samples:
        raise TooFewSamples("samples", f"{len(weight)} of positive weight", f"at least {LINEAR.min_samples}")
    effective = float(weight.sum())
    if effective <= LINEAR.min_samples - 1:
        raise TooFewSamples("samples", f"worth {effective:.3g} by their weights", f"more than {LINEAR.min_samples - 1}")


def _labels(arrays: Sequence[NDArray[np.integer]]) -> IntArray:
    return np.asarray(arrays[0] if len(arrays) == 1 else np.concatenate(arrays), dtype=np.int64)


def _clusters(
    parts: "list[FrictionSamples]", element: IntArray, grasp: IntArray, used: NDArray[np.bool_] | slice
) -> tuple[IntArray, str]:
    """Codes [k] from 0 of what shares an error: the grasp, else the element, else a stretch of time."""
    if grasp[-1] > grasp[0]:
        return codes_of(grasp), "grasp"
    codes = codes_of(element)
    if codes.max() > 0:
        return codes, "element"
    order = np.argsort(joined([part.time for part in parts])[used], kind="stable")
    block = np.empty(len(order), dtype=np.int64)
    block[order] = np.arange(len(order)) * min(CLUSTERS.time_blocks, len(order)) // len(order)
    return block, "time block"


def codes_of(labels: IntArray) -> IntArray:
    """Labels [k] numbered from 0 in their order; by a table where their range allows: a sort takes ten times longer."""
    lowest = int(labels.min())
    span = int(labels.max()) - lowest + 1
    if span > 4 * len(labels):
        return np.unique(labels, return_inverse=True)[1]
    occurs = np.zeros(span, dtype=bool)
    occurs[labels - lowest] = True
    return np.asarray((np.cumsum(occurs) - 1)[labels - lowest])
