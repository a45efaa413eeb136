"""Pictures of what was detected and fitted; each function returns a matplotlib figure."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from estimators import FrictionModel
from slipcore import FrictionLaw, FrictionSamples, GraspLog, SlipHistory

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from numpy.typing import NDArray

STICK, SLIP, NO_CONTACT, TRUTH = "#2b6cb0", "#dd6b20", "#e8e8e8", "#2f855a"
SNAPSHOTS = 8
DENSE = 60
"""Points a side above which squares of less than a pixel would leave stripes, so that a map has no gaps."""
COEFFICIENTS = ("β₀ [-]", "β₁ [s/m]", "β₂ [1/N]", "σ [-]")


def save(figure: Figure, path: Path) -> Path:
    """Write a figure as PNG, making its folder if need be."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110, bbox_inches="tight")
    return path


def slip_over_time(log: GraspLog, history: SlipHistory, title: str) -> Figure:
    """Stick-slip maps at eight moments of contact, above the stick ratio over time (with the truth where known)."""
    figure = Figure(figsize=(11, 4.8), layout="constrained")
    figure.suptitle(title)
    grid = figure.add_gridspec(2, SNAPSHOTS, height_ratios=(1.0, 1.25))
    frames = _snapshots(history.contact)
    for column, frame in enumerate(frames):
        _draw_map(figure.add_subplot(grid[0, column]), log, history.contact, history.slip, frame)
    axes = figure.add_subplot(grid[1, :])
    _draw_stick_ratio(axes, log, history)
    for frame in frames:
        axes.axvline(history.time[frame] - history.time[0], color="0.75", linewidth=0.6, zorder=0)
    return figure


def truth_over_time(log: GraspLog, title: str) -> Figure:
    """A simulated grasp: true stick-slip maps at eight moments of contact, true stick ratio and forces over time."""
    if log.truth is None or log.force is None:
        raise ValueError("log is without truth or forces; allowed: a simulated one")
    figure = Figure(figsize=(11, 4.8), layout="constrained")
    figure.suptitle(title)
    grid = figure.add_gridspec(2, SNAPSHOTS, height_ratios=(1.0, 1.25))
    frames = _snapshots(log.truth.contact)
    for column, frame in enumerate(frames):
        _draw_map(figure.add_subplot(grid[0, column]), log, log.truth.contact, log.truth.slip_contact_factor, frame)
    axes, since = figure.add_subplot(grid[1, :]), log.time - log.time[0]
    lines = axes.plot(since, log.truth.stick_ratio, color=TRUTH, label="stick ratio")
    axes.set(xlabel="time [s]", ylabel="stick ratio [-]", ylim=(-0.03, 1.05), xlim=(0.0, since[-1]))
    lines += _draw_forces(axes.twinx(), since, log.force)
    for frame in frames:
        axes.axvline(since[frame], color="0.75", linewidth=0.6, zorder=0)
    _tidy(axes)
    _legend(axes, lines, [str(line.get_label()) for line in lines])
    return figure


def samples_and_model(
    samples: FrictionSamples, model: FrictionModel, title: str, truth: FrictionLaw | None = None
) -> Figure:
    """Friction samples against normal force and against velocity, with the fitted plane and its 90 % band."""
    figure = Figure(figsize=(10, 4), layout="constrained")
    figure.suptitle(title)
    left, right = figure.subplots(1, 2, sharey=True)
    shown = _thin(len(samples), 4000)
    force, velocity = samples.normal_force[shown], samples.tangential_velocity[shown]
    mu, middle = samples.friction_coefficient[shown], (np.median(velocity), np.median(force))
    left.scatter(force * 1e3, mu, s=4, alpha=0.35, color=STICK, linewidths=0)
    right.scatter(velocity * 1e3, mu, s=4, alpha=0.35, color=STICK, linewidths=0)
    over_force = np.linspace(*model.domain.normal_force, 60)
    over_velocity = np.linspace(*model.domain.tangential_velocity, 60)
    _draw_band(left, over_force * 1e3, model, np.full(60, middle[0]), over_force, truth)
    _draw_band(right, over_velocity * 1e3, model, over_velocity, np.full(60, middle[1]), truth)
    left.set(xlabel=f"normal force of the element [mN]   (line at v = {middle[0] * 1e3:.2g} mm/s)", ylabel="μ [-]")
    right.set(xlabel=f"tangential velocity [mm/s]   (line at fₙ = {middle[1] * 1e3:.2g} mN)")
    left.set_ylim(*_vertical_range(mu))
    _tidy(left)
    _tidy(right)
    left.legend(loc="best", fontsize=8)
    return figure


def posterior(model: FrictionModel, title: str, truth: FrictionLaw | None = None) -> Figure:
    """Marginal posterior of each coefficient and of σ, from the model's draws."""
    if model.draws is None:
        raise ValueError(f"draws is None for a {model.method} model; allowed: a model with posterior draws")
    figure = Figure(figsize=(11, 2.8), layout="constrained")
    figure.suptitle(title)
    known = None if truth is None else (*truth.coefficients, truth.scale)
    for k, (axes, name) in enumerate(zip(figure.subplots(1, 4), COEFFICIENTS, strict=True)):
        lowest, *bounds, highest = np.quantile(model.draws[:, k], (0.001, 0.025, 0.975, 0.999))
        axes.hist(model.draws[:, k], bins=50, range=(lowest, highest), color=STICK, alpha=0.75)
        for bound in bounds:
            axes.axvline(bound, color="0.3", linestyle=":", linewidth=1)
        if known is not None and (k < 3 or known[k] > 0.0):
            axes.axvline(known[k], color=TRUTH, linewidth=1.5, label="truth")
            axes.legend(fontsize=8)
        axes.set(xlabel=name, yticks=())
        axes.locator_params(axis="x", nbins=4)
        _tidy(axes)
    return figure


def _tidy(axes: Axes) -> None:
    axes.grid(visible=True, alpha=0.25)
    axes.spines[["top", "right"]].set_visible(False)


def _snapshots(contact: "NDArray[np.bool_]") -> "NDArray[np.intp]":
    touched = np.flatnonzero(contact.any(axis=(1, 2)))
    first, last = (touched[0], touched[-1]) if len(touched) else (0, len(contact) - 1)
    return np.unique(np.linspace(first, last, SNAPSHOTS).round().astype(np.intp))


def _draw_map(axes: Axes, log: GraspLog, contact: "NDArray[np.bool_]", slip: "NDArray[np.bool_]", frame: int) -> None:
    code = np.where(contact[frame], 1 + slip[frame], 0)
    colors, norm = ListedColormap([NO_CONTACT, STICK, SLIP]), BoundaryNorm([0, 1, 2, 3], 3)
    x, y = (log.position[..., k] * 1e3 for k in (0, 1))
    if max(log.grid) > DENSE:
        axes.pcolormesh(x, y, code, cmap=colors, norm=norm, shading="nearest")
    else:
        size = 12.0 * (20.0 / max(log.grid)) ** 2
        axes.scatter(x, y, c=code, s=size, marker="s", cmap=colors, norm=norm, linewidths=0)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title(f"{log.time[frame] - log.time[0]:.2f} s", fontsize=8)


def _draw_forces(axes: Axes, since: "NDArray[np.float64]", force: "NDArray[np.float64]") -> list[Line2D]:
    total = force.sum(axis=(1, 2))
    tangential = np.hypot(total[:, 0], total[:, 1])
    lines = axes.plot(since, -total[:, 2], color="0.35", label="normal force")
    lines += axes.plot(since, tangential, color="0.35", linestyle=":", label="tangential force")
    axes.set_ylabel("force [N]")
    axes.spines["top"].set_visible(False)
    return lines


def _draw_stick_ratio(axes: Axes, log: GraspLog, history: SlipHistory) -> None:
    since = history.time - history.time[0]
    axes.plot(since, history.stick_ratio, color=STICK, label=f"detected ({history.method})")
    if log.truth is not None:
        axes.plot(since, log.truth.stick_ratio, color=TRUTH, linestyle="--", label="truth")
    axes.set(xlabel="time [s]", ylabel="stick ratio [-]", ylim=(-0.03, 1.05), xlim=(0.0, since[-1]))
    _tidy(axes)
    _legend(axes, *axes.get_legend_handles_labels())


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
    model: FrictionModel,
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


def _vertical_range(mu: "NDArray[np.float64]") -> tuple[float, float]:
    low, high = np.quantile(mu, (0.005, 0.995))
    margin = 0.25 * (high - low) + 0.02 * abs(high)
    return float(low - margin), float(high + margin)
