"""Friction found from simulated ramps of known friction: `python -m benchmarks.known_truth [--output FOLDER]`.

Each material is seen in four ramps of different normal force (1 µm marker noise, 2 mN force noise), detected by each
method, fitted by each estimator, over several seeds of the noise. Writes JSON and a picture, prints a Markdown table.
"""

import argparse
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from estimators import EstimatorError, fit
from slipcore import FrictionSamples, collect_samples, detect_slip
from slipcore.contact import tangential_ramp

FRICTION = (0.25, 0.45, 0.8)
NORMAL_FORCES = (4.0, 6.0, 9.0, 13.0)
DETECTORS = ("filter", "strain_rate", "strain_rate_literal")
ESTIMATORS = ("ols", "bayes")
MARKER_NOISE, FORCE_NOISE = 1e-6, 2e-3


@dataclass(frozen=True, slots=True)
class Finding:
    """One fit: what was true and what was found; ``estimate`` is None where the fit was refused."""

    detector: str
    estimator: str
    friction: float
    seed: int
    samples: int
    estimate: float | None
    low: float | None
    high: float | None

    @property
    def covered(self) -> bool:
        """Whether the 95 % interval holds the truth."""
        return self.low is not None and self.high is not None and self.low <= self.friction <= self.high

    @property
    def relative_error(self) -> float:
        """Error of the estimate over the truth."""
        return np.nan if self.estimate is None else self.estimate / self.friction - 1.0


def ramp_samples(friction: float, detector: str, seed: int) -> list[FrictionSamples]:
    """Friction samples of four ramps, one entry a grasp."""
    generators = np.random.default_rng(seed).spawn(len(NORMAL_FORCES))
    logs = [
        tangential_ramp(
            friction=friction,
            normal_force=force,
            marker_noise=MARKER_NOISE,
            force_noise=FORCE_NOISE,
            seed=generator,
        )
        for force, generator in zip(NORMAL_FORCES, generators, strict=True)
    ]
    return [collect_samples(log, detect_slip(log, method=detector)) for log in logs]


def findings(seeds: int) -> Iterator[Finding]:
    """Every combination of detector, friction, seed and estimator."""
    for detector in DETECTORS:
        for friction in FRICTION:
            for seed in range(seeds):
                samples = ramp_samples(friction, detector, seed)
                for estimator in ESTIMATORS:
                    yield _find(detector, estimator, friction, seed, samples)


def _find(detector: str, estimator: str, friction: float, seed: int, samples: list[FrictionSamples]) -> Finding:
    count = sum(map(len, samples))
    try:
        model = fit(samples, method=estimator, seed=seed)
    except EstimatorError:
        return Finding(detector, estimator, friction, seed, count, None, None, None)
    low, high = model.interval(0.95)[0]
    return Finding(detector, estimator, friction, seed, count, float(model.coefficients[0]), float(low), float(high))


def markdown(found: list[Finding]) -> str:
    """A table of medians over the seeds."""
    lines = [
        "| detector | estimator | true β₀ | found β₀ (median) | 95 % interval (median) | error | truth inside |",
        "|---|---|---|---|---|---|---|",
    ]
    for detector in DETECTORS:
        for estimator in ESTIMATORS:
            for friction in FRICTION:
                rows = [f for f in found if (f.detector, f.estimator, f.friction) == (detector, estimator, friction)]
                lines.append(_row(rows))
    return "\n".join(lines)


def _row(rows: list[Finding]) -> str:
    first, fitted = rows[0], [r for r in rows if r.estimate is not None]
    head = f"| {first.detector} | {first.estimator} | {first.friction:g} "
    if not fitted:
        return head + "| refused | | | |"
    middle = [float(np.median([getattr(r, name) for r in fitted])) for name in ("estimate", "low", "high")]
    error = float(np.median([r.relative_error for r in fitted]))
    inside = sum(r.covered for r in rows)
    return head + (f"| {middle[0]:.4f} | {middle[1]:.4f} … {middle[2]:.4f} | {error:+.2%} | {inside} of {len(rows)} |")


def picture(found: list[Finding]) -> Figure:
    """Relative error of β₀ with its interval, one column a detector and estimator."""
    figure = Figure(figsize=(13, 3.6), layout="constrained")
    panels = [(d, e) for d in DETECTORS for e in ESTIMATORS]
    for axes, (detector, estimator) in zip(figure.subplots(1, len(panels), sharey=True), panels, strict=True):
        rows = [f for f in found if (f.detector, f.estimator) == (detector, estimator) and f.estimate is not None]
        for k, row in enumerate(rows):
            ends = [100 * (end / row.friction - 1) for end in (row.low, row.high) if end is not None]
            color = f"C{FRICTION.index(row.friction)}"
            axes.plot([k, k], ends, color=color, linewidth=1)
            axes.plot(k, 100 * row.relative_error, ".", color=color, markersize=3)
        axes.axhline(0.0, color="0.2", linewidth=0.8)
        axes.axhspan(-2, 2, color="0.9", zorder=0)
        axes.set(title=f"{detector}, {estimator}", xticks=())
        axes.title.set_fontsize(9)
    figure.axes[0].set_ylabel("error of β₀ [%] (band: ±2 %)")
    figure.supxlabel(f"seeds; colours: true β₀ = {', '.join(map(str, FRICTION))}", fontsize=9)
    return figure


def main() -> None:
    """Run, print, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("benchmarks/results"))
    parser.add_argument("--seeds", type=int, default=20)
    arguments = parser.parse_args()
    found = list(findings(arguments.seeds))
    arguments.output.mkdir(parents=True, exist_ok=True)
    (arguments.output / "known_truth.json").write_text(json.dumps([asdict(f) for f in found], indent=1))
    picture(found).savefig(arguments.output / "known_truth.png", dpi=110)
    print(markdown(found))


if __name__ == "__main__":
    main()
