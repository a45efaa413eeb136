"""Accuracy and cost of the closed forms of contact: `python -m benchmarks.contact.references [--output FOLDER]`.

Each closed form is compared with an independent evaluation (textbook form in 50 digits, matrix exponential, inverse
Laplace transform, resultants by quadrature) over easy and hard cases. Writes JSON and a picture, prints a Markdown
table.
"""

import argparse
import json
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import mpmath
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slipcore.contact.reference import CattaneoMindlin, HertzContact, half_space
from slipcore.contact.reference.beam_chain import BeamLattice, drag, follow, unloaded
from slipcore.contact.reference.bonded_layer import BondedLayer
from slipcore.contact.reference.cylinder import CylinderContact
from slipcore.contact.reference.flat_punch import FlatPunch
from slipcore.contact.reference.lee_radok import PronySeries
from slipcore.contact.reference.mindlin_deresiewicz import MindlinDeresiewicz, cycle_dissipation
from slipcore.contact.reference.torsion import TorsionPartialSlip, sliding_moment
from slipcore.contact.reference.wavy import WavyContact
from slipcore.frames import FloatArray

FRICTION, FORCE, RADIUS = 0.4, 10.0, 15e-3
CONTACT = HertzContact(RADIUS, FORCE, half_space(1e6, 0.3))
A = CONTACT.contact_radius
RATIOS = (1e-12, 1e-6, 0.05, 0.5, 0.95, 1.0 - 1e-9)
PLACES = {"draw_traction": "upper right", "draw_layer": "lower right", "draw_beams": "upper right"}
GEL = PronySeries(0.6e6, (0.5e6, 0.3e6, 0.2e6), (0.01, 0.3, 20.0))


@dataclass(frozen=True, slots=True)
class Measured:
    """Largest relative ``error`` of one quantity and its median cost (400 points, or one number)."""

    module: str
    quantity: str
    reference: str
    error: float
    microseconds: float


def cost(call: Callable[[], object], repeats: int = 15) -> float:
    """Median time of a call in µs."""
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        seconds.append(time.perf_counter() - start)
    return 1e6 * float(np.median(seconds))


def worst(found: FloatArray, expected: FloatArray) -> float:
    """Largest difference relative to the expected values."""
    return float(np.max(np.abs(np.asarray(found) / np.asarray(expected) - 1.0)))


def measurements() -> Iterator[Measured]:
    """Every closed form in turn."""
    for measure in (hertz, cattaneo_mindlin, mindlin_deresiewicz, torsion, others, layer, creep, beams):
        yield from measure()


def hertz() -> Iterator[Measured]:
    """Normal displacement outside the contact, from its edge to far away."""
    ratios = np.array([1.0 + 1e-9, 1.1, 3.0, 1e3, 1e6])
    with mpmath.workdps(60):
        exact = []
        for r in map(mpmath.mpf, ratios * A):
            t = mpmath.mpf(A) / r
            exact.append((2 * mpmath.mpf(A) ** 2 - r * r) * mpmath.asin(t) + r * A * mpmath.sqrt(1 - t * t))
        scale = CONTACT.pressure_slope / (2 * mpmath.mpf(CONTACT.compliance.contact_modulus))
        expected = np.array([float(scale * e) for e in exact])
    error = worst(CONTACT.normal_displacement(ratios * A), expected)
    points = np.linspace(0, 2 * A, 400)
    yield Measured(
        "hertz", "u_z, r/a 1 to 1e6", "textbook, 60 digits", error, cost(lambda: CONTACT.normal_displacement(points))
    )


def cattaneo_mindlin() -> Iterator[Measured]:
    """Rigid displacement, traction and slip from no load to sliding."""
    errors: dict[str, float] = {"d": 0.0, "q": 0.0, "s": 0.0}
    for ratio in RATIOS:
        case = CattaneoMindlin(CONTACT, FRICTION, ratio * FRICTION * FORCE)
        r = float(np.sqrt(max(A**2 - 0.5 * case.annulus, 0.0)))
        with mpmath.workdps(60):
            share = mpmath.mpf(case.tangential_force) / mpmath.mpf(FRICTION * FORCE)
            a, s, p = (
                mpmath.mpf(A),
                mpmath.mpf(case.contact.compliance.shear),
                mpmath.mpf(case.contact.compliance.poisson),
            )
            c, slope, at = a * mpmath.cbrt(1 - share), mpmath.mpf(FRICTION) * CONTACT.pressure_slope, mpmath.mpf(r)
            rigid = slope * mpmath.pi / 8 * (2 * s - p) * (a * a - c * c)
            half = mpmath.acos(c / at)
            slip = at**2 * (mpmath.sin(2 * half) - 2 * half * mpmath.cos(2 * half)) * (2 * s - p) / 16
            slip = -slope * (slip - p * at**2 * (4 * half - mpmath.sin(4 * half)) / 64)
            centre = slope * (a - c)
        errors["d"] = max(errors["d"], worst(case.rigid_displacement, float(rigid)))
        errors["q"] = max(errors["q"], worst(case.traction(0.0), float(centre)))
        if ratio > 1e-9:  # below, the annulus is thinner than the spacing of floating-point radii
            errors["s"] = max(errors["s"], worst(case.slip(r, 0.0)[0], float(slip)))
    x = np.linspace(-2 * A, 2 * A, 400)
    text, case = "textbook, 60 digits", CattaneoMindlin(CONTACT, FRICTION, 0.5 * FRICTION * FORCE)
    span = "F_T/μF_N 1e-12 to 1 − 1e-9"
    yield Measured(
        "cattaneo_mindlin", f"rigid displacement, {span}", text, errors["d"], cost(lambda: case.rigid_displacement)
    )
    yield Measured("cattaneo_mindlin", f"traction, {span}", text, errors["q"], cost(lambda: case.traction(np.abs(x))))
    yield Measured(
        "cattaneo_mindlin",
        "slip, F_T/μF_N 1e-6 to 1 − 1e-9",
        text,
        errors["s"],
        cost(lambda: case.slip(x, 0.3 * A)),
    )


def mindlin_deresiewicz() -> Iterator[Measured]:
    """Reversal loop: the doubled first branch, and its area."""
    fresh, peak = MindlinDeresiewicz(CONTACT, FRICTION), 0.8 * FRICTION * FORCE
    up = fresh.load(FORCE, peak)
    down = up.load(FORCE, -peak)
    forces = np.linspace(-0.99, 0.99, 31) * peak
    found = np.array([up.load(FORCE, float(f)).rigid_displacement for f in forces])
    first = np.array([CattaneoMindlin(CONTACT, FRICTION, (peak - f) / 2).rigid_displacement for f in forces])
    error = float(np.abs(found - (up.rigid_displacement - 2 * first)).max() / up.rigid_displacement)
    yield Measured(
        "mindlin_deresiewicz", "unloading branch", "doubled first branch", error, cost(lambda: up.load(FORCE, 0.0))
    )
    nodes, weights = np.polynomial.legendre.leggauss(400)
    gap = [up.load(FORCE, f).rigid_displacement - down.load(FORCE, f).rigid_displacement for f in peak * nodes]
    error = worst(cycle_dissipation(CONTACT, FRICTION, peak), float(np.dot(weights, gap)) * peak)
    yield Measured(
        "mindlin_deresiewicz",
        "energy of a cycle",
        "area of the loop, quadrature",
        error,
        cost(lambda: cycle_dissipation(CONTACT, FRICTION, peak)),
    )


def torsion() -> Iterator[Measured]:
    """Stick radius and twist from no moment to full slip."""
    limit, errors = sliding_moment(CONTACT, FRICTION), [0.0, 0.0]
    for ratio in (1e-12, 0.1, 0.6, 0.99, 1 - 1e-9):
        case = TorsionPartialSlip(CONTACT, FRICTION, ratio * limit)
        with mpmath.workdps(40):
            width = mpmath.mpf(case.annulus) if ratio < 0.5 else 1 - mpmath.mpf(case.stick_share)
            moment = mpmath.quad(lambda g: (1 - g) ** 2 * mpmath.ellipe(1 - (1 - g) ** 2), [0, width / 2, width])
            depth = -mpmath.log(1 - width)
            twist = mpmath.quad(lambda v: mpmath.ellipe(1 - mpmath.exp(-2 * v)), mpmath.linspace(0, depth, 6))
        errors[0] = max(errors[0], worst(case.moment / limit, float(moment * 64 / (3 * mpmath.pi**2))))
        scale = FRICTION * CONTACT.peak_pressure * CONTACT.compliance.shear / 2
        errors[1] = max(errors[1], worst(case.twist, scale * float(twist)))
    span = "M/M_max 1e-12 to 1 − 1e-9"
    solve = cost(lambda: TorsionPartialSlip(CONTACT, FRICTION, 0.7 * limit))
    yield Measured("torsion", f"moment of the stick radius, {span}", "quadrature, 40 digits", errors[0], solve)
    case = TorsionPartialSlip(CONTACT, FRICTION, 0.7 * limit)
    yield Measured("torsion", f"twist, {span}", "quadrature, 40 digits", errors[1], cost(lambda: case.twist))


def others() -> Iterator[Measured]:
    """Punch, cylinder and wave: forces carried, by quadrature."""
    nodes, weights = np.polynomial.legendre.leggauss(60)
    angle = 0.25 * np.pi * (nodes + 1)
    punch, r = FlatPunch(3e-3, 5.0, half_space(1e6, 0.4)), 3e-3 * np.sin(angle)
    force = (punch.pressure(r) * 2 * np.pi * r * 3e-3 * np.cos(angle) * weights).sum() * 0.25 * np.pi
    points = np.linspace(0, 6e-3, 400)
    yield Measured(
        "flat_punch",
        "force of the pressure",
        "quadrature",
        worst(force, 5.0),
        cost(lambda: punch.pressure(points)),
    )
    strip = CylinderContact(10e-3, 800.0, half_space(1e6, 0.5), 0.5, 200.0)
    x = strip.half_width * np.sin(0.5 * np.pi * nodes)
    load = (strip.pressure(x) * strip.half_width * np.cos(0.5 * np.pi * nodes) * weights).sum() * 0.5 * np.pi
    yield Measured(
        "cylinder", "load of the pressure", "quadrature", worst(load, 800.0), cost(lambda: strip.pressure(points))
    )
    wave = WavyContact(20e-6, 2e-3, 1.3e6, 15e3)
    x, step = wave.half_width * np.sin(0.5 * np.pi * nodes), 0.5 * np.pi * weights * np.cos(0.5 * np.pi * nodes)
    mean = (wave.pressure(x) * step).sum() * wave.half_width / wave.wavelength
    yield Measured("wavy", "mean of the pressure", "quadrature", worst(mean, 15e3), cost(lambda: wave.pressure(points)))


def layer() -> Iterator[Measured]:
    """Every mode of a bonded layer against a matrix exponential across it."""
    error = 0.0
    for nu in (0.0, 0.3, 0.49, 0.4999):
        for kh in (1e-4, 0.03, 0.5, 2.0, 9.0):
            modes, exact = BondedLayer(5e-3, 1e6, nu).modes(kh / 5e-3), navier(nu, kh)
            error = max(error, worst(modes.normal, exact[0]), worst(modes.longitudinal, exact[1]))
            error = max(error, abs(float(modes.coupling) - exact[2]) / exact[1])
    k = np.linspace(0, 1e4, 4096)
    gel = BondedLayer(5e-3, 1e6, 0.49)
    yield Measured(
        "bonded_layer",
        "normal, longitudinal, coupling; kh 1e-4 to 9, ν 0 to 0.4999",
        "matrix exponential, 80 digits",
        error,
        cost(lambda: gel.modes(k)),
    )


def navier(poisson_ratio: float, kh: float) -> tuple[float, float, float]:
    """Normal, longitudinal and coupling compliance in m/Pa of a layer of 5 mm and 1 MPa, from Navier's equations."""
    with mpmath.workdps(80):
        nu, h = mpmath.mpf(poisson_ratio), mpmath.mpf(5e-3)
        k, g, m = mpmath.mpf(kh) / h, mpmath.mpf(1e6) / (2 * (1 + nu)), 2 * (1 - nu) / (1 - 2 * nu)
        rows = [[0, 0, 1, 0], [0, 0, 0, 1], [m * k**2, 0, 0, -(m - 1) * k], [0, k**2 / m, (m - 1) * k / m, 0]]
        across, system = mpmath.expm(mpmath.matrix(rows) * h), mpmath.matrix(4, 4)
        for j in range(4):
            system[0, j], system[1, j] = across[0, j], across[1, j]
        system[2, 1], system[2, 2], system[3, 0], system[3, 3] = -g * k, -g, g * (m - 2) * k, -g * m
        pulled = mpmath.lu_solve(system, mpmath.matrix([0, 0, 1, 0]))
        pressed = mpmath.lu_solve(system, mpmath.matrix([0, 0, 0, 1]))
        return float(pressed[1]), float(pulled[0]), float(pulled[1])


def creep() -> Iterator[Measured]:
    """Creep compliance against a numerical inverse Laplace transform."""
    times = np.array([1e-6, 1e-3, 0.05, 2.0, 300.0])
    with mpmath.workdps(40):
        terms = [(mpmath.mpf(e), mpmath.mpf(t)) for e, t in zip(GEL.moduli, GEL.times, strict=True)]

        def transform(s: mpmath.mpf) -> mpmath.mpf:
            return 1 / (s * (GEL.equilibrium + sum(e * s / (s + 1 / tau) for e, tau in terms)))

        exact = [mpmath.invertlaplace(transform, mpmath.mpf(t), method="talbot", degree=40) for t in times]
    error = worst(GEL.creep(times), np.array([float(e) for e in exact]))
    many = np.linspace(0.0, 5.0, 400)
    yield Measured(
        "lee_radok",
        "creep of three Maxwell branches, 1 µs to 300 s",
        "inverse Laplace, 40 digits",
        error,
        cost(lambda: GEL.creep(many)),
    )


def beams() -> Iterator[Measured]:
    """Beams in partial slip: equilibrium as displacement, against the exact inverse of the stiffness."""
    lattice = BeamLattice((20, 20), 0.75e-3, 40.0, 300.0)
    limit = np.sqrt(np.maximum(1.0 - (lattice.position**2).sum(-1) / 5e-3**2, 0.0)) * 4.0 / 56.0
    pose = np.array([8e-4, 0.0, 0.0])
    state = drag(lattice, unloaded(lattice), pose, limit)
    held = np.where(limit[..., None] > 0.0, state.force, 0.0)
    error = float(np.abs(lattice.displacement(held) - state.displacement).max() / np.abs(state.displacement).max())
    yield Measured(
        "beam_chain",
        "displacement in partial slip, 20 × 20",
        "cosine transform of the contact's forces",
        error,
        cost(lambda: drag(lattice, unloaded(lattice), pose, limit)),
    )


def markdown(found: list[Measured]) -> str:
    """The table of docs/contact-references.md."""
    lines = ["| module | quantity | against | largest relative error | µs a call |", "|---|---|---|---|---|"]
    lines += [f"| `{m.module}` | {m.quantity} | {m.reference} | {m.error:.0e} | {m.microseconds:.0f} |" for m in found]
    return "\n".join(lines)


def picture() -> Figure:
    """Six panels, one a problem."""
    figure = Figure(figsize=(12, 7), layout="constrained")
    panels = figure.subplots(2, 3).ravel()
    for axes, draw in zip(
        panels, (draw_traction, draw_slip, draw_loop, draw_torsion, draw_layer, draw_beams), strict=True
    ):
        draw(axes)
        axes.title.set_fontsize(10)
        axes.legend(fontsize=7, frameon=False, loc=PLACES.get(draw.__name__, "upper left"))
    return figure


def draw_traction(axes: Axes) -> None:
    """Cattaneo–Mindlin traction on the way to sliding."""
    r = np.linspace(0.0, A, 600)
    for k, ratio in enumerate((0.1, 0.5, 0.9, 1.0)):
        case = CattaneoMindlin(CONTACT, FRICTION, ratio * FRICTION * FORCE)
        axes.plot(r / A, case.traction(r) / (FRICTION * CONTACT.peak_pressure), f"C{k}", label=f"F_T = {ratio:g} μF_N")
    axes.set(title="Cattaneo–Mindlin: traction", xlabel="r/a", ylabel="q/μp₀")


def draw_slip(axes: Axes) -> None:
    """Slip, and the gradient that the paper prints beside the right one."""
    case = CattaneoMindlin(HertzContact(RADIUS, FORCE, half_space(1e6, 0.0)), FRICTION, 0.7 * FRICTION * FORCE)
    a, c = case.contact.contact_radius, case.stick_radius
    r = np.linspace(0.0, a * (1 - 1e-9), 600)
    slip, gradient = np.abs(case.slip(r, 0.0)[:, 0]), case.slip_gradient(r)
    printed = np.where(r > c, (c / np.maximum(r, c)) ** 3 * (np.pi / 2 - np.arcsin(c / np.maximum(r, c))), 0.0)
    axes.plot(r / a, slip / slip.max(), "C0", label="slip |s|, of its maximum")
    axes.plot(r / a, gradient / gradient.max(), "C1", label="gradient |ds/dr|, of its maximum")
    axes.plot(r / a, printed / printed.max(), "C1:", label="gradient as printed (6): a false extremum")
    axes.axvline(c / a, color="0.7", linewidth=0.8)
    axes.set(title="Cattaneo–Mindlin: slip at F_T = 0.7 μF_N", xlabel="r/a (grey: stick radius)")


def draw_loop(axes: Axes) -> None:
    """Force against displacement through two reversals at several amplitudes."""
    for k, amplitude in enumerate((0.4, 0.7, 0.95)):
        path = amplitude * np.concatenate([np.linspace(0, 1, 40), np.linspace(1, -1, 80), np.linspace(-1, 1, 80)])
        state, distance = MindlinDeresiewicz(CONTACT, FRICTION), []
        for share in path:
            state = state.load(FORCE, float(share) * FRICTION * FORCE)
            distance.append(1e3 * state.rigid_displacement)
        lost = 1e6 * cycle_dissipation(CONTACT, FRICTION, amplitude * FRICTION * FORCE)
        axes.plot(distance, path, f"C{k}", label=f"{lost:.0f} µJ a cycle")
    axes.set(title="Mindlin–Deresiewicz: loops", xlabel="rigid displacement [mm]", ylabel="F_T/μF_N")


def draw_torsion(axes: Axes) -> None:
    """Torsional traction on the way to full slip."""
    r, limit = np.linspace(0.0, A, 600), sliding_moment(CONTACT, FRICTION)
    for k, ratio in enumerate((0.1, 0.5, 0.9, 0.999)):
        case = TorsionPartialSlip(CONTACT, FRICTION, ratio * limit)
        label = f"M = {ratio:g} M_max, twist {np.degrees(case.twist):.1f}°"
        axes.plot(r / A, case.traction(r) / (FRICTION * CONTACT.peak_pressure), f"C{k}", label=label)
    axes.set(title="Torsion with partial slip: traction", xlabel="r/a", ylabel="q/μp₀", ylim=(-0.05, 1.45))


def draw_layer(axes: Axes) -> None:
    """Modes of a bonded layer relative to the half-space."""
    kh = np.geomspace(1e-2, 1e2, 400)
    for nu, style in ((0.3, "-"), (0.5, "--")):
        modes, half = BondedLayer(1.0, 1.0, nu).modes(kh), half_space(1.0, nu)
        normal = (half.shear - half.poisson) / kh
        axes.loglog(kh, modes.normal / normal, f"C0{style}", label=f"normal, ν = {nu:g}")
        axes.loglog(kh, modes.longitudinal / normal, f"C1{style}", label=f"longitudinal, ν = {nu:g}")
    axes.loglog(kh, np.tanh(kh), "C2", label="transverse")
    axes.set(title="Bonded layer: compliance over half-space's", xlabel="kh", ylim=(1e-4, 3))


def draw_beams(axes: Axes) -> None:
    """Strain rate of springs of a chain while slip runs inward."""
    chain, steps = BeamLattice((41, 1), 0.5e-3, 40.0, 300.0), np.linspace(0.0, 3.2e-3, 161)
    shape = np.sqrt(np.maximum(1.0 - (chain.position**2).sum(-1) / 8.2e-3**2, 0.0))
    poses = np.stack([steps, 0 * steps, 0 * steps], axis=-1)
    history = follow(chain, poses, np.repeat((2.0 * shape / shape.sum())[None], len(steps), axis=0))
    rate = np.diff(np.diff(history.displacement[:, :, 0, 0], axis=1), axis=0) / (steps[1] * chain.pitch)
    for k, beam in enumerate((6, 10, 14, 18)):
        onset = steps[np.argmax(history.slip_contact_factor[:, beam, 0])]
        axes.plot(1e3 * steps[1:], 1e-3 * rate[:, beam], f"C{k}", label=f"beam {beam}, slips at {1e3 * onset:.2f} mm")
        axes.axvline(1e3 * onset, color=f"C{k}", linewidth=0.6, linestyle=":")
    axes.set(
        title="Beam chain: strain rate, dotted: onset of slip",
        xlabel="travel of the object [mm]",
        ylabel="dε/du [1/mm]",
        ylim=(-0.03, 0.9),
    )


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("benchmarks/results"))
    arguments = parser.parse_args()
    found = list(measurements())
    arguments.output.mkdir(parents=True, exist_ok=True)
    (arguments.output / "contact_references.json").write_text(json.dumps([asdict(m) for m in found], indent=1))
    picture().savefig(arguments.output / "contact_references.png", dpi=110)
    print(markdown(found))


if __name__ == "__main__":
    main()
