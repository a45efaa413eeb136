"""What a log shows of its markers: displacements as rows of data, which of them were seen, and their noise."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slipcore.arguments import number
from slipcore.errors import InvalidInput, UnknownScale
from slipcore.forces.defaults import RECONSTRUCTION
from slipcore.frames import BoolArray, FloatArray, GraspLog
from slipcore.saturation import saturated

OUTWARD = np.array([1.0, 1.0, -1.0])
"""From the gel's frame, z into it, to the sensor's, and back."""


@dataclass(frozen=True, slots=True, eq=False)
class DisplacementData:
    """Displacements ``data`` [t, m] m along the ``axes`` that are seen, one after the other, z into the gel; which are
    ``seen`` [t, m]; the ``noise`` m of each; and which of the log's [t, n, m, 3] are ``saturated``, and so not seen.
    """

    data: FloatArray
    seen: BoolArray
    axes: tuple[int, ...]
    noise: float
    saturated: BoolArray

    @classmethod
    def of(cls, log: GraspLog, noise: float | None) -> "DisplacementData":
        """Of a log; ``noise`` None is estimated from it. Raises ``UnknownScale`` for one not in metres and
        ``InvalidInput`` for a noise that is none.
        """
        if not log.is_scaled:
            raise UnknownScale("forces follow from displacement in m, and the log's scale is unknown")
        axes = axes_seen(log.displacement) if log.sees_along_surface else (2,)
        if noise is None:
            noise = noise_of(log.time, log.displacement[..., slice(2) if log.sees_along_surface else slice(2, 3)])
        noise = checked_noise(noise)
        at_end = saturated(log.displacement, log.observed)
        return cls(*rows(log.displacement, seen_along(log.observed, at_end), axes), axes, noise, at_end)

    def touched(self) -> BoolArray:
        """Frames [t] in which markers moved by more than noise."""
        return moved(self.data, self.seen, self.noise)

    def strongest(self) -> int:
        """The frame in which something touches and markers moved most."""
        return int(np.argmax(np.where(self.touched(), np.sum(self.data**2, axis=1), 0.0)))


def axes_seen(displacement: FloatArray) -> tuple[int, ...]:
    """Along which displacements [..., 3] show something: markers whose z never changes are seen in the plane only."""
    return (0, 1, 2) if displacement[..., 2].any() else (0, 1)


def rows(displacement: FloatArray, seen: BoolArray, axes: tuple[int, ...]) -> tuple[FloatArray, BoolArray]:
    """Data [t, m] m of displacements [t, n, m, 3] along some axes, z into the gel, and which were ``seen``, alike."""
    return _by_axis(displacement * OUTWARD, axes), _by_axis(seen, axes)


def seen_along(observed: BoolArray | None, at_end: BoolArray) -> BoolArray:
    """Displacements [..., n, m, 3] of markers that were ``observed`` [..., n, m] and not ``at_end`` of their range."""
    return ~at_end if observed is None else observed[..., None] & ~at_end


def _by_axis(field: NDArray[Any], axes: tuple[int, ...]) -> NDArray[Any]:
    """Rows [t, m] of a field [t, n, m, 3], one axis after the other."""
    return np.moveaxis(field, -1, 1)[:, list(axes)].reshape(len(field), -1)


def moved(data: FloatArray, seen: BoolArray, noise: float) -> BoolArray:
    """Frames [...] of data [..., m] in which markers moved by more than noise."""
    count = np.maximum(seen.sum(axis=-1), 1)
    power = np.sum(np.where(seen, data, 0.0) ** 2, axis=-1) / count
    return np.asarray(power > noise**2 * (1.0 + least_power(count)))


def least_power(count: ArrayLike) -> FloatArray:
    """Mean square of the motion of so many coordinates, in squares of their noise, from which on it is no noise."""
    return np.asarray(RECONSTRUCTION.significant * np.sqrt(2.0 / np.asarray(count)))


def error(data: FloatArray, seen: BoolArray, noise: float) -> FloatArray:
    """Standard deviation [m] of one frame's data about what bilinear tractions can explain; infinite unseen."""
    largest = np.abs(data[seen]).max(initial=0.0)
    return np.where(seen, np.hypot(noise, RECONSTRUCTION.discretisation * largest), np.inf)


def checked_noise(noise: float) -> float:
    """Noise (m) of a marker's coordinate; raises ``InvalidInput`` for any other value."""
    allowed = "0 m or more, finite"
    value = number("noise", noise, allowed)
    if not 0.0 <= value < np.inf:
        raise InvalidInput("noise", noise, allowed)
    return value


def noise_of(time: FloatArray, displacement: FloatArray) -> float:
    """Noise (m) of a marker's coordinate, by displacements [t, n, m, a] m; 0 where none shows."""
    from slipcore.noise import estimate_noise  # compiled

    series = displacement.reshape(len(time), -1, displacement.shape[-1]).swapaxes(1, 2)
    return float(np.nan_to_num(estimate_noise(time, series)))
