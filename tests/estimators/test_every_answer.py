"""What everything keeps to that estimators tell of new grasps beside a fit; a further one comes under these checks by
being in ``ANSWERS``, and no public name can stay away.
"""

import pickle
from collections.abc import Callable, Sequence
from dataclasses import astuple, replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest

import estimators
from estimators import (
    ChangeAlarm,
    ChangeDetector,
    FrictionModel,
    InvalidSamples,
    Moments,
    Probing,
    TooFewSamples,
    WorkingPoint,
    fit,
    grasp_effects,
    next_grasp,
    population_scatter,
    recognise,
)
from estimators.change_alarm import grasp_level, watched
from slipcore.samples import FrictionSamples
from tests.estimators.conftest import make_samples

Grasps = Sequence[FrictionSamples]
AREA = 1e-6


def grasps_of(first: int, count: int, offset: float = 0.0) -> list[FrictionSamples]:
    """Grasps of one material that differ a little; no two share a seed."""
    return [make_samples(60 + 5 * k, first + k, offset=offset + 0.01 * (k % 3 - 1)) for k in range(count)]


@cache
def model_of(area: float, offset: float = 0.0) -> FrictionModel:
    """Of eight grasps, whose elements have this area."""
    return fit(at_area(grasps_of(100, 8, offset), area), "hierarchical")


def at_area(grasps: Grasps, area: float) -> list[FrictionSamples]:
    return [grasp.at_element_area(area) for grasp in grasps]


def level(grasp: FrictionSamples) -> tuple[float, float]:
    return grasp_level(model_of(grasp.element_area), Moments.from_samples(grasp).grasps[0])


def seen_by(detector: ChangeDetector, grasp: FrictionSamples) -> ChangeDetector:
    """After a sample of each of four elements."""
    for k in range(0, len(grasp), max(len(grasp) // 4, 1)):
        detector = detector.step(grasp.tangential_velocity[k], grasp.normal_force[k], grasp.friction_coefficient[k])
    return detector


class Answer(NamedTuple):
    """One public name: ``of`` grasps whose elements have this area, and its numbers.

    ``step``: the same, grasp by grasp, from ``of`` none; ``nothing``: what is raised for no grasps, if they cannot be
    answered; ``in_order``: whether it counts which grasp came first.
    """

    of: Callable[[Grasps, float], Any]
    numbers: Callable[[Any], Any]
    step: Callable[[Any, FrictionSamples], Any] | None = None
    nothing: type[Exception] | None = None
    in_order: bool = False


def folded(answer: Answer, grasps: Grasps, area: float) -> Any:
    """Grasp by grasp."""
    assert answer.step is not None
    state = answer.of([], area)
    for grasp in grasps:
        state = answer.step(state, grasp)
    return state


def of_alarm(grasps: Grasps, area: float) -> ChangeAlarm:
    return watched(model_of(area), [Moments.from_samples(grasp).grasps[0] for grasp in grasps])


def of_detector(grasps: Grasps, area: float) -> ChangeDetector:
    detector = ChangeDetector(model_of(area))
    for grasp in grasps:
        detector = seen_by(detector, grasp)
    return detector


def of_design(grasps: Grasps, area: float) -> Any:
    point = WorkingPoint(tangential_velocity=1e-3, normal_force=0.05 * area / AREA)
    probing = Probing(normal_force=(0.02 * area / AREA, 0.1 * area / AREA))
    return next_grasp(fit(grasps, "hierarchical"), point, probing, grasps=len(grasps))


ANSWERS = {
    "recognise": Answer(
        lambda grasps, area: recognise(grasps, {"one": model_of(area), "other": model_of(area, 0.05)}),
        lambda told: list(told.values()),
        nothing=TooFewSamples,
    ),
    "ChangeAlarm": Answer(
        of_alarm,
        lambda alarm: [*alarm.levels, *alarm.variances, *alarm.e_values, alarm.e_detector, alarm.change],
        lambda alarm, grasp: alarm.step(*level(grasp)),
        in_order=True,
    ),
    "ChangeDetector": Answer(of_detector, lambda detector: [detector.total, detector.count, detector.e_value], seen_by),
    "grasp_effects": Answer(
        lambda grasps, area: grasp_effects(model_of(area), [Moments.from_samples(grasp) for grasp in grasps]),
        lambda effects: sorted(number for each in effects for number in (each.value, *each.interval)),
    ),
    "next_grasp": Answer(
        of_design,
        lambda grasp: [*astuple(grasp)[1:-1]],  # the force is in newtons of an element, and the last a sentence
        nothing=TooFewSamples,
    ),
    "population_scatter": Answer(
        lambda grasps, area: population_scatter([model_of(area), fit(grasps, "hierarchical")]),
        lambda prior: [prior.scale, prior.degrees_of_freedom],
        nothing=TooFewSamples,
    ),
}
ELSEWHERE = {"fit", "needs_samples", "warm_up", "Moments"}
"""Functions, and a record that is fitted, which tests/estimators/test_every_method.py and test_warm_up.py look at."""
RECORDS = {
    "Cost", "Domain", "FrictionModel", "GraspEffect", "NextGrasp", "Probing", "Scale", "Scales", "ScatterPrior",
    "SensorFriction", "SensorScale", "WorkingPoint",
}  # fmt: skip
ERRORS = {"EstimatorError", "InvalidSamples", "NotConverged", "TooFewSamples"}

every = pytest.mark.parametrize("name", ANSWERS)


def test_whatever_is_public_is_checked() -> None:
    assert {*estimators.__all__} == {*ANSWERS} | ELSEWHERE | RECORDS | ERRORS


def numbers(name: str, grasps: Grasps, area: float = AREA) -> np.ndarray:
    return np.array(ANSWERS[name].numbers(ANSWERS[name].of(grasps, area)), dtype=float)


@every
def test_the_same_grasps_have_the_same_answer_to_the_last_bit_and_stay_as_they_were(name: str) -> None:
    grasps = grasps_of(0, 6)
    before = pickle.dumps(grasps)
    np.testing.assert_array_equal(numbers(name, grasps), numbers(name, grasps))
    assert pickle.dumps(grasps) == before


@every
def test_an_answer_survives_pickling(name: str) -> None:
    answer = ANSWERS[name]
    told = answer.of(grasps_of(0, 6), AREA)
    np.testing.assert_array_equal(answer.numbers(pickle.loads(pickle.dumps(told))), answer.numbers(told))


@every
def test_the_order_of_grasps_says_nothing_but_where_it_is_what_is_asked(name: str) -> None:
    grasps = grasps_of(0, 6)
    there, back = numbers(name, grasps), numbers(name, grasps[::-1])
    assert np.allclose(there, back, rtol=1e-6, atol=1e-12) is not ANSWERS[name].in_order


@every
@pytest.mark.parametrize("factor", [0.01, 100.0])
def test_elements_of_another_area_at_the_same_pressure_have_the_same_answer(name: str, factor: float) -> None:
    grasps = grasps_of(0, 6)
    scaled = numbers(name, at_area(grasps, factor * AREA), factor * AREA)
    np.testing.assert_allclose(scaled, numbers(name, grasps), rtol=1e-6, atol=1e-9)  # rounding of other numbers


@every
def test_no_grasps_are_told_nothing_of_or_refused(name: str) -> None:
    expected = ANSWERS[name].nothing
    if expected is None:
        assert set(numbers(name, [])) <= {0.0, 1.0}  # an e-value of 1 speaks neither for a change nor against it
        return
    with pytest.raises(expected):
        numbers(name, [])


@every
def test_a_sample_alone_is_told_something_finite_of_or_refused(name: str) -> None:
    try:
        told = numbers(name, [make_samples(1)])
    except TooFewSamples:
        assert ANSWERS[name].nothing is TooFewSamples
    else:
        assert np.isfinite(told).all()


@every
@pytest.mark.parametrize("column", ["friction_coefficient", "tangential_velocity", "normal_force"])
def test_what_is_no_number_is_refused(name: str, column: str) -> None:
    grasps = grasps_of(0, 6)
    values = getattr(grasps[2], column).copy()
    values[0] = np.nan
    with pytest.raises(InvalidSamples):
        numbers(name, [*grasps[:2], replace(grasps[2], **{column: values}), *grasps[3:]])


@pytest.mark.parametrize("name", [name for name, answer in ANSWERS.items() if answer.step])
@pytest.mark.parametrize("cut", range(7))
def test_grasp_by_grasp_is_as_all_at_once_wherever_it_is_cut(name: str, cut: int) -> None:
    answer, grasps = ANSWERS[name], grasps_of(0, 6)
    assert answer.step is not None
    state = pickle.loads(pickle.dumps(folded(answer, grasps[:cut], AREA)))
    for grasp in grasps[cut:]:
        state = answer.step(state, grasp)
    np.testing.assert_array_equal(answer.numbers(state), numbers(name, grasps))


def test_moments_that_are_merged_are_recognised_as_their_samples() -> None:
    grasps = grasps_of(0, 4)
    stored = [Moments.from_bytes(Moments.from_samples(grasp).to_bytes()) for grasp in grasps]
    np.testing.assert_allclose(numbers("recognise", stored), numbers("recognise", grasps), rtol=1e-6)  # type: ignore[arg-type]
