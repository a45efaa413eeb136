"""Grasp logs: tactile frames over time, as they enter slipcore (stage 1: frames)."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slipcore.defaults import LIMITS
from slipcore.errors import InvalidInput

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


class Frame(NamedTuple):
    """One tactile frame: what a detector's ``step`` takes."""

    time: float
    displacement: FloatArray
    force: FloatArray | None
    object_pose: FloatArray | None


@dataclass(frozen=True, slots=True)
class FrictionLaw:
    """Stochastic linear friction ``μ = β₀ + β₁ v + β₂ f_n + ε`` (paper, eq. 40).

    ``coefficients``: (β₀ [-], β₁ [s/m], β₂ [1/N]); ``scale``: standard deviation of ε [-].
    """

    coefficients: tuple[float, float, float]
    scale: float = 0.0


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


@dataclass(frozen=True, slots=True, eq=False)
class GraspLog:
    """A recorded grasp in SI units and the sensor frame (z along the outward normal of the sensor's surface).

    Shapes and units: ``time`` [t] s, strictly increasing, gaps allowed; ``position`` [n, m, 3] m, markers at rest;
    ``displacement`` [t, n, m, 3] m; ``element_area`` m²; ``force`` [t, n, m, 3] N on each element by the object, or
    None; ``normal`` [t, n, m, 3], outward unit vectors, or None (then taken from the deformed shape); ``object_pose``
    [t, 3], x m, y m and yaw rad of the object relative to the sensor, or None.

    Arrays are held as read-only float64. Raises ``InvalidInput`` naming the field, its value and what is allowed.
    """

    time: FloatArray
    position: FloatArray
    displacement: FloatArray
    element_area: float
    force: FloatArray | None = None
    normal: FloatArray | None = None
    object_pose: FloatArray | None = None
    sensor: str = "unknown"
    metadata: Mapping[str, str] = field(default_factory=dict)
    truth: GroundTruth | None = None

    def __post_init__(self) -> None:
        time = _array("time", self.time, (None,))
        if len(time) < LIMITS.min_frames:
            raise InvalidInput("time", f"{len(time)} frame(s)", f"at least {LIMITS.min_frames} frames")
        _check_time(time)
        position = check_position(self.position)
        field_shape = (len(time), *position.shape)
        arrays = {
            "time": time,
            "position": position,
            "displacement": _array("displacement", self.displacement, field_shape),
            "force": _optional("force", self.force, field_shape),
            "normal": _optional("normal", self.normal, field_shape),
            "object_pose": _optional("object_pose", self.object_pose, (len(time), 3)),
        }
        for name, array in arrays.items():
            _set(self, name, array)
        _set(self, "element_area", check_element_area(self.element_area))
        _set(self, "metadata", MappingProxyType({str(k): str(v) for k, v in self.metadata.items()}))
        _check_magnitude("displacement", self.displacement, LIMITS.displacement, "m")
        _check_magnitude("force", self.force, LIMITS.force, "N per element")
        _check_pose(self.object_pose)
        _check_normal(self.normal)
        _check_truth(self.truth, field_shape[:3])

    @property
    def grid(self) -> tuple[int, int]:
        """Number of markers along the two axes of the lattice."""
        return self.position.shape[0], self.position.shape[1]

    def __len__(self) -> int:
        return len(self.time)

    def frames(self) -> Iterator[Frame]:
        """Walk through the log as a detector would see it live."""
        for k, time in enumerate(self.time):
            yield Frame(
                float(time),
                self.displacement[k],
                None if self.force is None else self.force[k],
                None if self.object_pose is None else self.object_pose[k],
            )


def check_position(position: ArrayLike) -> FloatArray:
    """Rest positions [n, m, 3] in m, refused where they cannot be a tactile sensor's."""
    checked = _array("position", position, (None, None, 3))
    _check_magnitude("position", checked, LIMITS.position, "m")
    if checked[..., 0].size > 1:
        extent = float(np.ptp(checked[..., :2], axis=(0, 1)).max())
        low, high = LIMITS.extent
        if not low <= extent <= high:
            raise InvalidInput("position", f"{extent:.3g} m across", f"{low:g} to {high:g} m across (is it in m?)")
    return checked


def check_element_area(area: float) -> float:
    """Area of one micro-element in m², refused where absurd."""
    low, high = LIMITS.element_area
    value = float(area)
    if not low <= value <= high:  # also refuses NaN
        raise InvalidInput("element_area", f"{value:.3g} m²", f"{low:g} to {high:g} m²")
    return value


def check_frame(name: str, value: ArrayLike, shape: tuple[int | None, ...], limit: float, unit: str) -> FloatArray:
    """One frame's field, with the checks that a whole log gets."""
    checked = _array(name, value, shape)
    _check_magnitude(name, checked, limit, unit)
    return checked


def _set(record: object, name: str, value: object) -> None:
    object.__setattr__(record, name, value)  # the record is frozen; this is its own constructor


def _array(name: str, value: ArrayLike, shape: tuple[int | None, ...]) -> FloatArray:
    try:
        array = np.array(value, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise InvalidInput(name, f"not numeric ({error})", "an array of real numbers") from error
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


def _optional(name: str, value: ArrayLike | None, shape: tuple[int | None, ...]) -> FloatArray | None:
    return None if value is None else _array(name, value, shape)


def _check_time(time: FloatArray) -> None:
    step = np.diff(time)
    worst = int(np.argmin(step))
    if step[worst] <= 0.0:
        value = f"{time[worst + 1]:.9g} s at frame {worst + 1}, after {time[worst]:.9g} s"
        raise InvalidInput("time", value, "strictly increasing seconds")
    low, high = LIMITS.median_interval
    median = float(np.median(step))
    if not low <= median <= high:
        raise InvalidInput("time", f"{median:.3g} s between frames", f"{low:g} to {high:g} s (is it in s?)")


def _check_magnitude(name: str, array: FloatArray | None, limit: float, unit: str) -> None:
    if array is None:
        return
    largest = float(np.abs(array).max())
    if largest > limit:
        raise InvalidInput(name, f"{largest:.3g} {unit} at its largest", f"at most {limit:g} {unit}")


def _check_pose(pose: FloatArray | None) -> None:
    if pose is not None:
        _check_magnitude("object_pose x, y", pose[:, :2], LIMITS.position, "m")
        _check_magnitude("object_pose yaw", pose[:, 2], LIMITS.yaw, "rad")


def _check_normal(normal: FloatArray | None) -> None:
    if normal is None:
        return
    length = np.linalg.norm(normal, axis=-1)
    worst = float(length.flat[int(np.argmax(np.abs(length - 1.0)))])
    if abs(worst - 1.0) > LIMITS.normal_length:
        raise InvalidInput("normal", f"of length {worst:.6g}", f"unit vectors, to {LIMITS.normal_length:g}")
    if not (normal[..., 2] > 0.0).all():
        raise InvalidInput("normal", f"z component {normal[..., 2].min():.3g}", "outward, z component above 0")


def _check_truth(truth: GroundTruth | None, shape: tuple[int, ...]) -> None:
    if truth is None:
        return
    expected = {
        "contact": shape,
        "slip_kinematic": shape,
        "slip_contact_factor": shape,
        "stick_ratio": shape[:1],
    }
    for name, wanted in expected.items():
        got = np.shape(getattr(truth, name))
        if got != wanted:
            raise InvalidInput(f"truth.{name}", f"of shape {list(got)}", f"shape {list(wanted)}")
