"""Fig. 3: strain rate of one virtual beam over time in three cases, solved exactly."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.pages import table
from benchmarks.paper.common import (
    COLOURS,
    Finding,
    scene_log,
    strain_rates,
    tidy,
    total_force,
    true_slip,
)
from slipcore import GraspLog
from slipcore.contact.effects import ElasticObject, NormalTangentialCoupling
from slipcore.contact.reference.beam_chain import BeamHistory, BeamLattice, follow
from slipcore.frames import BoolArray, FloatArray

BEAMS, PITCH, STEPS = 41, 0.25e-3, 120
BEAM = 8
"""The beam that is looked at: 20 % of the contact in from its edge."""
DURATION = 2.0
POINT = (5, 10)
"""The point of the half-spaces that is looked at, 3.4 mm from the axis."""


def chain() -> BeamLattice:
    """A chain whose neighbours pull about as much as its beams bend."""
    return BeamLattice((BEAMS, 1), PITCH, bending=60.0, coupling=400.0)


def motion(case: int) -> tuple[FloatArray, FloatArray]:
    """Travel of the object, m, and factor on the normal force, over time [t]."""
    time = np.linspace(0.0, 1.0, STEPS)
    if case == 1:
        return 1.3e-3 * time, np.ones(STEPS)
    if case == 2:
        return 0.8e-3 * np.minimum(2.0 * time, 1.0), 1.0 + np.maximum(2.0 * time - 1.0, 0.0)
    return 0.8e-3 * np.where(time < 0.4, time / 0.4, 1.0 - (time - 0.4) / 0.4), np.ones(STEPS)


def run(case: int) -> tuple[BeamHistory, FloatArray]:
    """The chain through a case, and the strain rate [t, n] in 1/s, signed by the growth of the strain."""
    lattice = chain()
    x = lattice.position[:, 0, 0]
    limit = 0.02 * np.sqrt(np.maximum(1.0 - (x / (0.5 * BEAMS * PITCH)) ** 2, 0.0))
    travel, press = motion(case)
    poses = np.stack([travel, np.zeros(STEPS), np.zeros(STEPS)], axis=1)
    history = follow(lattice, poses, press[:, None, None] * limit[:, None])
    strain = np.gradient(history.displacement[..., 0, 0], PITCH, axis=1)
    rate = np.diff(strain, axis=0, prepend=strain[:1]) * (STEPS - 1) / DURATION
    return history, rate * np.sign(strain)


def find() -> Finding:
    """When the beam's extremes come, when it truly begins and ends to slip, and what pressing alone does."""
    time = np.linspace(0.0, DURATION, STEPS)
    figure = Figure(figsize=(11, 5.4), layout="constrained")
    upper, lower = figure.subplots(2, 3)
    rows = []
    for case, axes in enumerate(upper, start=1):
        history, rate = run(case)
        slips, pressing = history.slip_kinematic[:, BEAM, 0], time > (1.02 if case == 2 else DURATION)
        rows.append(_row(f"beams, case {case}", time, rate[:, BEAM], slips, pressing))
        _draw(axes, time, rate[:, BEAM], slips, f"beams, case {case}")
    for axes, (name, log) in zip(lower, _half_spaces(), strict=True):
        rate, slips = strain_rates(log)[1][:, *POINT], true_slip(log)[:, *POINT]
        normal = -total_force(log)[:, 2]
        pressing = (np.diff(normal, prepend=normal[0]) > 1e-3) & (log.time > 1.0)
        rows.append(_row(name, log.time, rate, slips, pressing))
        _draw(axes, log.time, rate, slips, name)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", fontsize=8)
    columns = ("case", "slip begins, s", "rate largest, s", "slip ends, s", "rate most negative, s",
               "largest rate, %/s", "most negative, %/s", "largest while only F_N rises, %/s")  # fmt: skip
    return Finding({"03": figure}, table(columns, [list(row.values()) for row in rows]), {"rows": rows})


def _half_spaces() -> list[tuple[str, GraspLog]]:
    soft = ElasticObject(2e6, 0.45), NormalTangentialCoupling()
    moved = scene_log("cycle_0600um")
    return [
        ("case 2, half-space, rigid object", scene_log("fig10_normal_force_rises")),
        ("case 2, coupled, object of 2 MPa", scene_log("fig10_normal_force_rises", *soft)),
        ("case 3, half-space, moved back", moved.take(slice(int(np.searchsorted(moved.time, 3.5))))),
    ]


def _row(name: str, time: FloatArray, rate: FloatArray, slips: BoolArray, pressing: BoolArray) -> dict[str, object]:
    begins, ends = np.flatnonzero(np.diff(slips.astype(int)) > 0), np.flatnonzero(np.diff(slips.astype(int)) < 0)
    falls = rate.min() < -1e-6
    return {
        "case": name,
        "begins": float(time[begins[0] + 1]),
        "largest": float(time[np.argmax(np.where(time < time[begins[0]] + 0.5, rate, 0.0))]),
        "ends": float(time[ends[0] + 1]) if len(ends) else np.nan,
        "smallest": float(time[np.argmin(rate)]) if falls else np.nan,
        "maximum": 100.0 * float(rate.max()),
        "minimum": 100.0 * float(rate.min()) if falls else np.nan,
        "pressing": 100.0 * float(np.abs(rate[pressing]).max()) if pressing.any() else np.nan,
    }


def _draw(axes: Axes, time: FloatArray, rate: FloatArray, slips: BoolArray, title: str) -> None:
    axes.plot(time, 100.0 * rate, color=COLOURS["filter"], lw=1.2)
    low, high = axes.get_ylim()
    axes.fill_between(time, low, high, where=slips, color=COLOURS["strain_rate"], alpha=0.2, lw=0, label="slips")
    axes.axhline(0.0, color="0.5", lw=0.6)
    tidy(axes, title=title, xlabel="time [s]", ylabel="strain rate [%/s]", ylim=(low, high))
