"""Grasp logs: tactile frames over time, as they enter slipcore (stage 1: frames)."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slipcore.arguments import array_of, real_array
from slipcore.defaults import LIMITS, SampleOptions
from slipcore.errors import InvalidInput
from slipcore.options import describe_options

if TYPE_CHECKING:
    from slipcore.labelled import Dataset, Variables

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Frames = BoolArray | NDArray[np.int64] | slice


def unit(vector: FloatArray) -> FloatArray:
    """Vectors [..., k] over their lengths; 0 stays."""
    return np.asarray(vector / np.maximum(np.linalg.norm(vector, axis=-1, keepdims=True), np.finfo(float).tiny))


class Frame(NamedTuple):
    """One tactile frame: what a detector's ``step`` takes."""

    time: float
    displacement: FloatArray
    force: FloatArray | None
    object_pose: FloatArray | None
    normal: FloatArray | None = None
    contact: BoolArray | None = None
    observed: BoolArray | None = None


@dataclass(frozen=True, slots=True)
class FrictionLaw:
    """Stochastic linear friction ``μ = β₀ + β₁ v + β₂ f_n + ε`` (paper, eq. 40).

    ``coefficients``: (β₀ [-], β₁ [s/m], β₂ [1/N]); ``scale``: standard deviation of ε [-]. Raises ``InvalidInput``.
    """

    coefficients: tuple[float, float, float]
    scale: float = 0.0

    def __post_init__(self) -> None:
        _array("coefficients", self.coefficients, (3,))
        if not 0.0 <= self.scale < np.inf:
            raise InvalidInput("scale", self.scale, "at least 0 and finite")


@dataclass(frozen=True, slots=True, eq=False)
class GroundTruth:
    """What a simulator knows of a log, at the measurement points.

    ``contact``, ``slip_kinematic`` (the point moves relative to the object) and ``slip_contact_factor`` (it is at
    the Coulomb limit, paper eq. 36): [t, n, m] bool. ``stick_ratio``: [t], stick area over contact area on the
    solver's own grid, NaN without contact. ``friction``: the law the scene was made with.
    """

    contact: BoolArray
    slip_kinematic: BoolArray
    slip_contact_factor: BoolArray
    stick_ratio: FloatArray
    friction: FrictionLaw

    def take(self, frames: Frames) -> "GroundTruth":
        """The truth of some frames; see ``GraspLog.take``."""
        masks = (self.contact[frames], self.slip_kinematic[frames], self.slip_contact_factor[frames])
        return GroundTruth(*masks, self.stick_ratio[frames], self.friction)


NONE = "none"
"""In a log's metadata, for what its sensor does not measure."""

ALONG_NORMAL = "along the normal"
"""There, for displacement of which only z was measured, as by height maps."""

RECONSTRUCTED = "reconstructed"
"""There, for forces that follow from displacement."""

BY_MOTION, BY_FORCES = "estimated from motion", "by reconstructed forces"
"""There, for where the contact is from."""

UNNAMED = "unknown"
"""The sensor of logs that name none."""


@dataclass(frozen=True, slots=True, eq=False)
class GraspLog:
    """A recorded grasp in SI units and the sensor frame (z along the outward normal of the sensor's surface).

    Shapes and units: ``time`` [t] s, strictly increasing, gaps allowed; ``position`` [n, m, 3] m, markers at rest;
    ``displacement`` [t, n, m, 3] m; ``element_area`` m²; ``force`` [t, n, m, 3] N on each element by the object, or
    None; ``normal`` [t, n, m, 3], outward unit vectors, or None (then see ``normals_of``); ``object_pose``
    [t, 3], x m, y m and yaw rad of the object relative to the sensor, or None; ``contact`` [t, n, m] bool where it is
    known otherwise than from force or shape, or None; ``observed`` [t, n, m] bool, or None for all: where it is False
    no marker shows the element, and its displacement is a placeholder that only neighbours' derivatives may see;
    ``gripper_force`` [t] N, the normal force on the sensor that the gripper or a wrist reports, positive where the
    object presses, or None, and its standard ``gripper_force_deviation`` N, or None where that is not known.
    A ``displacement`` of None, of a sensor that measures forces alone, is held as zeros: see ``has_displacement``.

    Arrays are held as read-only float64 or bool. Raises ``InvalidInput`` naming the field, its value and what is
    allowed.
    """

    time: FloatArray
    position: FloatArray
    displacement: FloatArray
    element_area: float
    force: FloatArray | None = None
    normal: FloatArray | None = None
    object_pose: FloatArray | None = None
    sensor: str = UNNAMED
    metadata: Mapping[str, str] = field(default_factory=dict)
    truth: GroundTruth | None = None
    contact: BoolArray | None = None
    observed: BoolArray | None = None
    gripper_force: FloatArray | None = None
    gripper_force_deviation: float | None = None

    def __post_init__(self) -> None:
        time = _array("time", self.time, (None,))
        if len(time) < LIMITS.min_frames:
            raise InvalidInput("time", f"{len(time)} frame(s)", f"at least {LIMITS.min_frames} frames")
        _check_time(time)
        position, without_displacement = check_position(self.position), self.displacement is None
        field_shape = (len(time), *position.shape)
        arrays = {
            "time": time,
            "position": position,
            "displacement": _displacement(self.displacement, self.force, field_shape),
            "force": _optional("force", self.force, field_shape),
            "normal": _optional("normal", self.normal, field_shape),
            "object_pose": _optional("object_pose", self.object_pose, (len(time), 3)),
            "gripper_force": _optional("gripper_force", self.gripper_force, (len(time),)),
        }
        for name in ("contact", "observed"):
            mask = getattr(self, name)
            _set(self, name, None if mask is None else check_mask(name, mask, field_shape[:3]))
        for name, array in arrays.items():
            _set(self, name, array)
        _set(self, "element_area", check_element_area(self.element_area))
        _set(self, "metadata", _metadata(self.metadata, {"displacement": NONE} if without_displacement else {}))
        _set(self, "truth", _truth(self.truth, field_shape[:3]))
        check_displacement(self.displacement, position)
        _check_magnitude("force", self.force, LIMITS.force, "N per element")
        _check_pose(self.object_pose)
        _check_normal(self.normal)
        _check_gripper_force(self.gripper_force)
        _set(
            self, "gripper_force_deviation", _gripper_force_deviation(self.gripper_force_deviation, self.gripper_force)
        )

    def __reduce__(self) -> tuple[Callable[..., "GraspLog"], tuple[dict[str, Any]]]:
        """Pickle by value, so that a log can go to a worker process (a read-only mapping can't be pickled)."""
        values = {entry.name: getattr(self, entry.name) for entry in fields(self)}
        return _rebuild, (values | {"metadata": dict(self.metadata)},)

    @property
    def grid(self) -> tuple[int, int]:
        """Number of markers along the two axes of the lattice."""
        return self.position.shape[0], self.position.shape[1]

    @property
    def is_scaled(self) -> bool:
        """Whether lengths are true metres; False where the metadata say that the scale is unknown, and one assumed."""
        return self.metadata.get("scale") != "unknown"

    @property
    def has_displacement(self) -> bool:
        """Whether displacement was measured; False where the metadata say that there are forces alone."""
        return self.metadata.get("displacement") != NONE

    @property
    def sees_along_surface(self) -> bool:
        """Whether x and y of displacement were measured; False where the metadata say "along the normal"."""
        return self.metadata.get("displacement") != ALONG_NORMAL

    @property
    def has_reconstructed_force(self) -> bool:
        """Whether the metadata say that forces follow from displacement, as those of ``Reconstruction.apply`` do."""
        return self.force is not None and self.metadata.get("force") == RECONSTRUCTED

    @property
    def force_deviation(self) -> float:
        """Typical standard deviation (N) of reconstructed element forces, by the metadata; 0 where they tell none."""
        return self._of_reconstruction("force_deviation") or 0.0

    @property
    def of_samples(self) -> dict[str, float]:
        """Options of friction samples by reconstructed forces, by the metadata; none where they tell none."""
        told = {name: self._of_reconstruction(name) for name in ("force_noise", "force_to_noise")}
        known = {name: value for name, value in told.items() if value is not None}
        return known if "force_noise" in known else {}

    def _of_reconstruction(self, name: str) -> float | None:
        """A number that the metadata of reconstructed forces tell; None where they tell none that could be one."""
        try:
            value = float(self.metadata.get(name, "nan")) if self.has_reconstructed_force else math.nan
        except ValueError:  # a file's own words
            return None
        low, high = describe_options(SampleOptions).get(name, (0.0, LIMITS.force))[:2]
        return value if low <= value <= high else None

    def __len__(self) -> int:
        return len(self.time)

    def take(self, frames: Frames) -> "GraspLog":
        """The log of some frames: a mask [t], ascending numbers or a slice; others count as never recorded.

        Raises ``InvalidInput`` where fewer are left than a log needs, or not in the order of time.
        """
        over_time = ("force", "normal", "object_pose", "contact", "observed", "gripper_force")
        known = {name: array[frames] for name in over_time if (array := getattr(self, name)) is not None}
        truth = None if self.truth is None else self.truth.take(frames)
        return replace(self, time=self.time[frames], displacement=self.displacement[frames], truth=truth, **known)

    def to_xarray(self) -> "Dataset":
        """The log as labelled arrays with units; raises ``ModuleNotFoundError`` where xarray is not installed."""
        from slipcore.labelled import dataset

        cells = ("time", "row", "column")
        variables: Variables = {
            "displacement": ((*cells, "axis"), self.displacement, "m"),
            "force": ((*cells, "axis"), self.force, "N"),
            "normal": ((*cells, "axis"), self.normal, "1"),
            "object_pose": (("time", "pose"), self.object_pose, "m, m, rad"),
            "gripper_force": (("time",), self.gripper_force, "N"),
            "contact": (cells, self.contact, "1"),
            "observed": (cells, self.observed, "1"),
            "position": (("row", "column", "axis"), self.position, "m"),
        }
        about = {"sensor": self.sensor, "element_area_m2": self.element_area}
        return dataset(variables, {"time": (("time",), self.time, "s")}, **about)

    def _repr_html_(self) -> str:
        from slipcore.notebook import summary

        rows = {
            "sensor": self.sensor,
            "frames": f"{len(self)} in {self.time[-1] - self.time[0]:.3g} s",
            "elements": f"{self.grid[0]} × {self.grid[1]} of {1e6 * self.element_area:.3g} mm²",
            "forces": "none" if self.force is None else "of each element",
            "gripper's force": "none" if self.gripper_force is None else f"up to {self.gripper_force.max():.3g} N",
            "truth": "none" if self.truth is None else "simulated",
        }
        return summary("Grasp log", rows.items())

    def frames(self) -> Iterator[Frame]:
        """Walk through the log as a detector would see it live."""
        for k, time in enumerate(self.time):
            yield Frame(
                float(time),
                self.displacement[k],
                None if self.force is None else self.force[k],
                None if self.object_pose is None else self.object_pose[k],
                None if self.normal is None else self.normal[k],
                None if self.contact is None else self.contact[k],
                None if self.observed is None else self.observed[k],
            )


def check_position(position: ArrayLike) -> FloatArray:
    """Rest positions [n, m, 3] in m, refused where they cannot be a tactile sensor's."""
    checked = _array("position", position, (None, None, 3))
    _check_magnitude("position", checked, LIMITS.position, "m")
    if checked[..., 0].size > 1:
        extent = _extent(checked)
        low, high = LIMITS.extent
        if not low <= extent <= high:
            raise InvalidInput("position", f"{extent:.3g} m across", f"{low:g} to {high:g} m across (is it in m?)")
        _check_neighbours_apart(checked)
    return checked


def check_element_area(area: ArrayLike) -> float:
    """Area of one micro-element in m², refused where absurd."""
    low, high = LIMITS.element_area
    value = float(_array("element_area", area, ()))
    if not low <= value <= high:
        raise InvalidInput("element_area", f"{value:.3g} m²", f"{low:g} to {high:g} m²")
    return value


def check_frame(name: str, value: ArrayLike, shape: tuple[int | None, ...], limit: float, unit: str) -> FloatArray:
    """One frame's field, with the checks that a whole log gets."""
    checked = _array(name, value, shape)
    _check_magnitude(name, checked, limit, unit)
    return checked


def check_pose(pose: ArrayLike) -> FloatArray:
    """One frame's object pose [3], x m, y m and yaw rad, with the checks that a whole log gets."""
    checked = _array("object_pose", pose, (3,))
    _check_pose(checked[None])
    return checked


def check_normal(normal: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    """One frame's outward unit normals, with the checks that a whole log gets."""
    checked = _array("normal", normal, shape)
    _check_normal(checked)
    return checked


def check_span(first: float, last: float) -> None:
    """Times of a log's first and last frame, s: that a clock could have given them."""
    if not abs(first) <= LIMITS.clock or not last - first <= LIMITS.span:
        allowed = f"at most {LIMITS.span:g} s in all, begun within {LIMITS.clock:g} s of 0 (is it in s?)"
        raise InvalidInput("time", f"{first:.6g} to {last:.6g} s", allowed)


def check_displacement(displacement: FloatArray, position: FloatArray) -> None:
    """Of markers at rest at ``position``, m: that they could have moved so far."""
    _check_magnitude("displacement", displacement, _largest_displacement(position), "m", " (is it in m?)")


def check_gripper_report(force: float | None, deviation: float | None, largest: float = 0.0) -> None:
    """What a gripper reports of one frame, N, with the checks that a whole log gets whose ``largest`` force so far was
    this.
    """
    report = None if force is None else np.append(_array("gripper_force", force, ()), largest)
    _check_gripper_force(report)
    _gripper_force_deviation(deviation, report)


def reported(gripper_force: FloatArray) -> FloatArray:
    """Normal forces N that a gripper reports, NaN where it does not grip."""
    return np.where(gripper_force >= LIMITS.gripper_deviation, gripper_force, np.nan)


def check_mask(name: str, value: ArrayLike, shape: tuple[int, ...]) -> BoolArray:
    """One truth value an element, of exactly this shape."""
    given = array_of(name, value, f"bool of shape {list(shape)}")
    mask = np.array(given, order="C")  # kernels are compiled for one layout: half a minute for another
    if mask.dtype != np.bool_ or mask.shape != shape:
        raise InvalidInput(name, f"{mask.dtype} of shape {list(mask.shape)}", f"bool of shape {list(shape)}")
    mask.flags.writeable = False
    return mask


def _rebuild(values: dict[str, Any]) -> GraspLog:
    return GraspLog(**values)


def _set(record: object, name: str, value: object) -> None:
    object.__setattr__(record, name, value)  # the record is frozen; this is its own constructor


def _array(name: str, value: ArrayLike, shape: tuple[int | None, ...]) -> FloatArray:
    given = real_array(name, value)
    array = np.array(given, dtype=np.float64, order="C", copy=None if _is_immutable(given) else True)
    wanted = "[" + ", ".join("any" if size is None else str(size) for size in shape) + "]"
    matches = array.ndim == len(shape) and all(
        size is None or size == got for size, got in zip(shape, array.shape, strict=True)
    )
    if not matches:
        raise InvalidInput(name, f"of shape {list(array.shape)}", f"shape {wanted}")
    if array.size == 0:
        raise InvalidInput(name, f"empty, of shape {list(array.shape)}", f"shape {wanted}, none of them 0")
    finite = np.isfinite(array)
    if not finite.all():
        index = tuple(int(i) for i in np.argwhere(~finite)[0])
        count = array.size - int(finite.sum())
        raise InvalidInput(name, f"{array[index]} at index {list(index)} ({count} in all)", "finite numbers")
    array.flags.writeable = False
    return array


def _is_immutable(array: NDArray[Any]) -> bool:
    """Whether nobody can ever change it: it is a view of bytes, as a file's reader makes it."""
    base: object = array
    while isinstance(base, np.ndarray):
        base = base.base
    return isinstance(base, bytes)


def _optional(name: str, value: ArrayLike | None, shape: tuple[int | None, ...]) -> FloatArray | None:
    return None if value is None else _array(name, value, shape)


def _displacement(value: ArrayLike | None, force: ArrayLike | None, shape: tuple[int, ...]) -> FloatArray:
    """The displacement, or zeros in the place of what a sensor of forces alone does not measure."""
    if value is None and force is None:
        raise InvalidInput("displacement", "missing, as forces are", "displacement, force or both")
    return _array("displacement", np.zeros(shape) if value is None else value, shape)


def _metadata(metadata: Mapping[str, str], more: Mapping[str, str]) -> Mapping[str, str]:
    if not isinstance(metadata, Mapping):
        raise InvalidInput("metadata", f"a {type(metadata).__name__}", "a mapping of strings")
    return MappingProxyType({str(key): str(value) for key, value in {**metadata, **more}.items()})


def _extent(position: FloatArray) -> float:
    return float(np.ptp(position[..., :2], axis=(0, 1)).max())


def _largest_displacement(position: FloatArray) -> float:
    """No marker moves further than the sensor is wide; this finds millimetres where the fixed limit would not."""
    return min(LIMITS.displacement, _extent(position) or LIMITS.displacement)  # a single marker has no extent


def _check_neighbours_apart(position: FloatArray) -> None:
    for axis in (0, 1):
        spacing = np.linalg.norm(np.diff(position, axis=axis), axis=-1)
        if spacing.size and spacing.min() == 0.0:
            first = [int(i) for i in np.unravel_index(int(spacing.argmin()), spacing.shape)]
            raise InvalidInput("position", f"the same at {first} and its next along axis {axis}", "markers apart")


def _check_time(time: FloatArray) -> None:
    step = np.diff(time)
    worst = int(np.argmin(step))
    if step[worst] <= 0.0:
        value = f"{time[worst + 1]:.9g} s at frame {worst + 1}, after {time[worst]:.9g} s"
        raise InvalidInput("time", value, "strictly increasing seconds")
    check_span(float(time[0]), float(time[-1]))
    low, high = LIMITS.median_interval
    median = float(np.median(step))
    if not low <= median <= high:
        raise InvalidInput("time", f"{median:.3g} s between frames", f"{low:g} to {high:g} s (is it in s?)")


def _check_magnitude(name: str, array: FloatArray | None, limit: float, unit: str, question: str = "") -> None:
    if array is None:
        return
    largest = max(float(array.max()), -float(array.min()))  # |array| would be another array
    if largest > limit:
        raise InvalidInput(name, f"{largest:.3g} {unit} at its largest", f"at most {limit:g} {unit}{question}")


def _check_pose(pose: FloatArray | None) -> None:
    if pose is not None:
        _check_magnitude("object_pose x, y", pose[:, :2], LIMITS.position, "m")
        _check_magnitude("object_pose yaw", pose[:, 2], LIMITS.yaw, "rad")


def _check_normal(normal: FloatArray | None) -> None:
    if normal is None:
        return
    square = np.einsum("...k,...k", normal, normal)
    shortest, longest = math.sqrt(square.min()), math.sqrt(square.max())
    worst = longest if longest - 1.0 > 1.0 - shortest else shortest
    if abs(worst - 1.0) > LIMITS.normal_length:
        raise InvalidInput("normal", f"of length {worst:.6g}", f"unit vectors, to {LIMITS.normal_length:g}")
    least = float(normal[..., 2].min())
    if not least > 0.0:
        raise InvalidInput("normal", f"z component {least:.3g}", "outward, z component above 0")


def _check_gripper_force(force: FloatArray | None) -> None:
    _check_magnitude("gripper_force", force, LIMITS.gripper_force, "N")
    if force is not None and force.min() < -max(float(force.max()), LIMITS.gripper_pull):
        value = f"{force.min():.3g} to {force.max():.3g} N"
        raise InvalidInput("gripper_force", value, "positive where the object presses (is its sign turned?)")


def _gripper_force_deviation(value: float | None, force: FloatArray | None) -> float | None:
    if value is None:
        return None
    if force is None:
        raise InvalidInput(
            "gripper_force_deviation", "given without gripper_force", "both, gripper_force alone or none"
        )
    deviation = float(_array("gripper_force_deviation", value, ()))
    least, most = LIMITS.gripper_deviation, LIMITS.gripper_force
    if not least <= deviation <= most:
        raise InvalidInput("gripper_force_deviation", f"{deviation:.3g} N", f"{least:g} to {most:g} N")
    return deviation


def _truth(truth: GroundTruth | None, shape: tuple[int, ...]) -> GroundTruth | None:
    if truth is None:
        return None
    return GroundTruth(
        contact=check_mask("truth.contact", truth.contact, shape),
        slip_kinematic=check_mask("truth.slip_kinematic", truth.slip_kinematic, shape),
        slip_contact_factor=check_mask("truth.slip_contact_factor", truth.slip_contact_factor, shape),
        stick_ratio=_stick_ratio(truth.stick_ratio, shape[0]),
        friction=truth.friction,
    )


def _stick_ratio(value: ArrayLike, frames: int) -> FloatArray:
    ratio = np.array(value, dtype=np.float64)
    if ratio.shape != (frames,):
        raise InvalidInput("truth.stick_ratio", f"of shape {list(ratio.shape)}", f"shape [{frames}]")
    outside = ratio[~np.isnan(ratio) & ~((ratio >= 0.0) & (ratio <= 1.0))]
    if outside.size:
        raise InvalidInput("truth.stick_ratio", outside[0], "0 to 1, NaN without contact")
    ratio.flags.writeable = False
    return ratio
