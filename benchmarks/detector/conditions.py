"""What becomes of the filter's scores when a sensor is not at its best; part of `python -m benchmarks.detector`.

Scenes of the set ``scoring`` with forces, 1 µm and 2 mN of noise, changed in one way at a time. Other frame rates and
speeds are simulated anew, a few scenes of them.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from benchmarks.detector.accuracy import FORCE_NOISE, score
from benchmarks.detector.scenes import Case, cases, observed, phases, scoring, simulated
from service.slip_benchmark.faults import dropped
from slipcore import GraspLog, detect_slip
from slipcore.contact.effects import SensorSampling
from slipcore.contact.scene import Scene

MARKER_NOISE = 1e-6
FAST_SCENES = ("quick pull", "swing", "grip loosens")
"""Simulated at other frame rates: fast, reversed, and with a falling normal force."""


def outliers(log: GraspLog, rng: np.random.Generator) -> GraspLog:
    """One marker in a hundred is off by 50 µm in every frame, another one each time."""
    wild = rng.random(log.displacement.shape[:3]) < 0.01
    return replace(
        log, displacement=log.displacement + wild[..., None] * 5e-5 * rng.standard_normal(log.displacement.shape)
    )


def drift(log: GraspLog, _: np.random.Generator) -> GraspLog:
    """All markers drift by 10 µm/s along x."""
    return replace(
        log, displacement=log.displacement + 1e-5 * log.time[:, None, None, None] * np.array([1.0, 0.0, 0.0])
    )


def retimed(factor: float) -> Callable[[GraspLog, np.random.Generator], GraspLog]:
    """Speed and frame rate, both ``factor`` times as great."""
    return lambda log, _: replace(log, time=log.time / factor)


CHANGES: dict[str, Callable[[GraspLog, np.random.Generator], GraspLog]] = {
    "as it is": lambda log, _: log,
    "a tenth of the frames dropped": dropped(0.1),
    "1 % of the markers off by 50 µm": outliers,
    "drift of 10 µm/s": drift,
    "a tenth of the speed and frame rate": retimed(0.1),
    "ten times the speed and frame rate": retimed(10.0),
}


def at_rate(scene: Scene, rate: float) -> Case:
    """A scene at another frame rate."""
    sampling, *effects = scene.effects
    assert isinstance(sampling, SensorSampling)
    log = simulated(replace(scene, effects=(replace(sampling, frame_rate=rate), *effects)))
    return Case(scene.name, log, phases(log))


def measure(inputs: str = "force") -> Iterator[tuple[str, str, float]]:
    """Condition, set of scenes, and mean F1 of the filter over them."""
    slipping = [case for case in cases("scoring") if not case.name.startswith("press")]
    for name, change in CHANGES.items():
        changed = []
        for seed, case in enumerate(slipping):
            log = change(case.log, np.random.default_rng(seed))
            changed.append(Case(case.name, log, phases(log)))
        yield name, "all", mean_score(changed, inputs)
    few = [scene for scene in scoring() if scene.name in FAST_SCENES]
    for rate in (30.0, 120.0, 1000.0):
        yield f"{rate:.0f} frames a second", "three", mean_score([at_rate(scene, rate) for scene in few], inputs)
    slow = [at_rate(scene, 300.0) for scene in few]
    slow = [replace(case, log=replace(case.log, time=10.0 * case.log.time)) for case in slow]
    yield "a tenth of the speed at 30 frames a second", "three", mean_score(slow, inputs)


def mean_score(changed: list[Case], inputs: str) -> float:
    """Mean F1 of the filter over scenes, with noise."""
    logs = [(case, observed(case.log, MARKER_NOISE, FORCE_NOISE, inputs, seed=5)) for case in changed]
    return float(np.mean([score(case, log, detect_slip(log, "filter")).f1 for case, log in logs]))


def table(rows: list[tuple[str, str, float]]) -> str:
    """A table in Markdown."""
    lines = ["| condition | scenes | F1 |", "|---|---|---|"]
    return "\n".join([*lines, *(f"| {name} | {scenes} | {f1:.3f} |" for name, scenes, f1 in rows)])
