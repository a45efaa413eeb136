"""The friction samples of a material beside its model, in one compact file (``service.packed_arrays``).

Of each sample ``velocity`` m/s, ``force`` N, ``friction``, its ``residual`` from the model, whether it is ``outside``
of the band of 90 % of new observations, and ``seconds`` since the first sample of its log. On a lattice of
``lattice_velocity`` and ``lattice_force`` the model: ``mean``, ``low`` and ``high``. By place ``place_residual``, the
mean residual of each element of the sensor, NaN without samples. The header gives ``rows`` and ``columns`` of that
sensor, how many ``logs`` these are of, how many samples they have (``of``), which ``share`` of them is outside, and in
how many logs the velocity is unknown (``at_rest``).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from db.records import NewModel
from service.domain.models.stored_results import decode_samples, to_friction_model
from service.packed_arrays import pack_arrays
from service.report.wording import LEVELS, expected_friction
from slipcore.samples import FrictionSamples

FloatArray = NDArray[np.float64]

MOST_SAMPLES = 6000
"""In the file, evenly thinned out; means are of all."""

LATTICE = 9
"""Lines of the model's plane in each direction."""


@dataclass(frozen=True, slots=True)
class SampleFile:
    """Where the samples of a log are, and the lattice of its sensor."""

    path: Path
    grid: tuple[int, int]


def write_samples(model: NewModel, files: Sequence[SampleFile], target: Path) -> None:
    """Write the file of these logs' samples, newest first; by place those of logs with the newest one's lattice."""
    target.write_bytes(pack(model, [(decode_samples(file.path), file.grid) for file in files]))


def pack(model: NewModel, logs: Sequence[tuple[FrictionSamples, tuple[int, int]]]) -> bytes:
    """The content of the file, of at least one log."""
    from estimators.linear.observations import known_velocity, velocity_unknown  # numerics, which no server loads

    fitted, grid = to_friction_model(model), logs[0][1]
    alike = [samples.at_element_area(model.element_area) for samples, _ in logs]
    velocity = np.concatenate([known_velocity(samples) for samples in alike])
    whole = FrictionSamples.concatenate(alike)
    residual = whole.friction_coefficient - fitted.predict(velocity, whole.normal_force)
    low, high = (fitted.predict(velocity, whole.normal_force, quantile=level) for level in LEVELS)
    outside = (whole.friction_coefficient < low) | (whole.friction_coefficient > high)
    seconds = np.concatenate([samples.time - samples.time.min(initial=np.inf) for samples in alike])
    on_grid = np.repeat([shape == grid for _, shape in logs], [len(samples) for samples in alike])
    shown = slice(None, None, max(1, -(-len(whole) // MOST_SAMPLES)))
    arrays = {
        "velocity": velocity[shown],
        "force": whole.normal_force[shown],
        "friction": whole.friction_coefficient[shown],
        "residual": residual[shown],
        "seconds": seconds[shown],
        **_surface(model, velocity, whole.normal_force),
        "place_residual": _by_place(whole.take(on_grid), residual[on_grid], grid),
    }
    packed = {name: np.ascontiguousarray(values, "<f4") for name, values in arrays.items()}
    header = {"rows": grid[0], "columns": grid[1], "logs": len(logs), "of": len(whole), "share": float(outside.mean())}
    header["at_rest"] = sum(velocity_unknown(samples) for samples in alike)
    return pack_arrays(header, packed | {"outside": outside[shown].astype(np.uint8)})


def _surface(model: NewModel, velocity: FloatArray, force: FloatArray) -> dict[str, FloatArray]:
    """The model and its band on a lattice [v, f_n] from 0 to the largest of the samples."""
    fitted = to_friction_model(model)
    v, f_n = (np.linspace(0.0, float(values.max()), LATTICE) for values in (velocity, force))
    low, high = (fitted.predict(v[:, None], f_n, level).ravel() for level in LEVELS)
    mean = expected_friction(fitted, v[:, None], f_n).ravel()
    return {"lattice_velocity": v, "lattice_force": f_n, "mean": mean, "low": low, "high": high}


def _by_place(samples: FrictionSamples, residual: FloatArray, grid: tuple[int, int]) -> FloatArray:
    """Mean residual of each element of a lattice, row by row; samples of whole contacts have no place on it."""
    cells = grid[0] * grid[1]
    on = samples.element < cells
    count = np.bincount(samples.element[on], minlength=cells)
    total = np.bincount(samples.element[on], residual[on], cells)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
