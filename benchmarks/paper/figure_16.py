"""Fig. 16: principal components of C-strain-rate fields of many grasps, explained variance and sampling adequacy."""

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from benchmarks.detector.scenes import simulated
from benchmarks.pages import table
from benchmarks.paper.common import Finding, draw_field, strain_rates, tidy
from slipcore import GraspLog
from slipcore.contact.effects import LoadPath, MarkerNoise, SensorSampling
from slipcore.contact.scene import Finger, Press, Scene
from slipcore.frames import FloatArray

PAPER = {"first": 0.80, "first two": 0.85, "KMO": 0.996}
GRIPS = (7.0, 8.0, 10.0, 12.0, 15.0)
"""N, as in Fig. 15."""
TESTS = 4
"""With each grip: loads of different size, the grip raised by more or less at different moments."""
LEAST_SHARE = 0.15
"""Fields count where their largest rate exceeds this share of the grasp's largest: the paper's "significant"."""
NOISE = 1e-6
SHOWN = 4


def find() -> Finding:
    """Components of the fields without sign, as the paper takes them, and with it; about zero and about their mean."""
    logs = [simulated(scene) for scene in grasps()]
    rates = [strain_rates(log) for log in logs]
    found = [
        analyse(name, logs, [pair[k] for pair in rates], centred)
        for k, name in enumerate(("unsigned", "signed"))
        for centred in (False, True)
    ]
    rows = [
        (
            f"{a.name}, about {'the mean' if a.centred else 'zero'}",
            a.fields,
            a.points,
            *np.cumsum(a.explained)[:3],
            a.kmo,
        )
        for a in found
    ]
    columns = ("rate", "fields", "points", "first component", "first two", "first three", "KMO")
    text = table(columns, [*rows, ("the paper's", 1635, 400, PAPER["first"], PAPER["first two"], "–", PAPER["KMO"])])
    numbers = {
        row[0]: {"fields": a.fields, "points": a.points, "kmo": a.kmo, "explained": a.explained[:10].tolist()}
        for row, a in zip(rows, found, strict=True)
    }
    return Finding({"16": _draw(logs[0], found[:2])}, text, numbers)


@dataclass(frozen=True, slots=True, eq=False)
class Analysis:
    """Principal components of ``fields`` fields over ``points`` points: ``explained`` variance [k], ``maps`` of the
    first ones [SHOWN, n, m], and the sampling adequacy ``kmo``.
    """

    name: str
    centred: bool
    fields: int
    points: int
    explained: FloatArray
    maps: FloatArray
    kmo: float


def grasps() -> list[Scene]:
    """Lifts with each grip: it is raised once, after slip has gone some way, and then the load grows on."""
    rng, scenes = np.random.default_rng(16), []
    sensor = SensorSampling((20, 20), 0.75e-3, 30.0), MarkerNoise(NOISE)
    for grip in GRIPS:
        for test in range(TESTS):
            load = rng.uniform(0.7, 0.93) * 0.4 * grip
            rise, pause = rng.uniform(0.2, 0.5) * grip, rng.uniform(0.1, 0.3)
            time = tuple(np.cumsum([0.5, rng.uniform(0.6, 1.0), pause, 0.3, 0.8]).tolist())
            along = np.array([0.0, 1.0, 1.0, 1.0, 1.0 + 0.8 * rise / grip]) * load
            path = LoadPath(
                time,
                force_y=tuple((-along).tolist()),
                normal_force=(0.0, 0.0, 0.0, rise, rise),
            )
            scenes.append(Scene(f"lift {grip:g} N, {test}", (*sensor, path), Finger(), 0.4, Press(grip, 0.4), time[-1]))
    return scenes


def significant(log: GraspLog, rate: FloatArray) -> FloatArray:
    """The fields [k, n, m] of a grasp in which something happens, after the press and in contact."""
    assert log.truth is not None
    after = log.time > 0.45
    size = np.abs(rate).max(axis=(1, 2), where=log.truth.contact, initial=0.0)
    return np.where(log.truth.contact, rate, 0.0)[after & (size > LEAST_SHARE * size[after].max())]


def analyse(name: str, logs: list[GraspLog], rates: list[FloatArray], centred: bool) -> Analysis:
    """Principal components of all fields, over the points that are in contact in most of them."""
    fields = np.concatenate([significant(log, rate) for log, rate in zip(logs, rates, strict=True)])
    used = np.count_nonzero(fields, axis=0) > 0.5 * len(fields)
    data = fields[:, used]
    origin = data.mean(axis=0) if centred else np.zeros(data.shape[1])
    _, values, components = np.linalg.svd(data - origin, full_matrices=False)
    maps = np.full((SHOWN, *used.shape), np.nan)
    maps[:, used] = components[:SHOWN] * np.sign(components[:SHOWN].sum(axis=1, keepdims=True))
    return Analysis(name, centred, *data.shape, values**2 / (values**2).sum(), maps, adequacy(data))


def adequacy(data: FloatArray) -> float:
    """Kaiser–Meyer–Olkin measure of data [k, p]: Σr²/(Σr² + Σq²) over pairs, q the partial correlations.

    The correlation matrix is inverted by the singular values of the standardised data.
    """
    standard = (data - data.mean(axis=0)) / data.std(axis=0)
    _, values, axes = np.linalg.svd(standard / np.sqrt(len(data)), full_matrices=False)
    correlation, inverse = (axes.T * values**2) @ axes, (axes.T / values**2) @ axes
    scale = np.sqrt(np.diag(inverse))
    pairs = ~np.eye(len(inverse), dtype=bool)
    direct, partial = (correlation[pairs] ** 2).sum(), ((inverse / np.outer(scale, scale))[pairs] ** 2).sum()
    return float(direct / (direct + partial))


def _draw(log: GraspLog, found: list[Analysis]) -> Figure:
    figure = Figure(figsize=(11, 4.6), layout="constrained")
    grid = figure.subplots(len(found), SHOWN + 1, width_ratios=(1.0,) * SHOWN + (1.4,))
    for line, analysis in zip(grid, found, strict=True):
        for k, (axes, field) in enumerate(zip(line, analysis.maps, strict=False)):
            largest = float(np.nanmax(np.abs(field)))
            draw_field(axes, log, field, "RdBu_r", None).set_clim(-largest, largest)
            axes.set_title(f"component {k + 1}: {analysis.explained[k]:.1%}", fontsize=9)
        line[0].set_ylabel(f"about {'the mean' if analysis.centred else 'zero'}")
        share = 100.0 * analysis.explained[:8]
        line[-1].bar(np.arange(1, 9), share, color="0.7", label="each")
        line[-1].plot(np.arange(1, 9), np.cumsum(share), "o-", ms=3, color="#2b6cb0", label="together")
        line[-1].axhline(80.0, color="#dd6b20", lw=0.8, label="80 %")
        tidy(line[-1], xlabel="component", ylabel="explained variance [%]", ylim=(0.0, 103.0))
        line[-1].legend(fontsize=7)
    return figure
