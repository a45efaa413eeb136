"""What is known of a sensor's faults, and the correction of logs by it."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from slipcore.calibration.defaults import ESTIMATE
from slipcore.calibration.estimate import Estimate
from slipcore.calibration.zero import elapsed
from slipcore.defaults import DEFAULT_METHOD, NOISE
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray, GraspLog
from slipcore.surface.log_normals import normals_of

AXES = ("x", "y", "z")
_TOLD = {
    "displacement_floor": "noise of markers taken for {:.3g} µm, for it is correlated",
    "kernel_width": "moments of contacts reckoned with forces that are smoothed over {:.3g} µm",
}
"""What is said of options, with their values in micrometres."""


class Corrected(NamedTuple):
    """A log with its sensor's faults taken out as far as they are known, what was ``changed``, in words, and the
    ``options`` that give a detector the faults that stay in it.
    """

    log: GraspLog
    changed: tuple[str, ...]
    options: Mapping[str, float]


@dataclass(frozen=True, slots=True, eq=False)
class SensorModel:
    """The faults of a sensor, as ``calibrate_sensor`` finds them from ``presses`` logs.

    ``estimates``: ``force_offset_x`` … ``_z`` N (mean over the elements, at the beginning of a log),
    ``force_drift_x`` … ``_z`` N/s of an element, ``crosstalk_x``, ``_y`` (share of the normal force that appears as
    tangential force), ``inward_share``, ``kernel_width`` m, ``marker_noise`` m, ``marker_noise_correlation`` from
    frame to frame at ``frame_interval`` s, ``gain``. ``offset`` [n, m, 3] N: of each element, None where not
    identified. Raises ``InvalidInput`` for an offset of another shape than ``grid``.
    """

    sensor: str
    grid: tuple[int, int]
    element_area: float
    frame_interval: float
    presses: int
    estimates: tuple[Estimate, ...]
    offset: FloatArray | None = None

    def __post_init__(self) -> None:
        if self.offset is not None and self.offset.shape != (*self.grid, 3):
            raise InvalidInput("offset", f"of shape {list(self.offset.shape)}", f"shape {[*self.grid, 3]}")

    def __getitem__(self, name: str) -> Estimate:
        """One of the estimates; raises ``InvalidInput``."""
        for estimate in self.estimates:
            if estimate.name == name:
                return estimate
        raise InvalidInput("estimate", name, ", ".join(each.name for each in self.estimates))

    def apply(self, log: GraspLog, method: str = DEFAULT_METHOD) -> Corrected:
        """Forces of a log without what is identified and differs from 0: offset, drift, gain, crosstalk.

        What ``method`` of detection should know of the markers' noise, and of smoothing, is in the options. Raises
        ``InvalidInput`` for a log of another lattice.
        """
        if log.grid != self.grid:
            raise InvalidInput("grid", f"{log.grid[0]} × {log.grid[1]}", f"{self.grid[0]} × {self.grid[1]}, calibrated")
        changed = tuple(self._changes()) if log.force is not None else ()
        corrected = replace(log, force=self._force(log)) if changed else log
        options = self._noise_options() if method == "filter" and log.has_displacement else {}
        if log.force is not None:
            options |= self._kernel_options()
        noted = tuple(_TOLD[name].format(1e6 * value) for name, value in options.items())
        return Corrected(corrected, changed + noted, options)

    def _noise_options(self) -> dict[str, float]:
        """How noisy markers are, where a detector's own estimate from three frames would be too low."""
        noise, memory = self["marker_noise"], self["marker_noise_correlation"]
        lasting = memory.is_identified and memory.value >= NOISE.least_memory
        return {"displacement_floor": noise.value} if lasting and noise.is_significant else {}

    def _kernel_options(self) -> dict[str, float]:
        """How widely forces are smoothed, where that reaches beyond an element and its neighbours."""
        kernel = self["kernel_width"]
        wide = kernel.is_significant and kernel.value >= ESTIMATE.wide_kernel * math.sqrt(self.element_area)
        return {"kernel_width": kernel.value} if wide else {}

    def _force(self, log: GraspLog) -> FloatArray:
        assert log.force is not None
        force = log.force - self._offset_used() - elapsed(log)[:, None, None, None] * self._significant("force_drift")
        force = self._gain_used() * force
        normal, (x, y, _) = normals_of(log), self._significant("crosstalk")
        pressing = -np.vecdot(force, normal)[..., None]
        leak = np.array([x, y, 0.0])
        corrected: FloatArray = force - pressing * (leak - np.vecdot(normal, leak)[..., None] * normal)
        return corrected

    def _changes(self) -> Iterator[str]:
        if self.offset is not None:
            total = ", ".join(f"{axis:.3g}" for axis in self.offset.sum(axis=(0, 1)))
            yield f"zero of each element taken off, {total} N in all"
        drift = self._significant("force_drift") * math.prod(self.grid)
        if drift.any():
            yield f"drift of {', '.join(f'{axis:.3g}' for axis in drift)} N/s in all taken off"
        if self._gain_used() != 1.0:
            yield f"forces multiplied with {self._gain_used():.4g}"
        x, y, _ = self._significant("crosstalk")
        if x or y:
            yield f"crosstalk of {x:.3g}, {y:.3g} of the normal force taken off"

    def _offset_used(self) -> FloatArray:
        return np.zeros(3) if self.offset is None else self.offset

    def _gain_used(self) -> float:
        known = self["gain"]
        return known.value if known.is_identified and not known.low <= 1.0 <= known.high else 1.0

    def _significant(self, name: str) -> FloatArray:
        """A vector of estimates, [3], 0 where they are not identified or do not differ from 0."""
        found = {each.name: each.value for each in self.estimates if each.is_significant}
        return np.array([found.get(f"{name}_{axis}", 0.0) for axis in AXES])

    def to_json(self) -> dict[str, Any]:
        """As numbers, texts, lists and objects of JSON; what is not known is None."""
        known = [asdict(each) for each in self.estimates]
        plain = [{name: None if _is_nan(value) else value for name, value in each.items()} for each in known]
        offset = None if self.offset is None else self.offset.tolist()
        about = {name: getattr(self, name) for name in ("sensor", "element_area", "frame_interval", "presses")}
        return about | {"grid": list(self.grid), "estimates": plain, "offset": offset}

    @classmethod
    def from_json(cls, members: Mapping[str, Any]) -> "SensorModel":
        """As ``to_json`` made it; raises ``InvalidInput`` for anything else."""
        try:
            about = {name: members[name] for name in ("sensor", "element_area", "frame_interval", "presses")}
            (rows, columns), offset = members["grid"], members["offset"]
            estimates = tuple(_estimate(each) for each in members["estimates"])
            known = None if offset is None else np.array(offset, float)
            return cls(**about, grid=(rows, columns), estimates=estimates, offset=known)
        except (KeyError, TypeError, ValueError) as error:
            raise InvalidInput(
                "sensor model", repr(error), "what `stiction sensors calibrate --output` writes"
            ) from error


def _estimate(json: Mapping[str, Any]) -> Estimate:
    value, low, high = (math.nan if json[name] is None else float(json[name]) for name in ("value", "low", "high"))
    return Estimate(json["name"], json["unit"], value, low, high, json["not_identified"])


def _is_nan(value: object) -> bool:
    return isinstance(value, float) and math.isnan(value)
