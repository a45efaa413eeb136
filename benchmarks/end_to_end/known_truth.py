"""Friction found from simulated grasps of known friction: `python -m benchmarks.end_to_end.known_truth`.

Each material is seen in four ramps of different normal force (1 µm marker noise, 2 mN force noise), detected by each
method, fitted by each estimator, over several seeds of the noise. Then grasps whose friction depends on velocity and
normal force and scatters from place to place: how often do intervals hold the truth, with and without the object's
motion? And the same grasps without noise or scatter: what is left of the law? (``--only bias`` prints this alone, in
half a minute.) Writes JSON and pictures, prints Markdown tables.
"""

import argparse
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from benchmarks.detector.scenes import PITCH, simulated
from estimators import EstimatorError, fit
from slipcore import LOOKAHEAD, FrictionSamples, GraspLog, collect_samples, detect_slip
from slipcore.contact import tangential_ramp
from slipcore.contact.effects import ObjectMotion, PressureFriction, SensorSampling, VelocityFriction
from slipcore.contact.scene import Finger, Press, Scene
from slipcore.contact.tiers.boundary_elements import Fidelity

FRICTION = (0.25, 0.45, 0.8)
NORMAL_FORCES = (4.0, 6.0, 9.0, 13.0)
DETECTORS = ("filter", "strain_rate", "strain_rate_literal")
ESTIMATORS = ("ols", "bayes")
LAW_ESTIMATORS = ("auto", *ESTIMATORS)
BIAS_ESTIMATORS = ("ols", "robust", "conjugate", "hierarchical", "bayes", "auto")
MARKER_NOISE, FORCE_NOISE = 1e-6, 2e-3
LAW = (0.45, 8.0, -0.8)
"""β₀, β₁ s/m and β₂ 1/N of the grasps whose friction depends on velocity and normal force."""
SCATTER = 0.03
GRASPS = ((5.0, 1.0), (7.0, 3.0), (9.0, 0.5), (11.0, 2.0), (13.0, 1.5))
"""Normal force, N, and speed of the object, mm/s, of each of these grasps."""


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
    return [collect_samples(log, detect_slip(log, method=detector, lookahead=LOOKAHEAD)) for log in logs]


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


def law_grasps() -> list[GraspLog]:
    """Grasps without noise or scatter: pressed, then moved until all of the contact slides, and on across."""
    return [simulated(_law_scene(force, 1e-3 * speed), Fidelity(24, 1, 1e-4)) for force, speed in GRASPS]


def _law_scene(force: float, speed: float) -> Scene:
    time = (0.4, 1.2, 1.6, 2.2)
    x = (0.0, 0.8 * speed, 1.4 * speed, 1.5 * speed)
    y = (0.0, 0.0, 0.1 * speed, 0.7 * speed)
    sampling, motion = SensorSampling((20, 20), PITCH, 30.0), ObjectMotion(time, x=x, y=y)
    laws = VelocityFriction(LAW[1]), PressureFriction(LAW[2], PITCH**2)
    return Scene(f"law {force:g}", (sampling, *laws, motion), Finger(), LAW[0], Press(force, 0.3), time[-1])


def seen(log: GraspLog, rng: np.random.Generator, *, known_motion: bool) -> GraspLog:
    """The grasp with noise, and with friction that scatters from element to element where they slip."""
    assert log.force is not None
    assert log.truth is not None
    force = log.force.copy()
    scatter = 1.0 + SCATTER / LAW[0] * rng.standard_normal(log.grid)
    force[..., :2] *= np.where(log.truth.slip_contact_factor, scatter, 1.0)[..., None]
    return replace(
        log,
        displacement=log.displacement + MARKER_NOISE * rng.standard_normal(force.shape),
        force=force + FORCE_NOISE * rng.standard_normal(force.shape),
        object_pose=log.object_pose if known_motion else None,
    )


@dataclass(frozen=True, slots=True)
class LawFinding:
    """One fit of the law: estimates and 95 % intervals of β₀, β₁ and β₂, and which the fit says it can tell."""

    known_motion: bool
    estimator: str
    seed: int
    samples: int
    estimate: list[float]
    low: list[float]
    high: list[float]
    identifiable: list[bool]


def law_findings(seeds: int, estimators: tuple[str, ...]) -> Iterator[LawFinding]:
    """Fits to the same grasps with noise and scatter of each seed, with and without the object's motion."""
    grasps = law_grasps()
    for known_motion in (True, False):
        for seed in range(1000, 1000 + seeds):
            logs = [
                seen(log, rng, known_motion=known_motion)
                for log, rng in zip(grasps, np.random.default_rng(seed).spawn(len(grasps)), strict=True)
            ]
            samples = [collect_samples(log, detect_slip(log, "filter", lookahead=LOOKAHEAD)) for log in logs]
            for estimator in estimators:
                model = fit(samples, method=estimator, seed=seed)
                low, high = np.array(model.interval(0.95)).T
                yield LawFinding(
                    known_motion,
                    estimator,
                    seed,
                    sum(map(len, samples)),
                    [float(v) for v in model.coefficients],
                    [float(v) for v in low],
                    [float(v) for v in high],
                    [bool(v) for v in model.identifiable],
                )


@dataclass(frozen=True, slots=True)
class Bias:
    """Errors of β₀, β₁ and β₂ of grasps without noise or scatter, and the largest of μ over the samples' domain."""

    estimator: str
    error: list[float]
    largest: float


def biases(estimators: tuple[str, ...] = BIAS_ESTIMATORS) -> list[Bias]:
    """Fits to the grasps as they are: what detection, samples and methods leave of the law."""
    grasps = law_grasps()
    samples = [collect_samples(log, detect_slip(log, "filter", lookahead=LOOKAHEAD)) for log in grasps]
    return [_bias(estimator, samples) for estimator in estimators]


def _bias(estimator: str, samples: list[FrictionSamples]) -> Bias:
    model = fit(samples, method=estimator, seed=0)
    error = model.coefficients - LAW
    v, f_n = np.meshgrid(model.domain.tangential_velocity, model.domain.normal_force)
    largest = np.abs(error[0] + error[1] * v + error[2] * f_n).max()  # of a plane, at a corner
    return Bias(estimator, [float(each) for each in error], float(largest))


def bias_markdown(found: list[Bias]) -> str:
    """A row a method."""
    lines = ["| estimator | error of β₀ | of β₁, s/m | of β₂, 1/N | largest of μ |", "|---|---|---|---|---|"]
    for each in found:
        b0, b1, b2 = each.error
        lines.append(f"| {each.estimator} | {b0:+.5f} | {b1:+.3f} | {b2:+.4f} | {each.largest:.5f} |")
    return "\n".join(lines)


def law_markdown(found: list[LawFinding]) -> str:
    """Mean and scatter of each coefficient, and how often its interval holds the truth."""
    lines = [
        "| object motion | estimator | samples | coefficient | true | mean found | standard deviation | truth inside |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for known, estimator in dict.fromkeys((f.known_motion, f.estimator) for f in found):
        rows = [f for f in found if (f.known_motion, f.estimator) == (known, estimator)]
        samples = float(np.mean([f.samples for f in rows]))
        for k, (name, truth) in enumerate(zip(("β₀", "β₁, s/m", "β₂, 1/N"), LAW, strict=True)):
            values = np.array([f.estimate[k] for f in rows])
            inside = np.mean([f.low[k] <= truth <= f.high[k] for f in rows])
            lines.append(
                f"| {'known' if known else 'unknown'} | {estimator} | {samples:.0f} | {name} | {truth:g} "
                f"| {values.mean():.4f} | {values.std():.4f} | {inside:.0%} of {len(rows)} |"
            )
    return "\n".join(lines)


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
    parser.add_argument("--seeds", type=int, default=20, help="of the ramps")
    parser.add_argument("--law-seeds", type=int, default=200, help="of the grasps whose friction follows a law")
    parser.add_argument("--only", choices=("bias",), help="the grasps without noise alone")
    arguments = parser.parse_args()
    bias = bias_markdown(biases())
    if arguments.only:
        print(bias)
        return
    found = list(findings(arguments.seeds))
    arguments.output.mkdir(parents=True, exist_ok=True)
    (arguments.output / "known_truth.json").write_text(json.dumps([asdict(f) for f in found], indent=1))
    picture(found).savefig(arguments.output / "known_truth.png", dpi=110)
    print(markdown(found))
    laws = list(law_findings(arguments.law_seeds, LAW_ESTIMATORS))
    (arguments.output / "known_law.json").write_text(json.dumps([asdict(f) for f in laws], indent=1))
    print(law_markdown(laws))
    print(bias)


if __name__ == "__main__":
    main()
