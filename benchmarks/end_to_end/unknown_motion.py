"""Friction found where the object's motion is not recorded: `python -m benchmarks.end_to_end.unknown_motion`.

Grasps of the reduced world (bristles on an elastic half-space), moved at 0.5 to 3 mm/s until all slides, whose friction
follows μ = β₀ + β₁ v + β₂ f_n with scatter between grasps and between places. β₁ differs from seed to seed. Each log is
detected and sampled with the object's motion and without it; how often do intervals hold the truth?
Prints a Markdown table, writes JSON.
"""

import argparse
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from benchmarks.detector.scenes import PITCH
from benchmarks.end_to_end.known_truth import FORCE_NOISE, MARKER_NOISE
from estimators import FrictionModel, fit
from slipcore import LOOKAHEAD, FrictionSamples, GraspLog, collect_samples, detect_slip
from slipcore.contact.effects import SensorSampling
from slipcore.contact.reduced import World, WorldState, init, observe
from slipcore.contact.reduced.kernel import relax

FloatArray = NDArray[np.float64]

LEVEL, SLOPE = 0.45, -0.8
"""β₀ [-] and β₂ [1/N]."""
VELOCITY_SLOPES = (0.0, 3.0, 6.0, 9.0)
"""β₁ [s/m] of one seed after the other; below 0 sliding would be unstable, and quasi-static steps wrong."""
BETWEEN_GRASPS, BETWEEN_PLACES = 0.03, 0.02
"""Standard deviations: a part of friction, and a coefficient."""
GRASPS = ((5.0, 1.0), (7.0, 3.0), (9.0, 0.5), (11.0, 2.0), (13.0, 1.5))
"""Normal force, N, and speed of the object, mm/s."""
SAMPLING = SensorSampling((20, 20), PITCH, 30.0)
SECONDS, STEPS = 2.0, 1200.0
"""Length of a grasp, and steps of the physics in a second."""
RELAXED = 0.075
"""Part of a step's slip that its speed takes up: friction that changes at once with speed would chatter."""
METHODS = ("auto", "ols", "bayes")
CONDITIONS = ("known", "known for three of five", "unknown", "unknown, taken for known")
"""Of the object's motion; in the last, velocities relative to what seems to stick count as the object's own."""
FORCE = 0.08
"""N an element, of the planner's working point, at rest."""


@dataclass(frozen=True, slots=True)
class Law:
    """Friction of a grasp: coefficients [3], and the ``scatter`` [n, m] that its places add."""

    coefficients: FloatArray
    scatter: FloatArray

    def __call__(self, speed: FloatArray, normal_force: FloatArray) -> FloatArray:
        """Coefficient of friction [n, m]."""
        level, velocity, force = self.coefficients
        return np.maximum(level + velocity * speed + force * normal_force + self.scatter, 0.05)


def grasp_log(
    law: Law,
    normal_force: float,
    speed: float,
    rng: np.random.Generator | None = None,
    sampling: SensorSampling = SAMPLING,
) -> GraspLog:
    """A log of an object that is pressed with ``normal_force`` N and drawn along x, then aside, at ``speed`` m/s.

    Without ``rng`` there is no noise.
    """
    world = World(
        friction=np.ones((1, *sampling.points)),
        sampling=sampling,
        marker_noise=MARKER_NOISE,
        force_noise=FORCE_NOISE,
    )
    state = init(world, normal_force)
    pressing = observe(world, state).force
    assert pressing is not None
    normal, slipping = -pressing[..., 2], np.zeros(sampling.points)
    interval, steps = 1.0 / STEPS, round(STEPS / sampling.frame_rate)
    frames, poses = [], []
    for count in range(round(SECONDS / interval)):
        if count % steps == 0:
            frames.append(observe(world, state, generator=rng))
            poses.append(state.pose[:3])
        after = _dragged(world, state, law(slipping, normal) * normal, _pose(speed, state.time + interval), interval)
        moved = np.nan_to_num(after.offset[0] - state.offset[0])
        slipping += RELAXED * (np.hypot(*np.moveaxis(moved, -1, 0)) / interval - slipping)
        state = after
    return GraspLog(
        time=np.array([frame.time for frame in frames]),
        position=world.position,
        displacement=np.stack([frame.displacement for frame in frames]),
        normal=np.broadcast_to([0.0, 0.0, 1.0], (len(frames), *world.position.shape)).copy(),
        element_area=world.element_area,
        force=np.stack([frame.force for frame in frames if frame.force is not None]),
        object_pose=np.stack(poses),
    )


def _pose(speed: float, time: float) -> FloatArray:
    """Where the object is: along x for three quarters of the time, then across."""
    turn = 0.75 * SECONDS
    return np.array([speed * min(time, turn), speed * max(time - turn, 0.0), 0.0])


def _dragged(world: World, state: WorldState, limit: FloatArray, pose: FloatArray, interval: float) -> WorldState:
    """The world ``interval`` s later with its object at ``pose``, by friction ``limit`` [n, m] N."""
    force, offset, slip = (part[0].reshape(limit.size, -1).copy() for part in (state.force, state.offset, state.slip))
    slips = slip[:, 0]
    relax(state.pad, limit.ravel(), pose, force, offset, slips, world.sweeps)
    fields = {"force": force, "offset": offset, "slip": slips}
    shaped = {name: field.reshape(getattr(state, name).shape) for name, field in fields.items()}
    return state._replace(time=state.time + interval, pose=np.concatenate([pose, np.zeros(3)]), **shaped)


def grasps(seed: int) -> tuple[FloatArray, list[GraspLog]]:
    """The law [3] of a seed's material, and its grasps."""
    coefficients = np.array([LEVEL, VELOCITY_SLOPES[seed % len(VELOCITY_SLOPES)], SLOPE])
    logs = []
    for (force, speed), rng in zip(GRASPS, np.random.default_rng(seed).spawn(len(GRASPS)), strict=True):
        factor = 1.0 + BETWEEN_GRASPS * rng.standard_normal()
        law = Law(factor * coefficients, BETWEEN_PLACES * rng.standard_normal(SAMPLING.points))
        logs.append(grasp_log(law, force, 1e-3 * speed, rng))
    return coefficients, logs


def collected(log: GraspLog, *, known: bool) -> FrictionSamples:
    """Samples of a log, detected with the object's motion or without."""
    given = log if known else replace(log, object_pose=None)
    return collect_samples(given, detect_slip(given, lookahead=LOOKAHEAD))


@dataclass(frozen=True, slots=True)
class Finding:
    """One fit: truth, estimate and half-width of the 95 % interval of β₀, β₁, β₂ and of μ at the working point."""

    condition: str
    method: str
    seed: int
    truth: list[float]
    estimate: list[float]
    half_width: list[float]
    identifiable: list[bool]


def findings(seeds: Sequence[int], methods: Sequence[str] = METHODS) -> Iterator[Finding]:
    """Each seed's grasps under every condition and method."""
    for seed in seeds:
        truth, logs = grasps(seed)
        known, unknown = ([collected(log, known=given) for log in logs] for given in (True, False))
        trusted = [replace(each, velocity_is_relative=np.zeros(len(each), bool)) for each in unknown]
        for condition, samples in zip(CONDITIONS, (known, known[:3] + unknown[3:], unknown, trusted), strict=True):
            for method in methods:
                yield _finding(fit(samples, method=method, seed=seed), truth, condition, method, seed)


def _finding(model: FrictionModel, truth: FloatArray, condition: str, method: str, seed: int) -> Finding:
    at = np.array([1.0, 0.0, FORCE])
    low, high = model.interval(0.95).T
    half = stats.t.ppf(0.975, model.degrees_of_freedom) * np.sqrt(at @ model.covariance @ at)
    return Finding(
        condition,
        method,
        seed,
        [*truth.tolist(), float(at @ truth)],
        [*model.coefficients.tolist(), float(at @ model.coefficients)],
        [*(0.5 * (high - low)).tolist(), float(half)],
        model.identifiable.tolist(),
    )


def markdown(found: Sequence[Finding]) -> str:
    """Coverage, error and width of each coefficient and of μ."""
    names = ("β₀", "β₁, s/m", "β₂, 1/N", f"μ at {FORCE:g} N")
    lines = [
        "| object's motion | method | quantity | mean error | scatter | half-width (median) | truth inside "
        "| identifiable |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for condition, method in dict.fromkeys((f.condition, f.method) for f in found):
        rows = [f for f in found if (f.condition, f.method) == (condition, method)]
        error = np.array([np.subtract(f.estimate, f.truth) for f in rows])
        half = np.array([f.half_width for f in rows])
        inside = np.mean(np.abs(error) <= half, axis=0)
        identified = [*np.mean([f.identifiable for f in rows], axis=0), None]
        for k, name in enumerate(names):
            known = "" if identified[k] is None else f"{identified[k]:.0%}"
            lines.append(
                f"| {condition} | {method} | {name} | {error[:, k].mean():+.2g} | {error[:, k].std():.2g} "
                f"| {np.median(half[:, k]):.2g} | {inside[k]:.0%} of {len(rows)} | {known} |"
            )
    return "\n".join(lines)


def main() -> None:
    """Run, print, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("benchmarks/results"))
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--first", type=int, default=1000, help="the first seed")
    arguments = parser.parse_args()
    found = list(findings(range(arguments.first, arguments.first + arguments.seeds)))
    arguments.output.mkdir(parents=True, exist_ok=True)
    (arguments.output / "unknown_motion.json").write_text(json.dumps([asdict(f) for f in found], indent=1))
    print(markdown(found))


if __name__ == "__main__":
    main()
