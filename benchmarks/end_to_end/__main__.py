"""Friction from raw grasps, accuracy against time: `python -m benchmarks.end_to_end [--page docs/accuracy.md]`.

Grasps of the reduced world (bristles on an elastic half-space) whose friction scatters between grasps and between
places are detected, sampled and fitted by each method. From one common setting, the number of grasps, frames a grasp,
elements of the sensor, noise of markers and of forces, and the slip detector are varied one at a time. Error and 95 %
interval of friction at a working point, and CPU seconds of detector, samples and fit, beside what the scatter between
grasps leaves at best. Writes end_to_end.json and end-to-end.png.
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"  # before numpy is first imported: CPU seconds of one thread
os.environ["OPENBLAS_NUM_THREADS"] = "1"

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, astuple, dataclass, replace
from functools import cache
from time import process_time

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter
from numpy.typing import NDArray
from scipy import stats

from benchmarks.detector.scenes import PITCH
from benchmarks.end_to_end.unknown_motion import (
    BETWEEN_GRASPS,
    BETWEEN_PLACES,
    LEVEL,
    SLOPE,
    VELOCITY_SLOPES,
    Law,
    grasp_log,
)
from benchmarks.pages import options, picture_folder, save, table, write
from estimators import EstimatorError, FrictionModel, fit
from estimators.method_names import METHODS
from slipcore import LOOKAHEAD, GraspLog, collect_samples, detect_slip
from slipcore.contact.effects import SensorSampling

FloatArray = NDArray[np.float64]

WIDTH, FRAME_RATE, FRAMES = 20 * PITCH, 60.0, 120
"""Side of the sensor, m; frames a second, and a grasp, of what is simulated."""
GRASPS = ((9.0, 1.0), (6.0, 2.0), (12.0, 0.5), (7.0, 3.0), (11.0, 1.5))
"""Normal force, N, and speed of the object, mm/s, of one grasp after the other, again and again."""
SPEED, FORCE = 1e-3, 0.08
"""Working point: m/s, and N on an element of the common sensor; the same pressure on others."""


@dataclass(frozen=True, slots=True)
class Setting:
    """What grasps are seen with: every ``thinning``-th frame, ``side`` elements each way, noise in m and N."""

    grasps: int = 5
    thinning: int = 2
    side: int = 20
    marker_noise: float = 1e-6
    force_noise: float = 2e-3
    detector: str = "filter"

    @property
    def area(self) -> float:
        """Of an element, over that of the common sensor."""
        return (WIDTH / self.side / PITCH) ** 2


def _varied(name: str, *values: object) -> tuple[Setting, ...]:
    return tuple(replace(Setting(), **{name: value}) for value in values)  # type: ignore[arg-type]


AXES = {
    "grasps": _varied("grasps", 1, 2, 3, 5, 10, 20),
    "frames a grasp": _varied("thinning", 10, 5, 3, 2, 1),
    "elements": _varied("side", 8, 12, 20, 28),
    "marker noise, µm": _varied("marker_noise", 0.0, 1e-6, 3e-6, 1e-5, 3e-5),
    "force noise, mN an element": _varied("force_noise", 0.0, 1e-3, 2e-3, 3.5e-3, 5e-3, 7e-3),
    "detector": _varied("detector", "filter", "strain_rate", "strain_rate_literal", "rigid_fit", "local_deformation"),
}
SETTINGS = tuple(dict.fromkeys(setting for settings in AXES.values() for setting in settings))


def value(axis: str, setting: Setting) -> float | str:
    """Where a setting is on an axis."""
    values: Mapping[str, float | str] = {
        "grasps": setting.grasps,
        "frames a grasp": FRAMES // setting.thinning,
        "elements": setting.side**2,
        "marker noise, µm": 1e6 * setting.marker_noise,
        "force noise, mN an element": 1e3 * setting.force_noise,
        "detector": setting.detector,
    }
    return values[axis]


def coefficients(seed: int, area: float = 1.0) -> FloatArray:
    """β₀ [-], β₁ [s/m] and β₂ [1/N] of a seed's material, of an element with ``area`` times the common one's."""
    return np.array([LEVEL, VELOCITY_SLOPES[seed % len(VELOCITY_SLOPES)], SLOPE / area])


def simulated(seed: int, number: int, side: int) -> GraspLog:
    """A seed's grasp of that number without noise, on a sensor of ``side`` elements each way."""
    rng = np.random.default_rng([seed, number])
    factor = 1.0 + BETWEEN_GRASPS * rng.standard_normal()
    sampling = SensorSampling((side, side), WIDTH / side, FRAME_RATE)
    law = Law(
        factor * coefficients(seed, Setting(side=side).area), BETWEEN_PLACES * rng.standard_normal(sampling.points)
    )
    force, speed = GRASPS[number % len(GRASPS)]
    return grasp_log(law, force, 1e-3 * speed, sampling=sampling)


def seen(log: GraspLog, setting: Setting, rng: np.random.Generator) -> GraspLog:
    """The frames of a grasp that a setting has, with its noise."""
    assert log.force is not None
    displacement = log.displacement + setting.marker_noise * rng.standard_normal(log.displacement.shape)
    force = log.force + setting.force_noise * rng.standard_normal(log.force.shape)
    return replace(log, displacement=displacement, force=force).take(slice(None, None, setting.thinning))


@dataclass(frozen=True, slots=True)
class Seconds:
    """CPU time of all grasps' detection and sampling, and of the fit."""

    detector: float
    samples: float
    fit: float

    @property
    def total(self) -> float:
        """All of it."""
        return self.detector + self.samples + self.fit


@dataclass(frozen=True, slots=True)
class Finding:
    """One fit: error and half-width of the 95 % interval of friction at the working point, NaN where it was refused."""

    setting: Setting
    method: str
    seed: int
    error: float
    half_width: float
    seconds: Seconds


def findings(seed: int, settings: Sequence[Setting] = SETTINGS) -> list[Finding]:
    """A seed's grasps, seen by every setting and fitted by every method."""
    simulate = cache(simulated)
    return [
        finding
        for setting in settings
        for finding in _of_setting(setting, seed, [simulate(seed, k, setting.side) for k in range(setting.grasps)])
    ]


def _of_setting(setting: Setting, seed: int, logs: Sequence[GraspLog]) -> Iterator[Finding]:
    noise = [np.random.default_rng([seed, number, 1]) for number in range(len(logs))]
    noisy = [seen(log, setting, rng) for log, rng in zip(logs, noise, strict=True)]
    start = process_time()
    histories = [detect_slip(log, setting.detector, lookahead=LOOKAHEAD) for log in noisy]
    detected = process_time()
    samples = [collect_samples(log, history) for log, history in zip(noisy, histories, strict=True)]
    collected = process_time()
    for method in METHODS:
        begin = process_time()
        try:
            error, half = error_and_half_width(fit(samples, method=method, seed=seed), setting, seed)
        except EstimatorError:
            error = half = np.nan
        taken = process_time() - begin
        yield Finding(setting, method, seed, error, half, Seconds(detected - start, collected - detected, taken))


def error_and_half_width(model: FrictionModel, setting: Setting, seed: int) -> tuple[float, float]:
    """Error and half-width of the 95 % interval of friction at the working point."""
    at = np.array([1.0, SPEED, FORCE * setting.area])
    half = stats.t.ppf(0.975, model.degrees_of_freedom) * np.sqrt(at @ model.covariance @ at)
    return float(at @ (model.coefficients - coefficients(seed, setting.area))), float(half)


def limit(grasps: int) -> float:
    """Standard error of friction at the working point for one who sees each grasp's own friction exactly."""
    friction = np.array([1.0, SPEED, FORCE]) @ np.transpose([coefficients(k) for k in range(len(VELOCITY_SLOPES))])
    return float(BETWEEN_GRASPS * np.sqrt(np.mean(friction**2) / grasps))


@dataclass(frozen=True, slots=True)
class Cell:
    """Of the fits of one setting by one method: root mean square error, median half-width, share that held the truth.

    ``seconds``: the median of each part; ``refused`` fits count nowhere else.
    """

    setting: Setting
    method: str
    fits: int
    refused: int
    error: float
    half_width: float
    covered: float
    seconds: Seconds


def cells(found: Sequence[Finding]) -> dict[tuple[Setting, str], Cell]:
    """Over the seeds."""
    groups: dict[tuple[Setting, str], list[Finding]] = {}
    for each in found:
        groups.setdefault((each.setting, each.method), []).append(each)
    return {key: _cell(*key, group) for key, group in groups.items()}


def _cell(setting: Setting, method: str, group: Sequence[Finding]) -> Cell:
    error, half = (np.array([getattr(each, name) for each in group]) for name in ("error", "half_width"))
    some = np.isfinite(error)
    refused = int(np.sum(~some))
    accuracy = (np.nan,) * 3
    if some.any():
        inside = np.mean(np.abs(error[some]) <= half[some])
        accuracy = float(np.sqrt(np.mean(error[some] ** 2))), float(np.median(half[some])), float(inside)
    seconds = np.median([astuple(each.seconds) for each in group], axis=0)
    return Cell(setting, method, len(group), refused, *accuracy, Seconds(*seconds.tolist()))


def accuracy_table(found: Mapping[tuple[Setting, str], Cell]) -> str:
    """Error ± half-width and coverage of each method, setting by setting."""
    columns = ("varied", "value", "limit", *METHODS)
    rows = [
        (axis, value(axis, setting), limit(setting.grasps), *(_shown(found[setting, method]) for method in METHODS))
        for axis, settings in AXES.items()
        for setting in settings
        if (setting, METHODS[0]) in found
    ]
    return table(columns, rows)


def _shown(cell: Cell) -> str:
    text = f"{cell.error:.4f} ± {cell.half_width:.3f}, {cell.covered:.0%}" if cell.refused < cell.fits else "refused"
    return f"{text} ({cell.refused} refused)" if 0 < cell.refused < cell.fits else text


def seconds_table(found: Mapping[tuple[Setting, str], Cell]) -> str:
    """CPU milliseconds of detector, samples and fits, where they depend on the setting."""
    columns = ("varied", "value", "detector, ms", "samples, ms", *(f"{method}, ms" for method in METHODS))
    rows = [
        (axis, value(axis, setting), *_milliseconds([found[setting, method] for method in METHODS]))
        for axis in ("grasps", "frames a grasp", "elements", "detector")
        for setting in AXES[axis]
        if (setting, METHODS[0]) in found
    ]
    return table(columns, rows)


def _milliseconds(row: Sequence[Cell]) -> list[float]:
    first = row[0].seconds
    return [1e3 * x for x in (first.detector, first.samples, *(cell.seconds.fit for cell in row))]


def draw(found: Mapping[tuple[Setting, str], Cell]) -> Figure:
    """Error (full lines) and half-width (dashed) over each axis, with the limit, and error against seconds."""
    figure = Figure(figsize=(12.0, 7.0), layout="constrained")
    panels = figure.subplots(2, 3).ravel()
    for axes, axis in zip(panels, [axis for axis in AXES if axis != "detector"], strict=False):
        _draw_axis(axes, axis, found)
    _draw_seconds(panels[-1], found)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=7, fontsize=8)
    return figure


def _draw_axis(axes: Axes, axis: str, found: Mapping[tuple[Setting, str], Cell]) -> None:
    settings = [setting for setting in AXES[axis] if (setting, METHODS[0]) in found]
    x = [float(value(axis, setting)) for setting in settings]
    for k, method in enumerate(METHODS):
        row = [found[setting, method] for setting in settings]
        axes.plot(x, [cell.error for cell in row], f"C{k}.-", label=method)
        axes.plot(x, [cell.half_width for cell in row], f"C{k}--", linewidth=0.8)
    best = np.array([limit(setting.grasps) for setting in settings])
    axes.plot(x, best, "k-", linewidth=2, alpha=0.4, label="limit of the scatter between grasps")
    axes.plot(x, stats.norm.ppf(0.975) * best, "k--", linewidth=2, alpha=0.4)
    axes.set(xlabel=axis, ylabel="error, half-width of 95 % [-]", yscale="log")
    axes.set_xscale("symlog" if "noise" in axis else "log", **({"linthresh": 1.0} if "noise" in axis else {}))
    axes.set_xticks(x, [f"{each:g}" for each in x], fontsize=8)
    axes.minorticks_off()
    axes.grid(alpha=0.3)


def _draw_seconds(axes: Axes, found: Mapping[tuple[Setting, str], Cell]) -> None:
    settings = [setting for setting in AXES["grasps"] if (setting, METHODS[0]) in found]
    for k, method in enumerate(METHODS):
        row = [found[setting, method] for setting in settings]
        axes.plot([cell.seconds.total for cell in row], [cell.error for cell in row], f"C{k}.-")
    axes.set(xlabel="CPU seconds in all, 1 to 20 grasps", ylabel="error [-]", xscale="log", yscale="log")
    ticks = [0.02, 0.05, 0.1, 0.2, 0.5]
    axes.set_xticks(ticks, [f"{each:g}" for each in ticks])
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.grid(alpha=0.3)


def main() -> None:
    """Measure, write JSON, a picture and the page's tables."""
    parser = options(__doc__)
    parser.add_argument("--seeds", type=int, default=28, help="of materials and their grasps; β₁ goes round every four")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    arguments = parser.parse_args()
    with ProcessPoolExecutor(arguments.workers) as pool:
        found = cells([each for part in pool.map(findings, range(arguments.seeds)) for each in part])
    save(draw(found), picture_folder(arguments) / "end-to-end.png")
    tables = {"end-to-end": accuracy_table(found), "end-to-end-seconds": seconds_table(found)}
    write([asdict(cell) for cell in found.values()], tables, arguments, "end_to_end.json")
    print("\n\n".join(tables.values()))


if __name__ == "__main__":
    main()
