"""Fig. 6: strain components in condition 1, and C-strain rate in the four conditions, as slip spreads."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure

from benchmarks.pages import table
from benchmarks.paper.common import Finding, draw_field, radius, scene_log, strain_rates, strains
from slipcore import GraspLog
from slipcore.contact.effects import FiniteLayer, NormalTangentialCoupling, SensorSampling
from slipcore.frames import FloatArray

CONDITIONS, LAYERED = (1, 2, 3, 4), (1, 3)
SHARES = (0.2, 0.4, 0.6, 0.8, 0.98)
"""Of the final load, at which the fields are shown."""
SENSOR = SensorSampling((48, 48), 0.25e-3, 30.0)
COMPONENTS = ("ε_xx", "ε_yy", "ε_xy")
LOADING = (1.0 / 3.0, 2.0)


def find() -> Finding:
    """The wave in each condition: how high it is, and how far its crest lies from the edge of the stick region."""
    logs = {k: scene_log(f"table1_condition{k}", sampling=SENSOR) for k in CONDITIONS}
    rates = {k: strain_rates(log)[0] for k, log in logs.items()}
    rows = [_row(str(k), share, logs[k], rates[k]) for k in CONDITIONS for share in SHARES]
    for k in LAYERED:
        log = scene_log(f"table1_condition{k}", FiniteLayer(5e-3), NormalTangentialCoupling(), sampling=SENSOR)
        rows += [_row(f"{k} on the bonded layer", share, log, strain_rates(log)[0]) for share in SHARES]
    conditions = list(dict.fromkeys(row["condition"] for row in rows))
    columns = ("condition", *(f"{share:.0%} of the load" for share in SHARES))
    cells = [
        (f"{k}: {what}", *(row[what] for row in rows if row["condition"] == k))
        for what in ("largest rate, %/s", "crest − stick radius, mm")
        for k in conditions
    ]
    return Finding({"06": _draw(logs, rates)}, table(columns, cells), {"rows": rows})


def frame_at(log: GraspLog, share: float) -> int:
    """Frame at which that share of the load is reached."""
    start, end = LOADING
    return int(np.searchsorted(log.time, start + share * (end - start) - 1e-9))


def _row(condition: str, share: float, log: GraspLog, rate: FloatArray) -> dict[str, object]:
    assert log.truth is not None
    k = frame_at(log, share)
    inside = log.truth.contact[k]
    far = radius(log)
    crest = far[inside][np.argmax(rate[k][inside])]
    stick = np.sqrt((inside & ~log.truth.slip_contact_factor[k]).sum() * log.element_area / np.pi)
    return {
        "condition": condition,
        "share": share,
        "largest rate, %/s": 100.0 * float(rate[k][inside].max()),
        "crest − stick radius, mm": 1e3 * float(crest - stick),
    }


def _draw(logs: dict[int, GraspLog], rates: dict[int, FloatArray]) -> Figure:
    figure = Figure(figsize=(8.5, 10.2), layout="constrained")
    grid = figure.subplots(len(COMPONENTS) + len(CONDITIONS), len(SHARES))
    strain, norm = 100.0 * strains(logs[1]), Normalize(-6.0, 6.0)
    for row, name in enumerate(COMPONENTS):
        for axes, share in zip(grid[row], SHARES, strict=True):
            image = draw_field(axes, logs[1], strain[frame_at(logs[1], share), row], "RdBu_r", norm)
        grid[row, 0].set_ylabel(name)
    figure.colorbar(image, ax=grid[: len(COMPONENTS)], label="strain in condition 1 [%]", shrink=0.8)
    waves = grid[len(COMPONENTS) :]
    for line, k in zip(waves, CONDITIONS, strict=True):
        for axes, share in zip(line, SHARES, strict=True):
            frame = frame_at(logs[k], share)
            image = draw_field(axes, logs[k], 100.0 * np.maximum(rates[k][frame], 1e-5), "viridis", LogNorm(0.3, 100.0))
            _outline(axes, logs[k], frame)
        line[0].set_ylabel(f"condition {k}")
    figure.colorbar(image, ax=waves, label="C-strain rate [%/s] (white: edge of stick)", shrink=0.8, extend="both")
    for axes, share in zip(grid[0], SHARES, strict=True):
        axes.set_title(f"{share:.0%} of the load", fontsize=9)
    return figure


def _outline(axes: Axes, log: GraspLog, frame: int) -> None:
    assert log.truth is not None
    stick = log.truth.contact[frame] & ~log.truth.slip_contact_factor[frame]
    x, y = log.position[:, 0, 0] * 1e3, log.position[0, :, 1] * 1e3
    axes.contour(x, y, stick.T.astype(float), levels=[0.5], colors="white", linewidths=0.7)
