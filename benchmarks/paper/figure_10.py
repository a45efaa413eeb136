"""Fig. 10: the normal force rises after the first slip, then the tangential force again; against the baselines."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from benchmarks.pages import table
from benchmarks.paper.common import (
    COLOURS,
    Finding,
    detected,
    draw_states,
    f1_score,
    scene_log,
    stick_ratio_error,
    tidy,
    total_force,
    true_slip,
)
from slipcore import GraspLog, SlipHistory
from slipcore.contact.effects import FiniteLayer, NormalTangentialCoupling
from slipcore.frames import BoolArray

METHODS = ("filter", "strain_rate", "rigid_fit", "local_deformation", "deformation_gradient", "strain_threshold")
MOMENTS = (0.9, 1.3, 1.9)
STAGES = {"first load": (1 / 3, 1.0), "F_N rises": (1.0, 4 / 3), "second load": (4 / 3, 2.0)}
STYLES = dict(zip(METHODS, ("-", "-", "--", "--", "--", ":"), strict=True))


def find() -> Finding:
    """Stick-ratio error and F1 of each method, stage by stage, on a half-space and on a bonded layer."""
    layer = FiniteLayer(5e-3), NormalTangentialCoupling()
    logs = {
        "half-space": scene_log("fig10_normal_force_rises"),
        "bonded layer, coupled": scene_log("fig10_normal_force_rises", *layer),
    }
    histories = {name: {method: detected(log, method) for method in METHODS} for name, log in logs.items()}
    rows = [_row(name, method, logs[name], histories[name][method]) for name in logs for method in METHODS]
    text = table(list(rows[0]), [list(row.values()) for row in rows])
    return Finding({"10": _draw(logs, histories)}, text, {"rows": rows})


def _stage(log: GraspLog, name: str) -> BoolArray:
    start, end = STAGES[name]
    return (log.time > start + 1e-9) & (log.time <= end + 1e-9)


def _row(scene: str, method: str, log: GraspLog, history: SlipHistory) -> dict[str, object]:
    assert log.truth is not None
    true, found = true_slip(log), history.slip & log.truth.contact
    loads = ("first load", "second load")
    return {
        "scene": scene,
        "method": method,
        **{f"error, {name}": stick_ratio_error(log, history, _stage(log, name)) for name in STAGES},
        **{f"F1, {name}": f1_score(true[_stage(log, name)], found[_stage(log, name)]) for name in loads},
    }


def _draw(logs: dict[str, GraspLog], histories: dict[str, dict[str, SlipHistory]]) -> Figure:
    figure = Figure(figsize=(11, 7.6), layout="constrained")
    upper, lower = figure.subfigures(2, 1, height_ratios=(1.5, 1.0))
    panels = upper.subplots(1, 2, sharey=True)
    for axes, (name, log) in zip(panels, logs.items(), strict=True):
        assert log.truth is not None
        axes.plot(log.time, log.truth.stick_ratio, color=COLOURS["truth"], lw=2.2, label="truth")
        for k, method in enumerate(METHODS):
            axes.plot(log.time, histories[name][method].stick_ratio, f"C{k}{STYLES[method]}", lw=1.1, label=method)
        for start, _ in STAGES.values():
            axes.axvline(start, color="0.8", lw=0.8, zorder=0)
        tidy(axes, title=name, xlabel="time [s]", ylim=(-0.04, 1.06))
    panels[0].set_ylabel("stick ratio [-]")
    _draw_forces(panels[0].inset_axes((0.04, 0.08, 0.3, 0.3)), logs["half-space"])
    upper.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=7, fontsize=8)
    _draw_regions(lower, logs["half-space"], histories["half-space"])
    return figure


def _draw_forces(axes: Axes, log: GraspLog) -> None:
    force = total_force(log)
    axes.plot(log.time, -force[:, 2], color="0.3", lw=1, label="F_N")
    axes.plot(log.time, np.hypot(force[:, 0], force[:, 1]), color="0.3", lw=1, ls=":", label="F_T")
    axes.tick_params(labelsize=6)
    axes.set_title("load [N]", fontsize=7)
    axes.legend(fontsize=6, frameon=False)


def _draw_regions(figure: SubFigure, log: GraspLog, histories: dict[str, SlipHistory]) -> None:
    assert log.truth is not None
    seen = {"truth": (log.truth.contact, true_slip(log))}
    seen |= {method: (history.contact, history.slip) for method, history in histories.items()}
    grid = figure.subplots(len(MOMENTS), len(seen))
    for line, moment in zip(grid, MOMENTS, strict=True):
        frame = int(np.searchsorted(log.time, moment - 1e-9))
        for axes, (contact, slip) in zip(line, seen.values(), strict=True):
            draw_states(axes, log, contact[frame], slip[frame])
        line[0].set_ylabel(f"{moment:.1f} s", fontsize=8)
    for axes, name in zip(grid[0], seen, strict=True):
        axes.set_title(name, fontsize=8)
