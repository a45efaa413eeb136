"""What the figures share: scenes, strain rates, detection, tables and the looks of pictures."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure

from benchmarks.detector.scenes import simulated
from slipcore import GraspLog, SlipHistory, detect_slip
from slipcore.contact.effects import ForceNoise, MarkerNoise, SensorSampling
from slipcore.contact.plan.plan import Effect
from slipcore.contact.scene import Scene
from slipcore.detection.strain_rate.reference import signed_rate
from slipcore.frames import BoolArray, FloatArray
from slipcore.surface.strain import Lattice, displacement_gradient, frobenius, green_lagrange, lattice_steps

METHODS = ("filter", "strain_rate", "strain_rate_literal")
COLOURS = {"filter": "#2b6cb0", "strain_rate": "#dd6b20", "strain_rate_literal": "#805ad5", "truth": "#1a202c"}
NO_CONTACT, STICK, SLIP = "#e8e8e8", "#2b6cb0", "#dd6b20"
NOISE = (MarkerNoise(1e-6), ForceNoise(1e-3))


@dataclass(frozen=True, slots=True)
class Finding:
    """What a figure gave: pictures by name, a Markdown table, and the numbers behind them."""

    pictures: dict[str, Figure]
    table: str
    numbers: dict[str, Any]


def scene_log(
    name: str, *added: Effect, without: tuple[type[Effect], ...] = (), sampling: SensorSampling | None = None
) -> GraspLog:
    """The log of a scene of the library, with effects added or taken away, or seen by another sensor."""
    scene = Scene.from_toml(name)
    kinds = (*without, SensorSampling) if sampling is not None else without
    kept = tuple(effect for effect in scene.effects if not isinstance(effect, kinds))
    seen = () if sampling is None else (sampling,)
    return simulated(replace(scene, effects=(*kept, *added, *seen)))


def detected(log: GraspLog, method: str) -> SlipHistory:
    """What a method says, given displacement and element forces, but not the object's motion."""
    return detect_slip(replace(log, object_pose=None), method)


def strains(log: GraspLog) -> FloatArray:
    """Green–Lagrange strain [t, 3, n, m] (xx, yy, xy)."""
    lattice = Lattice.at_rest(log.position)
    return np.stack([green_lagrange(displacement_gradient(lattice, lattice_steps(u))) for u in log.displacement])


def strain_rates(log: GraspLog) -> tuple[FloatArray, FloatArray]:
    """C-strain rate ‖Ė‖ [t, n, m] in 1/s between frames (0 in the first), and the same with the sign of E:Ė."""
    strain = strains(log)
    size, signed = np.zeros((2, len(log), *log.grid))
    for k, interval in enumerate(np.diff(log.time), start=1):
        rate = (strain[k] - strain[k - 1]) / interval
        size[k], signed[k] = frobenius(rate), signed_rate(strain[k], rate)
    return size, signed


def true_slip(log: GraspLog) -> BoolArray:
    """Contact-factor truth at the points in contact [t, n, m]."""
    assert log.truth is not None
    return log.truth.slip_contact_factor & log.truth.contact


def total_force(log: GraspLog) -> FloatArray:
    """Force on the whole finger [t, 3] N."""
    assert log.force is not None
    return log.force.sum(axis=(1, 2))


def radius(log: GraspLog) -> FloatArray:
    """Distance of each point from the axis [n, m] m."""
    return np.hypot(log.position[..., 0], log.position[..., 1])


def f1_score(true: BoolArray, found: BoolArray) -> float:
    """F1 of two masks; NaN where neither has anything."""
    total = int(true.sum()) + int(found.sum())
    return 2.0 * int((true & found).sum()) / total if total else float("nan")


def stick_ratio_error(log: GraspLog, history: SlipHistory, frames: BoolArray | slice = slice(None)) -> float:
    """Root mean square error of the stick ratio over frames in contact."""
    assert log.truth is not None
    return float(np.sqrt(np.nanmean((history.stick_ratio - log.truth.stick_ratio)[frames] ** 2)))


def tidy(axes: Axes, **labels: Any) -> None:
    """Labels, a faint grid, no box."""
    axes.set(**labels)
    axes.grid(visible=True, alpha=0.25)
    axes.spines[["top", "right"]].set_visible(False)


def draw_stick_ratio(axes: Axes, log: GraspLog, histories: dict[str, SlipHistory], **labels: Any) -> None:
    """True and estimated stick ratio over time."""
    assert log.truth is not None
    axes.plot(log.time, log.truth.stick_ratio, color=COLOURS["truth"], lw=1.8, label="truth")
    for method, history in histories.items():
        axes.plot(log.time, history.stick_ratio, color=COLOURS.get(method), lw=1.0, label=method)
    tidy(axes, ylim=(-0.04, 1.06), **labels)


def draw_states(axes: Axes, log: GraspLog, contact: BoolArray, slip: BoolArray) -> None:
    """A map of stick, slip and no contact."""
    draw_field(axes, log, np.where(contact, 1 + slip, 0), ListedColormap([NO_CONTACT, STICK, SLIP]),
               BoundaryNorm([0, 1, 2, 3], 3))  # fmt: skip


def draw_field(axes: Axes, log: GraspLog, field: Any, cmap: Any, norm: Any) -> Any:
    """A map of a field [n, m], x to the right and y up, in mm."""
    x, y = log.position[:, 0, 0] * 1e3, log.position[0, :, 1] * 1e3
    image = axes.pcolormesh(x, y, np.asarray(field).T, cmap=cmap, norm=norm, shading="nearest", rasterized=True)
    axes.set_aspect("equal")
    axes.set(xticks=(), yticks=())
    return image
