"""Fig. 13: pressed, sheared, sheared back and released at five speeds; slip events against these stages."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.pages import table
from benchmarks.paper.common import (
    COLOURS,
    NOISE,
    Finding,
    detected,
    scene_log,
    strain_rates,
    tidy,
    total_force,
    true_slip,
)
from slipcore import GraspLog, SlipHistory, element_forces
from slipcore.frames import BoolArray, FloatArray

SPEEDS = (0.2, 0.4, 0.6, 0.8, 1.0)
"""mm/s."""
POINT = (12, 12)
"""The paper's reference point; 2.7 mm from the axis here."""
PRESSED, STROKE, LIFT = 0.5, 0.6, 0.4
"""s, mm, s of the scenes."""
METHODS = ("filter", "strain_rate")


def find() -> Finding:
    """Slip events at the reference point and their stage, and how the largest C-strain rate grows with speed."""
    logs = {speed: scene_log(f"cycle_{round(1e3 * speed):04d}um", *NOISE) for speed in SPEEDS}
    clean = {speed: strain_rates(scene_log(f"cycle_{round(1e3 * speed):04d}um"))[1] for speed in SPEEDS}
    histories = {speed: {method: detected(log, method) for method in METHODS} for speed, log in logs.items()}
    rows = [_row(speed, logs[speed], histories[speed], clean[speed]) for speed in SPEEDS]
    columns = ("speed, mm/s", "true slip at the point, s", *(f"{method}, s" for method in METHODS),
               "median over points of the largest rate, %/s", "the same over speed, %/mm")  # fmt: skip
    text = table(columns, [list(row.values()) for row in rows])
    return Finding({"13": _draw(logs, histories, clean)}, text, {"rows": rows})


def stages(speed: float) -> dict[str, float]:
    """When each stage begins, s."""
    forth = STROKE / speed
    return {"press": 0.0, "shear": PRESSED, "reverse": PRESSED + forth, "release": PRESSED + 3.0 * forth}


def spans(time: FloatArray, slips: BoolArray) -> str:
    """Intervals in which a point slips, as text; those of a single frame are left out."""
    change = np.diff(np.concatenate([[False], slips, [False]]).astype(int))
    pairs = zip(np.flatnonzero(change > 0), np.flatnonzero(change < 0), strict=True)
    return "; ".join(f"{time[a]:.2f}–{time[b - 1]:.2f}" for a, b in pairs if b - a > 1) or "none"


def _largest(speed: float, log: GraspLog, rate: FloatArray) -> FloatArray:
    """Largest rate of each point that is in contact all through shear, [k] 1/s."""
    assert log.truth is not None
    began = stages(speed)
    shear = (log.time > began["shear"]) & (log.time <= began["reverse"])
    return rate[shear].max(axis=0)[log.truth.contact[shear].all(axis=0)]


def _row(speed: float, log: GraspLog, histories: dict[str, SlipHistory], rate: FloatArray) -> dict[str, object]:
    middle = 100.0 * float(np.median(_largest(speed, log, rate)))
    return {
        "speed": speed,
        "truth": spans(log.time, true_slip(log)[:, *POINT]),
        **{method: spans(log.time, history.slip[:, *POINT]) for method, history in histories.items()},
        "median": middle,
        "over speed": middle / speed,
    }


def _draw(
    logs: dict[float, GraspLog], histories: dict[float, dict[str, SlipHistory]], clean: dict[float, FloatArray]
) -> Figure:
    figure = Figure(figsize=(11, 7.4), layout="constrained")
    ((force, element), (rate, states), (speeds, box)) = figure.subplots(3, 2)
    shown = 0.2
    _draw_forces(force, element, logs[shown])
    _draw_rate(rate, states, logs[shown], clean[shown], histories[shown])
    for axes in (force, element, rate, states):
        for k, (name, start) in enumerate(stages(shown).items()):
            axes.axvline(start, color="0.7", lw=0.8, zorder=0)
            axes.text(start, 1.01 + 0.07 * (k % 2), name, fontsize=7, transform=axes.get_xaxis_transform())
    for k, speed in enumerate(SPEEDS):
        scaled = (logs[speed].time - PRESSED) * speed
        speeds.plot(scaled, 100.0 * clean[speed][:, *POINT], color=f"C{k}", lw=1.0, label=f"{speed} mm/s")
    tidy(speeds, xlabel="travel of the object [mm]", ylabel="C-strain rate [%/s]", xlim=(-0.05, 1.8), ylim=(-40, 40))
    speeds.legend(fontsize=7, ncols=2, loc="lower left")
    box.boxplot([100.0 * _largest(s, logs[s], clean[s]) for s in SPEEDS], tick_labels=[f"{s}" for s in SPEEDS],
                showfliers=False)  # fmt: skip
    tidy(box, xlabel="speed [mm/s]", ylabel="largest C-strain rate [%/s]")
    return figure


def _draw_forces(total: Axes, element: Axes, log: GraspLog) -> None:
    assert log.force is not None
    assert log.normal is not None
    force = total_force(log)
    total.plot(log.time, -force[:, 2], color=COLOURS["filter"], label="normal")
    total.plot(log.time, force[:, 0], color=COLOURS["strain_rate"], label="tangential, x")
    tidy(total, ylabel="force on the finger [N]")
    at = element_forces(log.force[:, *POINT], log.normal[:, *POINT])
    element.plot(log.time, 1e3 * at.normal, color=COLOURS["filter"], label="normal")
    element.plot(log.time, 1e3 * at.tangential, color=COLOURS["strain_rate"], label="tangential")
    tidy(element, ylabel="force on the element [mN]")
    for axes in (total, element):
        axes.legend(fontsize=7, loc="center right")


def _draw_rate(axes: Axes, states: Axes, log: GraspLog, rate: FloatArray, histories: dict[str, SlipHistory]) -> None:
    axes.plot(log.time, 100.0 * rate[:, *POINT], color="0.3", lw=1)
    tidy(axes, ylabel="C-strain rate, signed [%/s]", ylim=(-15.0, 15.0))
    lines = {"truth": true_slip(log)[:, *POINT]} | {m: h.slip[:, *POINT] for m, h in histories.items()}
    for k, (name, slips) in enumerate(lines.items()):
        states.fill_between(log.time, -k, 0.7 * slips - k, step="mid", color=COLOURS[name], lw=0)
    tidy(states, yticks=[0.35 - k for k in range(len(lines))], yticklabels=list(lines), xlabel="time [s]")
    axes.set_xlabel("time [s]")
