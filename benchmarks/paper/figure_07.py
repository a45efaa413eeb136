"""Fig. 7: contact factor, C-strain rate and slip at three reference points, in three conditions."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.pages import table
from benchmarks.paper.common import COLOURS, METHODS, Finding, detected, scene_log, strain_rates, tidy, true_slip
from slipcore import GraspLog, SlipHistory, contact_factor, element_forces
from slipcore.frames import BoolArray, FloatArray

CONDITIONS = (1, 2, 3)
POINTS = {"p_a": (14, 10), "p_b": (13, 10), "p_c": (12, 10)}
"""Of the 20 × 20 points: 3.4, 2.6 and 1.9 mm from the axis, on the side to which the finger is pulled."""


def find() -> Finding:
    """When slip begins at each point, and when each method says so."""
    figure = Figure(figsize=(11, 8.0), layout="constrained")
    grid = figure.subplots(2 * len(CONDITIONS), len(POINTS), sharex=True, height_ratios=(1.0, 1.0) * len(CONDITIONS))
    rows = []
    for k, condition in enumerate(CONDITIONS):
        log = scene_log(f"table1_condition{condition}")
        histories = {method: detected(log, method) for method in METHODS}
        rate = strain_rates(log)[0]
        for column, (name, point) in enumerate(POINTS.items()):
            rows.append(_row(f"{condition}, {name}", log, histories, point))
            _draw(grid[2 * k : 2 * k + 2, column], log, rate, histories, point)
            grid[2 * k, column].set_title(f"condition {condition}, {name}", fontsize=9)
    for axes in grid[-1]:
        axes.set_xlabel("time [s]")
    for line in grid[::2]:
        line[0].set_ylabel("contact factor [-]", fontsize=8)
    for line in grid[1::2]:
        line[0].set_ylabel("C-strain rate [%/s]", fontsize=8)
    handles, labels = grid[1, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, fontsize=8)
    columns = ("condition, point", "slip begins, s", *(f"{method}, frames late" for method in METHODS))
    return Finding({"07": figure}, table(columns, [list(row.values()) for row in rows]), {"rows": rows})


def _onset(time: FloatArray, slips: BoolArray) -> float:
    return float(time[np.argmax(slips)]) if slips.any() else float("nan")


def _row(name: str, log: GraspLog, histories: dict[str, SlipHistory], point: tuple[int, int]) -> dict[str, object]:
    begins = _onset(log.time, true_slip(log)[:, *point])
    interval = float(np.median(np.diff(log.time)))
    late = {m: (_onset(log.time, h.slip[:, *point]) - begins) / interval for m, h in histories.items()}
    return {"point": name, "begins": begins} | {m: "never" if np.isnan(v) else f"{v:+.0f}" for m, v in late.items()}


def _draw(
    pair: tuple[Axes, Axes], log: GraspLog, rate: FloatArray, histories: dict[str, SlipHistory], point: tuple[int, int]
) -> None:
    upper, lower = pair
    assert log.force is not None
    assert log.normal is not None
    assert log.truth is not None
    forces = element_forces(log.force[:, *point], log.normal[:, *point])
    factor = contact_factor(forces.tangential, forces.normal, log.truth.friction.coefficients[0])
    upper.plot(log.time, factor, color="0.3", lw=1.2)
    lower.plot(log.time, 100.0 * rate[:, *point], color="0.3", lw=1.2, label="C-strain rate")
    begins = _onset(log.time, true_slip(log)[:, *point])
    for axes in pair:
        axes.axvline(begins, color="0.2", lw=1.0, ls="--", label="slip truly begins")
    for method, history in histories.items():
        found = _onset(log.time, history.slip[:, *point])
        lower.axvline(found, color=COLOURS[method], lw=1.2, alpha=0.8, label=method)
    tidy(upper, ylim=(-0.05, 1.1))
    tidy(lower)
