"""True against estimated stick ratio of several scenes: what Fig. 8, 9, 14 and 15 have in common."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from benchmarks.pages import table
from benchmarks.paper.common import (
    METHODS,
    detected,
    draw_stick_ratio,
    f1_score,
    stick_ratio_error,
    true_slip,
)
from slipcore import GraspLog, SlipHistory
from slipcore.frames import FloatArray

Histories = Mapping[str, dict[str, SlipHistory]]


def detect_all(logs: Mapping[str, GraspLog]) -> Histories:
    """What every method says of every log."""
    return {name: {method: detected(log, method) for method in METHODS} for name, log in logs.items()}


def compare(logs: Mapping[str, GraspLog], histories: Histories) -> tuple[str, list[dict[str, object]]]:
    """A table of stick-ratio error and F1 of every method, with a row of means."""
    rows = [{"scene": name, **_scores(log, histories[name])} for name, log in logs.items()]
    keys = [key for key in rows[0] if key != "scene"]
    mean = {"scene": "mean", **{key: float(np.nanmean([row[key] for row in rows])) for key in keys}}
    return table(("scene", *keys), [list(row.values()) for row in (*rows, mean)]), [*rows, mean]


def draw(logs: Mapping[str, GraspLog], histories: Histories, columns: int, height: float = 2.1) -> Figure:
    """One panel a scene."""
    lines = -(-len(logs) // columns)
    figure = Figure(figsize=(11, height * lines + 0.4), layout="constrained")
    grid = figure.subplots(lines, columns, sharey=True, squeeze=False)
    for axes, (name, log) in zip(grid.flat, logs.items(), strict=False):
        draw_stick_ratio(axes, log, histories[name])
        axes.set_title(name, fontsize=9)
    for axes in grid.flat[len(logs) :]:
        axes.set_axis_off()
    for axes in grid[-1]:
        axes.set_xlabel("time [s]")
    for axes in grid[:, 0]:
        axes.set_ylabel("stick ratio [-]")
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=8)
    return figure


def _scores(log: GraspLog, histories: dict[str, SlipHistory]) -> dict[str, float]:
    errors = {f"{method}: error": stick_ratio_error(log, history) for method, history in histories.items()}
    return errors | {f"{m}: F1": f1_score(true_slip(log), h.slip & _contact(log)) for m, h in histories.items()}


def _contact(log: GraspLog) -> FloatArray:
    assert log.truth is not None
    return log.truth.contact
