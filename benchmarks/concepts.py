"""Pictures of the concepts: `python -m benchmarks.concepts [--output FOLDER] [--page docs/concepts.md]`.

A sphere on a soft flat skin, pressed with 8 N and pulled ever harder: what sticks and slips (concept-slip.png), the
contact factor over the radius (concept-factor.png), and the stick ratio over the load, in closed form and as the
detector sees it through 1 µm of noise (concept-ratio.png). Then friction of an element that bears its load on a soft
round tip, whose real area of contact grows less than the load (concept-pressure.png).
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from benchmarks.pages import options, picture_folder, save
from service.report.colours import FAINT, SLIP, STICK, TRUTH
from slipcore import detect_slip
from slipcore.contact import tangential_ramp
from slipcore.contact.reference import CattaneoMindlin, HertzContact, half_space

FRICTION, NORMAL_FORCE = 0.45, 8.0
SKIN = half_space(young_modulus=1e6, poisson_ratio=0.5)
LOADS = (0.2, 0.5, 0.8, 0.95, 1.0)
"""Parts of the load under which all of the contact slides."""

TIP_RADIUS = 2e-3
"""m; of an element's soft tip, whose contact has a radius of 0.5 mm at 0.1 N."""

SHEAR_STRENGTH, PRESSURE_PART = 2.5e4, 0.15
"""Pa, -: what an area in real contact bears along the surface, without load and in proportion to its pressure."""

OBSERVED = (0.04, 0.12)
"""N: normal forces on an element that grasps show, over which the linear law is fitted."""


def loaded(ratio: float) -> CattaneoMindlin:
    """The contact under a part of the load under which it slides."""
    contact = HertzContact(15e-3, NORMAL_FORCE, SKIN)
    return CattaneoMindlin(contact, FRICTION, ratio * FRICTION * NORMAL_FORCE)


def incipient_slip() -> Figure:
    """Maps of what sticks and slips under growing loads."""
    figure = Figure(figsize=(10, 2.4), layout="constrained")
    for axes, ratio in zip(figure.subplots(1, len(LOADS)), LOADS, strict=True):
        state = loaded(ratio)
        for radius, colour in ((state.contact.contact_radius, SLIP), (state.stick_radius, STICK)):
            around = np.linspace(0.0, 2.0 * np.pi, 200)
            axes.fill(1e3 * radius * np.cos(around), 1e3 * radius * np.sin(around), color=colour, linewidth=0)
        axes.set_aspect("equal")
        axes.set_axis_off()
        axes.set_title(f"{ratio:.0%} of the sliding load\nstick ratio {state.stick_ratio:.2f}", fontsize=9)
    return figure


def contact_factor() -> Figure:
    """The share of its friction limit that each place bears, over the distance from the middle."""
    figure = Figure(figsize=(7, 3), layout="constrained")
    axes = figure.subplots()
    for ratio, strength in zip(LOADS[:-1], (0.35, 0.55, 0.75, 1.0), strict=True):
        state = loaded(ratio)
        r = np.linspace(0.0, 0.999 * state.contact.contact_radius, 300)
        label = f"{ratio:.0%} of the sliding load"
        axes.plot(1e3 * r, state.contact_factor(r), color=STICK, alpha=strength, label=label)
    axes.axhline(1.0, color=SLIP, linestyle="--", linewidth=1, label="slips")
    _finish(axes, "distance from the middle of the contact [mm]", "contact factor [-]")
    return figure


def stick_ratio() -> Figure:
    """What is left of the sticking area under growing loads: by the closed form, and as a detector sees it."""
    figure = Figure(figsize=(7, 3), layout="constrained")
    axes = figure.subplots()
    ratio = np.linspace(0.0, 1.0, 300)
    axes.plot(
        ratio, [loaded(each).stick_ratio for each in ratio], color=TRUTH, label=r"closed form, $(1 - load)^{2/3}$"
    )
    load, seen = observed_ratio()
    axes.plot(load, seen, ".", color=STICK, markersize=4, label="detected, marker noise 1 µm")
    _finish(axes, "load as part of the sliding load [-]", "stick ratio [-]")
    return figure


def observed_ratio() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Loads of a simulated grasp, as parts of the sliding load, and the stick ratio detected under each."""
    log = tangential_ramp(
        friction=FRICTION, normal_force=NORMAL_FORCE, marker_noise=1e-6, force_noise=5e-4, seed=1, tangential_force=0.98
    )
    assert log.force is not None
    total = log.force.sum(axis=(1, 2))
    pulled = np.hypot(total[:, 0], total[:, 1]) / (FRICTION * NORMAL_FORCE)
    pressed = -total[:, 2] > 0.99 * NORMAL_FORCE
    return pulled[pressed], detect_slip(log, lookahead=2).stick_ratio[pressed]


def friction_of_tip(normal_force: NDArray[np.float64]) -> NDArray[np.float64]:
    """Friction coefficient of an element that bears so many N on one soft round tip."""
    area = np.array([np.pi * HertzContact(TIP_RADIUS, force, SKIN).contact_radius ** 2 for force in normal_force])
    return np.asarray(PRESSURE_PART + SHEAR_STRENGTH * area / normal_force)


def linear_law() -> tuple[float, float]:
    """β₀ and β₂ in 1/N: the line that is nearest to the tip's friction over the forces observed."""
    force = np.linspace(*OBSERVED, 50)
    slope, intercept = np.polyfit(force, friction_of_tip(force), 1)
    return float(intercept), float(slope)


def falling_friction() -> Figure:
    """Friction coefficient and largest tangential force of an element over its normal force, with the linear law."""
    figure = Figure(figsize=(10, 3), layout="constrained")
    left, right = figure.subplots(1, 2)
    force, (intercept, slope) = np.linspace(5e-3, 0.3, 300), linear_law()
    friction, line = friction_of_tip(force), intercept + slope * force
    for axes, factor in ((left, np.ones_like(force)), (right, force)):
        axes.plot(force, factor * friction, color=TRUTH, label="soft round tip")
        axes.plot(force, factor * line, color=SLIP, linestyle="--", label="linear law")
        axes.axvspan(*OBSERVED, color=FAINT, alpha=0.12, linewidth=0, label="observed")
    left.set_title(f"β₀ = {intercept:.2f}, β₂ = {slope:.2g} 1/N", fontsize=9)
    _finish(left, "normal force on an element [N]", "friction coefficient μ [-]")
    _finish(right, "normal force on an element [N]", "largest tangential force [N]")
    return figure


def _finish(axes: Axes, x_label: str, y_label: str) -> None:
    axes.set(xlabel=x_label, ylabel=y_label, ylim=(0.0, None))
    axes.grid(visible=True, alpha=0.25)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))


PICTURES = {
    "slip": incipient_slip,
    "factor": contact_factor,
    "ratio": stick_ratio,
    "pressure": falling_friction,
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw all pictures."""
    folder = picture_folder(options(__doc__).parse_args(arguments))
    for name, draw in PICTURES.items():
        save(draw(), folder / f"concept-{name}.png")


if __name__ == "__main__":
    main()
