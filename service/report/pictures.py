"""Pictures of what was detected and fitted; each function returns a matplotlib figure."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from scipy import stats

from service.report.colours import FAINT, LINE, NO_CONTACT, SLIP, STICK, TRUTH
from service.whole_files import write_whole
from slipcore import FrictionLaw, FrictionSamples, GraspLog, SlipHistory
from stiction_client.linear_friction import LinearFriction

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from numpy.typing import NDArray

SNAPSHOTS = 8
DENSE = 60
"""Points a side above which squares of less than a pixel would leave stripes, so that a map has no gaps."""
MOST_SAMPLES = 4000
"""Shown in a picture; of more only every second, third … is."""

COEFFICIENTS = ("β₀ [-]", "β₁ [s/m]", "β₂ [1/N]", "σ [-]")


@dataclass(frozen=True, slots=True, eq=False)
class SlipOverTime:
    """What the pictures show of a grasp: ``time`` [t] s since its first frame, ``position`` [n, m, 2] m of elements,
    ``contact`` and ``slip`` [t, n, m] bool, and ``stick_ratio`` [t]; ``said_by``: the detector.
    """

    time: "NDArray[np.float64]"
    position: "NDArray[np.float64]"
    contact: "NDArray[np.bool_]"
    slip: "NDArray[np.bool_]"
    stick_ratio: "NDArray[np.float64]"
    said_by: str


def save(figure: Figure, path: Path) -> Path:
    """Write a figure as PNG or SVG, as its name says, making its folder if need be; as a whole or not at all."""
    return write_whole(path, lambda beside: figure.savefig(beside, dpi=110, bbox_inches="tight"))


def slip_over_time(log: GraspLog, history: SlipHistory, title: str) -> Figure:
    """Stick-slip maps at eight moments of contact, above the stick ratio over time (with the truth where known)."""
    return draw_slip(detected(log, history), title, None if log.truth is None else log.truth.stick_ratio)


def detected(log: GraspLog, history: SlipHistory) -> SlipOverTime:
    """What a detector saw in a log."""
    seen = history.contact, history.slip, history.stick_ratio
    return SlipOverTime(log.time - log.time[0], log.position[..., :2], *seen, history.method)


def draw_slip(seen: SlipOverTime, title: str = "", true_stick_ratio: "NDArray[np.float64] | None" = None) -> Figure:
    """Stick-slip maps at eight moments of contact, above the stick ratio over time."""
    figure, axes = _maps_above_axes(seen, title)
    axes.plot(seen.time, seen.stick_ratio, color=STICK, label=f"detected ({seen.said_by})")
    if true_stick_ratio is not None:
        axes.plot(seen.time, true_stick_ratio, color=TRUTH, linestyle="--", label="truth")
    axes.set(xlabel="time [s]", ylabel="stick ratio [-]", ylim=(-0.03, 1.05), xlim=(0.0, seen.time[-1]))
    _tidy(axes)
    _legend(axes, *axes.get_legend_handles_labels())
    return figure


def truth_over_time(log: GraspLog, title: str) -> Figure:
    """A simulated grasp: true stick-slip maps at eight moments of contact, true stick ratio and forces over time."""
    if log.truth is None or log.force is None:
        raise ValueError("log is without truth or forces; allowed: a simulated one")
    since, known = log.time - log.time[0], (log.truth.contact, log.truth.slip_contact_factor, log.truth.stick_ratio)
    figure, axes = _maps_above_axes(SlipOverTime(since, log.position[..., :2], *known, "truth"), title)
    lines = axes.plot(since, log.truth.stick_ratio, color=TRUTH, label="stick ratio")
    axes.set(xlabel="time [s]", ylabel="stick ratio [-]", ylim=(-0.03, 1.05), xlim=(0.0, since[-1]))
    lines += _draw_forces(axes.twinx(), since, log.force)
    _tidy(axes)
    _legend(axes, lines, [str(line.get_label()) for line in lines])
    return figure


def friction_sections(
    model: LinearFriction, samples: FrictionSamples | None = None, title: str = "", truth: FrictionLaw | None = None
) -> Figure:
    """Friction over normal force and over velocity with its 90 % band, and the ``samples`` it was fitted to.

    Each section runs through the middle of the samples, or of the data's range where these are not at hand.
    """
    figure = Figure(figsize=(10, 4), layout="constrained")
    figure.suptitle(title)
    left, right = figure.subplots(1, 2, sharey=True)
    velocity, force = _middle(model, samples)
    if samples is not None:
        _scatter(left, right, samples)
    over_force = np.linspace(*model.domain.normal_force, 60)
    over_velocity = np.linspace(*model.domain.tangential_velocity, 60)
    _draw_band(left, over_force * 1e3, model, np.full(60, velocity), over_force, truth)
    _draw_band(right, over_velocity * 1e3, model, over_velocity, np.full(60, force), truth)
    left.set(xlabel=f"normal force of the element [mN]   (line at v = {velocity * 1e3:.2g} mm/s)", ylabel="μ [-]")
    right.set(xlabel=f"tangential velocity [mm/s]   (line at fₙ = {force * 1e3:.2g} mN)")
    left.set_ylim(*_vertical_range(samples, left.dataLim.y0, left.dataLim.y1))
    _tidy(left)
    _tidy(right)
    left.legend(loc="best", fontsize=8, framealpha=0.0)
    return figure


def marginals(model: LinearFriction, title: str = "", truth: FrictionLaw | None = None) -> Figure:
    """How probable each value of each coefficient and of σ is by the model; dotted: its 95 % interval."""
    figure = Figure(figsize=(11, 2.8), layout="constrained")
    figure.suptitle(title)
    known = None if truth is None else (*truth.coefficients, truth.scale)
    shapes = [*_coefficient_densities(model), _scale_density(model)]
    bounds = [*model.interval(0.95), model.scale_interval(0.95)]
    for k, (axes, name) in enumerate(zip(figure.subplots(1, 4), COEFFICIENTS, strict=True)):
        axes.fill_between(*shapes[k], color=STICK, alpha=0.5, linewidth=0)
        for bound in bounds[k]:
            axes.axvline(bound, color=FAINT, linestyle=":", linewidth=1)
        if known is not None and (k < 3 or known[k] > 0.0):
            axes.axvline(known[k], color=TRUTH, linewidth=1.5, label="truth")
            axes.legend(fontsize=8, framealpha=0.0)
        axes.set(xlabel=name, yticks=(), ylim=(0.0, None))
        axes.locator_params(axis="x", nbins=4)
        _tidy(axes)
    return figure


def _coefficient_densities(model: LinearFriction) -> "list[tuple[NDArray[np.float64], NDArray[np.float64]]]":
    """Of each coefficient: values, and the density of its Student-t there."""
    half = stats.t.ppf(0.9995, model.degrees_of_freedom) * np.maximum(model.standard_errors, 1e-12)
    grids = [np.linspace(b - h, b + h, 200) for b, h in zip(model.coefficients, half, strict=True)]
    return [
        (grid, stats.t.pdf(grid, model.degrees_of_freedom, b, max(error, 1e-12)))
        for grid, b, error in zip(grids, model.coefficients, model.standard_errors, strict=True)
    ]


def _scale_density(model: LinearFriction) -> "tuple[NDArray[np.float64], NDArray[np.float64]]":
    """Values of σ, and their density: ν s²/σ² follows χ² on ν degrees of freedom; a σ that is known is a line."""
    low, high = model.scale_interval(0.999)
    grid = np.linspace(low, high, 200)
    if low == high:
        return np.array([low, high]), np.ones(2)
    freedom = model.scatter_degrees_of_freedom
    ratio = freedom * (model.scale / grid) ** 2
    return grid, np.asarray(stats.chi2.pdf(ratio, freedom) * 2.0 * ratio / grid)


def _middle(model: LinearFriction, samples: FrictionSamples | None) -> tuple[float, float]:
    """Velocity, m/s, and normal force, N, through which the sections run."""
    if samples is not None:
        return float(np.median(_known_velocity(samples))), float(np.median(samples.normal_force))
    return float(np.mean(model.domain.tangential_velocity)), float(np.mean(model.domain.normal_force))


def _scatter(over_force: Axes, over_velocity: Axes, samples: FrictionSamples) -> None:
    """The samples as a picture within the picture, for thousands of marks would make it large."""
    shown = _thin(len(samples), MOST_SAMPLES)
    mu = samples.friction_coefficient[shown]
    for axes, abscissa in ((over_force, samples.normal_force), (over_velocity, _known_velocity(samples))):
        axes.scatter(abscissa[shown] * 1e3, mu, s=5, alpha=0.5, color=STICK, linewidths=0, rasterized=True)


def _known_velocity(samples: FrictionSamples) -> "NDArray[np.float64]":
    """Velocity [k] m/s, 0 where the object's motion is unknown, as the fit takes it."""
    return np.where(samples.velocity_is_relative, 0.0, samples.tangential_velocity)


def _maps_above_axes(seen: SlipOverTime, title: str) -> tuple[Figure, Axes]:
    """A figure with maps of contact and slip at some moments, and the axes below them in which these are marked."""
    figure = Figure(figsize=(11, 4.8), layout="constrained")
    figure.suptitle(title)
    grid = figure.add_gridspec(2, SNAPSHOTS, height_ratios=(1.0, 1.25))
    axes = figure.add_subplot(grid[1, :])
    for column, frame in enumerate(_snapshots(seen.contact)):
        _draw_map(figure.add_subplot(grid[0, column]), seen, frame)
        axes.axvline(seen.time[frame], color=LINE, linewidth=0.6, zorder=0)
    return figure, axes


def _tidy(axes: Axes) -> None:
    axes.grid(visible=True, alpha=0.25)
    axes.spines[["top", "right"]].set_visible(False)


def _snapshots(contact: "NDArray[np.bool_]") -> "NDArray[np.intp]":
    touched = np.flatnonzero(contact.any(axis=(1, 2)))
    first, last = (touched[0], touched[-1]) if len(touched) else (0, len(contact) - 1)
    return np.unique(np.linspace(first, last, SNAPSHOTS).round().astype(np.intp))


def _draw_map(axes: Axes, seen: SlipOverTime, frame: int) -> None:
    code = np.where(seen.contact[frame], 1 + seen.slip[frame], 0)
    colors, norm = ListedColormap([NO_CONTACT, STICK, SLIP]), BoundaryNorm([0, 1, 2, 3], 3)
    (x, y), most = np.moveaxis(seen.position * 1e3, -1, 0), max(code.shape)
    if most > DENSE:
        axes.pcolormesh(x, y, code, cmap=colors, norm=norm, shading="nearest", rasterized=True)
    else:
        size = 12.0 * (20.0 / most) ** 2
        axes.scatter(x, y, c=code, s=size, marker="s", cmap=colors, norm=norm, linewidths=0, rasterized=True)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title(f"{seen.time[frame]:.2f} s", fontsize=8)


def _draw_forces(axes: Axes, since: "NDArray[np.float64]", force: "NDArray[np.float64]") -> list[Line2D]:
    total = force.sum(axis=(1, 2))
    tangential = np.hypot(total[:, 0], total[:, 1])
    lines = axes.plot(since, -total[:, 2], color=FAINT, label="normal force")
    lines += axes.plot(since, tangential, color=FAINT, linestyle=":", label="tangential force")
    axes.set_ylabel("force [N]")
    axes.spines["top"].set_visible(False)
    return lines


def _legend(axes: Axes, lines: "Sequence[Artist]", labels: Sequence[str]) -> None:
    """Legend of lines and of the maps' colours, below the axes."""
    patches = [Patch(color=c, label=n) for c, n in ((STICK, "stick"), (SLIP, "slip"), (NO_CONTACT, "no contact"))]
    axes.legend(
        [*lines, *patches],
        [*labels, "stick", "slip", "no contact"],
        loc="upper center",
        bbox_to_anchor=(0.5, -0.18),
        frameon=False,
        ncols=6,
        fontsize=8,
    )


def _draw_band(
    axes: Axes,
    abscissa: "NDArray[np.float64]",
    model: LinearFriction,
    velocity: "NDArray[np.float64]",
    force: "NDArray[np.float64]",
    truth: FrictionLaw | None,
) -> None:
    low, high = (model.predict(velocity, force, quantile) for quantile in (0.05, 0.95))
    axes.fill_between(abscissa, low, high, color=SLIP, alpha=0.2, linewidth=0, label="90 % of new observations")
    axes.plot(abscissa, model.predict(velocity, force), color=SLIP, label="fitted")
    if truth is not None:
        intercept, slope_v, slope_f = truth.coefficients
        axes.plot(
            abscissa, intercept + slope_v * velocity + slope_f * force, color=TRUTH, linestyle="--", label="truth"
        )


def _thin(count: int, most: int) -> "NDArray[np.intp]":
    return np.linspace(0, count - 1, min(count, most)).astype(np.intp)


def _vertical_range(samples: FrictionSamples | None, lowest: float, highest: float) -> tuple[float, float]:
    """Of the axis of μ, which is not below 0: where nearly all samples are, or what else is drawn without these."""
    if samples is None:
        return max(lowest - 0.1 * (highest - lowest), 0.0), highest + 0.1 * (highest - lowest)
    low, high = np.quantile(samples.friction_coefficient, (0.005, 0.995))
    margin = 0.25 * (high - low) + 0.02 * abs(high)
    return max(float(low - margin), 0.0), float(high + margin)
