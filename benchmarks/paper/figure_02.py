"""Fig. 2: slip and its gradient over the radius, as printed and corrected, and the wave that runs inwards."""

import numpy as np
from matplotlib.figure import Figure

from benchmarks.pages import table
from benchmarks.paper.common import Finding, tidy
from slipcore.contact.reference import CattaneoMindlin, HertzContact, half_space
from slipcore.frames import FloatArray

RADIUS = 3e-3
"""m, the paper's r_a = 3."""
FRONT_STEP = 0.05e-3
STICK_RADII = (1.5e-3, 1.25e-3, 1.0e-3, 0.75e-3, 0.5e-3)
FRICTION, YOUNG = 0.4, 1e6


def contact(stick_radius: float) -> CattaneoMindlin:
    """A contact of the given radii at ν = 0, where the closed form is exact."""
    compliance = half_space(YOUNG, 0.0)
    force = 4.0 * compliance.contact_modulus * RADIUS**3 / (3.0 * 15e-3)
    hertz = HertzContact(15e-3, force, compliance)
    return CattaneoMindlin(hertz, FRICTION, FRICTION * force * (1.0 - (stick_radius / RADIUS) ** 3))


def scale() -> float:
    """H₁ of (5), m."""
    force = contact(1e-3).contact.normal_force
    return 3.0 * 2.0 * FRICTION * force / (16.0 * (0.5 * YOUNG) * RADIUS)


def printed_slip(r: FloatArray, stick_radius: float) -> FloatArray:
    """(4) as printed but for the branches and the exponent of (10): H₁ φ₁(r/r_c)."""
    share = np.minimum(stick_radius / r, 1.0)
    angle = 2.0 / np.pi * np.arcsin(share)
    return scale() * ((1.0 - angle) * (1.0 - 2.0 * share**2) + 2.0 / np.pi * share * np.sqrt(1.0 - share**2))


def printed_gradient(r: FloatArray, stick_radius: float) -> FloatArray:
    """(6) as printed but for the branches: H₂ φ₂(r/r_c)."""
    share = np.minimum(stick_radius / r, 1.0)
    return 2.0 * scale() / (np.pi * stick_radius) * 4.0 * share**3 * (np.pi / 2.0 - np.arcsin(share))


def find() -> Finding:
    """Compare the printed forms with the corrected ones, and these with a finite difference of the slip."""
    r = np.linspace(1e-5, RADIUS * (1.0 - 1e-9), 1500)
    rows = [_row(r, c) for c in STICK_RADII]
    columns = ("r_c, mm", "printed: gradient largest at r/r_c", "corrected: at r/r_c (r_a/r_c)",
               "printed slip at the edge / right", "gradient against finite difference")  # fmt: skip
    cells = [
        (f"{1e3 * row['stick_radius']:.2f}", row["printed_peak"], f"{row['peak']:.2f} ({row['edge']:.2f})",
         row["printed_over_right"], f"{row['gradient_error']:.0e}") for row in rows
    ]  # fmt: skip
    return Finding({"02": _draw(r)}, table(columns, cells), {"rows": rows})


def _slip(r: FloatArray, stick_radius: float) -> FloatArray:
    return np.abs(contact(stick_radius).slip(r, np.zeros_like(r))[..., 0])


def _row(r: FloatArray, c: float) -> dict[str, float]:
    gradient, printed = contact(c).slip_gradient(r), printed_gradient(r, c)
    inner = np.linspace(1.05 * c, 0.99 * RADIUS, 400)
    step = 1e-8
    difference = (_slip(inner + step, c) - _slip(inner - step, c)) / (2.0 * step)
    return {
        "stick_radius": c,
        "printed_peak": float(r[np.argmax(printed)] / c),
        "peak": float(r[np.nanargmax(gradient)] / c),
        "edge": RADIUS / c,
        "printed_over_right": float(printed_slip(r[-1:], c)[0] / _slip(r[-1:], c)[0]),
        "gradient_error": float(np.abs(contact(c).slip_gradient(inner) / difference - 1.0).max()),
    }


def _draw(r: FloatArray) -> Figure:
    figure = Figure(figsize=(11, 3.6), layout="constrained")
    slip, gradient, rate = figure.subplots(1, 3)
    for k, c in enumerate(STICK_RADII):
        colour, label = f"C{k}", f"r_c = {1e3 * c:.2f} mm"
        slip.plot(1e3 * r, 1e6 * _slip(r, c), color=colour)
        slip.plot(1e3 * r, 1e6 * printed_slip(r, c), color=colour, ls=":", lw=1)
        gradient.plot(1e3 * r, 1e2 * contact(c).slip_gradient(r), color=colour, label=label)
        gradient.plot(1e3 * r, 1e2 * printed_gradient(r, c), color=colour, ls=":", lw=1)
        grown = contact(c - FRONT_STEP).slip_gradient(r) - contact(c).slip_gradient(r)
        rate.plot(1e3 * r, 1e2 * grown, color=colour)
        rate.axvline(1e3 * c, color=colour, lw=0.6, ls="--")
    tidy(slip, xlabel="distance from the axis [mm]", ylabel="slip [µm]", title="slip")
    tidy(gradient, xlabel="distance from the axis [mm]", ylabel="|ds/dr| [%]", title="gradient of slip")
    tidy(rate, xlabel="distance from the axis [mm]", ylabel="growth of |ds/dr| [%]",
         title="growth as the front moves 0.05 mm")  # fmt: skip
    gradient.plot([], [], color="0.4", ls=":", lw=1, label="as printed")
    figure.legend(*gradient.get_legend_handles_labels(), fontsize=8, loc="outside lower center", ncols=6)
    return figure
