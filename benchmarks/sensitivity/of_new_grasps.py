"""What is measured of all that is told of new grasps: recognition, alarms, the next grasp, other materials, sensors."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

import estimators
from benchmarks.estimators import change_alarm as of_alarms
from benchmarks.estimators.recognition import SIZES, material
from benchmarks.estimators.recognition import grasp as grasp_of
from benchmarks.estimators.scatter import KINDS, WORKING_POINT, grasp
from benchmarks.estimators.several_sensors import material as of_sensors
from benchmarks.sensitivity.measures import summary
from benchmarks.sensitivity.rows import Known, Row, of_tables
from estimators import change_alarm, change_detector, grasp_design, influence, population, recognition
from estimators import defaults as of_estimators
from slipcore.samples import FrictionSamples

MATERIALS, GRASPS, TRIALS = 6, 6, 60
STRANGERS = 12
"""Of the trials, those of a material that is not among them."""
SERIES, QUIET, BEFORE, AFTER = 8, 60, 10, 20
"""Series of grasps; grasps of one without a change; before a change, and after it."""
BETWEEN = 0.07
"""Scatter between grasps, that which is expected of a material."""


@cache
def trials() -> tuple[dict[str, estimators.FrictionModel], list[tuple[str, FrictionSamples]]]:
    """Models of some materials, and grasps of these and of others, each with the true answer."""
    rng = np.random.default_rng(29)
    truths = [material(rng) for _ in range(MATERIALS)]
    fits = [estimators.fit([grasp_of(*truth, 60, rng) for _ in range(GRASPS)], "hierarchical") for truth in truths]
    asked = []
    for number in range(TRIALS):
        k, size = number % MATERIALS, SIZES[number % len(SIZES)]
        known = number >= STRANGERS
        asked.append(
            (f"{k}" if known else recognition.UNKNOWN, grasp_of(*(truths[k] if known else material(rng)), size, rng))
        )
    return {f"{k}": model for k, model in enumerate(fits)}, asked


def recognised() -> dict[str, float]:
    """Mean log probability of the true answer, and part of answers that are right."""
    known, asked = trials()
    told = [(truth, recognition.recognise(seen, known)) for truth, seen in asked]
    score = np.mean([np.log(max(answer[truth], 1e-12)) for truth, answer in told])
    return {"log score": float(score), "right": float(np.mean([max(a, key=a.__getitem__) == t for t, a in told]))}


def alarmed() -> dict[str, float]:
    """Grasps until a drop of friction by a fifth is found, and the sum of evidence where nothing changes, in logarithms
    of their means."""
    late, quiet = [], []
    for seed, kind in enumerate(of_alarms.KINDS * (SERIES // 2)):
        rng = np.random.default_rng([seed, 29])
        still = change_alarm.ChangeAlarm.init()
        for level in of_alarms.levels(kind, BETWEEN, QUIET, rng):
            still = still.step(float(level), of_alarms.ERROR**2)
        quiet.append(still.e_detector)
        late.append(_found(of_alarms.levels(kind, BETWEEN, BEFORE + AFTER, rng)))
    return {"delay": float(np.log(np.mean(late))), "evidence of none": float(np.log(np.mean(quiet)))}


def _found(levels: Sequence[float]) -> int:
    """Grasps from a drop to the alarm."""
    alarm = change_alarm.ChangeAlarm.init()
    for count, level in enumerate(levels):
        alarm = alarm.step(float(level) * (1.0 - of_alarms.DROP * (count >= BEFORE)), of_alarms.ERROR**2)
        if alarm.changed and count >= BEFORE:
            return count - BEFORE + 1
    return AFTER + 1


@cache
def plain() -> estimators.FrictionModel:
    """Of one law without scatter between grasps."""
    rng = np.random.default_rng(31)
    return estimators.fit([_plain(0.0, 2000, rng)], "conjugate")


def _plain(offset: float, count: int, rng: np.random.Generator) -> FrictionSamples:
    seen = grasp_of(np.array([0.4, 2.0, -0.8]), 0.02, count, rng)
    return replace(seen, friction_coefficient=seen.friction_coefficient + offset)


def watched() -> dict[str, float]:
    """Samples until a shift by one or by three of their deviations is found, and the greatest e-value without one, in
    logarithms of their means."""
    late, quiet = [], []
    for seed in range(SERIES):
        rng = np.random.default_rng([seed, 31])
        late += [_noticed(_plain(offset, 400, rng)) for offset in (-0.02, 0.06)]
        detector, most = change_detector.ChangeDetector(plain()), 0.0
        for row in _rows(_plain(0.0, 400, rng)):
            detector = detector.step(*row)
            most = max(most, detector.e_value)
        quiet.append(most)
    return {"delay": float(np.log(np.mean(late))), "evidence of none": float(np.log(np.mean(quiet)))}


def _rows(seen: FrictionSamples) -> list[tuple[float, float, float]]:
    columns = (seen.tangential_velocity, seen.normal_force, seen.friction_coefficient)
    return [(float(v), float(f), float(mu)) for v, f, mu in zip(*columns, strict=True)]


def _noticed(seen: FrictionSamples) -> int:
    detector = change_detector.ChangeDetector(plain())
    for count, row in enumerate(_rows(seen)):
        detector = detector.step(*row)
        if detector.changed:
            return count + 1
    return len(seen) + 1


@cache
def few() -> estimators.FrictionModel:
    """Of three grasps."""
    rng = np.random.default_rng(37)
    return estimators.fit([grasp(KINDS["grasp and place"], rng) for _ in range(3)], "hierarchical")


def probed() -> dict[str, float]:
    """The grasp to record next, and what it leaves of the uncertainty, in logarithms."""
    asked = grasp_design.WorkingPoint(normal_force=WORKING_POINT[1], tangential_velocity=WORKING_POINT[0])
    told = grasp_design.next_grasp(few(), asked, grasp_design.Probing(load=1.0))
    names = ("normal_force", "speed", "slip_length", "after")
    return {name.replace("_", " "): float(np.log(getattr(told, name))) for name in names}


@cache
def others() -> list[estimators.FrictionModel]:
    """Models of eight materials, one of which scatters much more."""
    rng = np.random.default_rng(41)
    spreads = (0.03, 0.04, 0.05, 0.05, 0.06, 0.07, 0.08, 0.3)
    kinds = [replace(KINDS["grasp and place"], between_grasps=spread) for spread in spreads]
    return [
        estimators.fit([grasp(kind, rng) for _ in range(4 + k % 3)], "hierarchical") for k, kind in enumerate(kinds)
    ]


def expected() -> dict[str, float]:
    """The prior for another material: its scale and its degrees of freedom, in logarithms."""
    prior = population.population_scatter(others())
    return {"scale": float(np.log(prior.scale)), "degrees of freedom": float(np.log(prior.degrees_of_freedom))}


@cache
def by_sensors() -> list[list[estimators.Moments]]:
    """Materials recorded by three sensors that differ by a tenth, by two that agree, and without velocities."""
    rng = np.random.default_rng(43)
    hidden = [replace(seen, velocity_is_relative=np.ones(len(seen), bool)) for seen in
              (grasp(KINDS["grasp and place"], rng) for _ in range(4))]  # fmt: skip
    known = [of_sensors(3, 0.1, 3, rng), of_sensors(2, 0.0, 2, rng)]
    return [*known, [estimators.Moments.from_samples(seen) for seen in hidden]]


def apart() -> dict[str, float]:
    """Error of friction at working points and width of its interval, of several sensors and of unknown velocities."""
    return summary(estimators.fit(data, "hierarchical") for data in by_sensors())


@cache
def with_an_odd_one() -> tuple[estimators.FrictionModel, list[estimators.Moments]]:
    """Six grasps, one of which lies far below the others, and their model."""
    rng = np.random.default_rng(47)
    seen = [grasp(KINDS["grasp and place"], rng) for _ in range(6)]
    friction = 0.6 * seen[3].friction_coefficient
    seen[3] = replace(seen[3], friction_coefficient=friction, tangential_force=friction * seen[3].normal_force)
    moments = [estimators.Moments.from_samples(each) for each in seen]
    return estimators.fit(moments, "hierarchical"), moments


def lowered() -> dict[str, float]:
    """What a planner may count on without the grasp that leaves it less, over what it may with it, in a logarithm."""
    model, moments = with_an_odd_one()
    found = influence.most_lowering(model, moments, grasp_design.WorkingPoint(normal_force=WORKING_POINT[1]))
    return {"without it": 0.0 if found is None else float(np.log(found.without / found.friction))}


OF_SENSORS = (
    *(f"GRID.{name}" for name in ("beside_gains", "block_bytes", "gain_nodes", "least_gain")),
    *(f"PRIOR.{name}" for name in ("sensor_degrees_of_freedom", "sensor_scatter")),
    *(f"PRIOR.{name}" for name in ("unknown_velocity", "velocity_effect", "velocity_tilt")),
    "IDENTIFIABILITY.compared",
)
MEASURES = {
    "recognition": (("RECOGNITION",), recognised),
    "alarm": (("ALARM",), alarmed),
    "change of samples": (("CHANGE",), watched),
    "next grasp": (("DESIGN",), probed),
    "other materials": (("POPULATION",), expected),
    "sensors": (OF_SENSORS, apart),
    "weakening grasp": (("INFLUENCE",), lowered),
}
"""By part, which defaults are changed, and what is looked at."""


def part_of(name: str) -> Callable[[Known], list[Row]]:
    """What measures a part."""
    names, measure = MEASURES[name]
    return lambda known: of_tables(of_estimators, names, measure, known)
