"""Fig. 8: stick and slip regions, and the stick ratio, in the four conditions of Table I."""

import numpy as np
from matplotlib.figure import Figure

from benchmarks.paper.common import Finding, draw_states, scene_log, true_slip
from benchmarks.paper.stick_ratios import Histories, compare, detect_all, draw
from slipcore import GraspLog

MOMENTS = (0.9, 1.4, 1.9)
"""s at which the regions are shown."""
SHOWN = ("truth", "filter", "strain_rate")


def find() -> Finding:
    """Stick ratio of each method against the truth."""
    logs = {f"condition {k}": scene_log(f"table1_condition{k}") for k in (1, 2, 3, 4)}
    histories = detect_all(logs)
    text, rows = compare(logs, histories)
    pictures = {"08": draw(logs, histories, columns=4, height=2.6), "08-regions": draw_regions(logs, histories)}
    return Finding(pictures, text, {"rows": rows})


def draw_regions(logs: dict[str, GraspLog], histories: Histories) -> Figure:
    """Maps of the truth and of two methods at three moments of each condition."""
    figure = Figure(figsize=(11, 3.4), layout="constrained")
    grid = figure.subplots(len(SHOWN), len(logs) * len(MOMENTS))
    for block, (name, log) in enumerate(logs.items()):
        assert log.truth is not None
        for k, moment in enumerate(MOMENTS):
            column, frame = block * len(MOMENTS) + k, int(np.searchsorted(log.time, moment - 1e-9))
            seen = {"truth": (log.truth.contact, true_slip(log))}
            seen |= {method: (h.contact, h.slip) for method, h in histories[name].items()}
            for row, who in enumerate(SHOWN):
                contact, slip = seen[who]
                draw_states(grid[row, column], log, contact[frame], slip[frame])
            grid[0, column].set_title(f"{name[-1]}: {moment:.1f} s", fontsize=8)
    for row, who in enumerate(SHOWN):
        grid[row, 0].set_ylabel(who, fontsize=9)
    figure.suptitle("condition: time (blue: stick, orange: slip)", fontsize=9)
    return figure
