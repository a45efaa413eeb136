"""What 95 % intervals cover: `python -m benchmarks.estimators.coverage [--fits N] [--cross N] [--only …]`.

Every method on its own model's data (``--fits``), and on the data of the other models (``--cross``; a quarter of that
for the methods that take tenths of a second a fit). With ``--only`` the rows of the other methods are kept as they are
in the folder. A grasp has 400 samples of 20 elements; the last two kinds have 8 grasps of
50 and of 150. A fit that does not converge is counted apart, and with the intervals that its exception carries. Writes
estimators-coverage.json and estimators-coverage.png.
"""

import os
from dataclasses import replace

from estimators.defaults import LINEAR

os.environ["OMP_NUM_THREADS"] = "1"  # before numpy is first imported: small products gain nothing from threads
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import estimators
from benchmarks.estimators.__main__ import SIGMA, TRUTH, Row, heteroscedastic, make, outliers, with_friction
from estimators.methods import ols
from slipcore.samples import FrictionSamples

N, ELEMENTS, GRASPS = 400, 20, 8
Data = FrictionSamples | list[FrictionSamples]


def independent(seed: int) -> Data:
    """Normal errors."""
    return make(N, 7000 + seed)


def shared(seed: int) -> Data:
    """Half of the variance shared within an element."""
    data, rng = make(N, 7000 + seed), np.random.default_rng([seed, 1])
    return with_friction(data, data.friction_coefficient + SIGMA * rng.standard_normal(ELEMENTS)[data.element])


def autocorrelated(seed: int) -> Data:
    """One element, whose errors follow each other with a correlation of 0.8."""
    data, rng = make(N, 7000 + seed, elements=1), np.random.default_rng([seed, 5])
    error, fresh = np.empty(N), rng.standard_normal(N)
    error[0] = fresh[0]
    for k in range(1, N):
        error[k] = 0.8 * error[k - 1] + 0.6 * fresh[k]
    return with_friction(data, plane(data) + SIGMA * error)


def unequal(seed: int) -> Data:
    """Scatter that grows with the force."""
    return heteroscedastic(make(N, 7000 + seed), seed)


def heavy(seed: int) -> Data:
    """Student-t errors on 3 degrees of freedom."""
    data = make(N, 7000 + seed)
    return with_friction(data, plane(data) + SIGMA * np.random.default_rng([seed, 6]).standard_t(3.0, N))


def false_slip(seed: int) -> Data:
    """Outliers anywhere below the plane."""
    return outliers(make(N, 7000 + seed), seed)


def mixture(seed: int) -> Data:
    """A tenth of outliers, as the likelihood has them: scatter 0.1, 0.15 below the plane."""
    data, rng = make(N, 7000 + seed), np.random.default_rng([seed, 7])
    far = plane(data) - 0.15 + 0.1 * rng.standard_normal(N)
    return with_friction(data, np.where(rng.random(N) < 0.1, far, data.friction_coefficient))


def noisy(seed: int) -> Data:
    """8 mN of noise on each component of the force; true normal forces are normal, 100 ± 25 mN."""
    data, rng = make(N, 7000 + seed), np.random.default_rng([seed, 4])
    data = replace(data, normal_force=np.maximum(rng.normal(0.1, 0.025, N), 0.03))
    data = with_friction(data, plane(data) + SIGMA * rng.standard_normal(N))
    f_n, f_t = (f + 8e-3 * rng.standard_normal(N) for f in (data.normal_force, data.tangential_force))
    return replace(data, normal_force=f_n, tangential_force=f_t, friction_coefficient=f_t / f_n)


def grasps(seed: int) -> Data:
    """Eight grasps that differ by an intercept with a scatter of 0.03."""
    rng = np.random.default_rng([seed, 8])
    parts = [make(N // GRASPS, 100_000 + seed * GRASPS + g) for g in range(GRASPS)]
    return [with_friction(part, part.friction_coefficient + 0.03 * rng.standard_normal()) for part in parts]


def places(seed: int) -> Data:
    """Eight grasps of 150 samples, half of whose variance is shared within an element of a grasp."""
    rng = np.random.default_rng([seed, 9])
    parts = [make(150, 200_000 + seed * GRASPS + g) for g in range(GRASPS)]
    return [with_friction(p, p.friction_coefficient + SIGMA * rng.standard_normal(ELEMENTS)[p.element]) for p in parts]


def plane(data: FrictionSamples) -> np.ndarray:
    """Friction without error."""
    return np.asarray(TRUTH @ [np.ones(len(data)), data.tangential_velocity, data.normal_force])


KINDS: dict[str, Callable[[int], Data]] = {
    "independent": independent,
    "shared by element": shared,
    "autocorrelated": autocorrelated,
    "heteroscedastic": unequal,
    "Student-t": heavy,
    "outliers": false_slip,
    "outlier mixture": mixture,
    "noisy f_n": noisy,
    "grasps differ": grasps,
    "places differ": places,
}


class Method:
    """Options of ``fit``, the kind of data that it is made for, and whether a fit takes a few milliseconds only."""

    def __init__(self, own: str, quick: bool, **options: object) -> None:
        self.own, self.quick, self.options = own, quick, options


SAMPLED = {"method": "bayes", "accuracy": 0.1}
METHODS = {
    "ols": Method("independent", True, method="ols"),
    "robust": Method("independent", True, method="robust"),
    "conjugate": Method("independent", True, method="conjugate"),
    "gaussian": Method("independent", True, likelihood="gaussian", **SAMPLED),
    "student_t": Method("Student-t", False, likelihood="student_t", **SAMPLED),
    "outlier": Method("outlier mixture", False, likelihood="outlier", **SAMPLED),
    "errors_in_variables": Method("noisy f_n", False, likelihood="errors_in_variables", **SAMPLED),
    "hierarchical": Method("grasps differ", True, likelihood="hierarchical", **SAMPLED),
    "auto": Method("", True, method="auto", accuracy=0.1),
}


def covered(kind: str, options: dict[str, object], fits: int) -> Row:
    """Part of the intervals that hold each true coefficient, and of the fits that did not converge."""
    inside, failed, chosen = np.zeros(3), 0, dict[str, int]()
    for seed in range(fits):
        try:
            model = estimators.fit(KINDS[kind](seed), seed=seed, **options)
        except estimators.NotConverged as error:
            model, failed = error.model, failed + 1
        low, high = model.interval().T
        inside += (low <= TRUTH) & (high >= TRUTH)
        name = str(model.diagnostics.get("likelihood", model.method))
        chosen[name] = chosen.get(name, 0) + 1
    row: Row = {f"beta{k}": float(part) for k, part in enumerate(inside / fits)}
    return row | {"fits": fits, "not converged": failed, "chosen": ", ".join(f"{k} {v}" for k, v in chosen.items())}


def table(fits: int, cross: int, only: list[str]) -> list[Row]:
    """A row a method and kind of data."""
    rows: list[Row] = []
    for name in only:
        method = METHODS[name]
        for kind in KINDS:
            count = fits if kind == method.own else cross if method.quick else cross // 4
            if count:
                rows.append({"method": name, "data": kind, **covered(kind, method.options, count)})
                print(rows[-1], flush=True)
    return rows


def compact(rows: list[Row]) -> str:
    """Coverage of β₀, β₁, β₂ in per cent, a row a method and a column a kind of data; its own in bold."""
    lines = ["| method | " + " | ".join(KINDS) + " |", "|---|" + "---|" * len(KINDS)]
    for name in dict.fromkeys(str(row["method"]) for row in rows):
        cells = dict.fromkeys(KINDS, "")
        for row in rows:
            if row["method"] == name:
                values = " ".join(f"{100.0 * float(row[f'beta{k}']):.0f}" for k in range(3))
                cells[str(row["data"])] = f"**{values}**" if METHODS[name].own == row["data"] else values
        lines.append(f"| {name} | " + " | ".join(cells.values()) + " |")
    return "\n".join(lines)


def picture(rows: list[Row], path: Path) -> None:
    """Coverage of the worst and the best covered coefficient, a panel a kind of data."""
    figure = Figure(figsize=(16.0, 6.0), layout="constrained")
    panels = figure.subplots(2, 5, sharex=True, sharey=True).ravel()
    names = list(METHODS)
    for axes, kind in zip(panels, KINDS, strict=True):
        axes.axvspan(0.93, 0.97, color="0.9")
        axes.axvline(0.95, color="0.6", linewidth=1)
        for row in rows:
            if row["data"] == kind:
                place, own = names.index(str(row["method"])), METHODS[str(row["method"])].own == kind
                colour = "C2" if own else "C3" if row["method"] == "auto" else "C0"
                values = [float(row[f"beta{k}"]) for k in range(3)]
                axes.plot([min(values), max(values)], [place, place], "-", color=colour, linewidth=1)
                for value, marker in zip(values, "osD", strict=True):
                    axes.plot(max(value, 0.4), place, marker, color=colour, markersize=5)
        axes.set_title(kind, fontsize=10)
        axes.set_yticks(range(len(names)), names, fontsize=8)
        axes.set_xlim(0.38, 1.01)
        axes.grid(alpha=0.2)
    figure.supxlabel(
        "part of 95 % intervals that hold the truth (β₀ o, β₁ □, β₂ ◇; below 0.4 drawn at 0.4)", fontsize=10
    )
    figure.suptitle("Coverage: each method on its own model's data (green), on the others' (blue), and auto (red)")
    figure.savefig(path, dpi=110)


def main() -> None:
    """Fit, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--output", type=Path, default=Path("benchmark-output"))
    parser.add_argument("--fits", type=int, default=1000)
    parser.add_argument("--cross", type=int, default=400)
    parser.add_argument("--only", nargs="+", choices=list(METHODS), default=list(METHODS))
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    ols.LINEAR = replace(LINEAR, statsmodels=0)  # its errors stand in the diagnostics only
    path = options.output / "estimators-coverage.json"
    known = json.loads(path.read_text(encoding="utf-8")) if path.exists() else []
    rows = table(options.fits, options.cross, options.only)
    rows += [row for row in known if row["method"] not in options.only]
    rows.sort(key=lambda row: list(METHODS).index(str(row["method"])))
    path.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    picture(rows, options.output / "estimators-coverage.png")
    print(compact(rows))


if __name__ == "__main__":
    main()
