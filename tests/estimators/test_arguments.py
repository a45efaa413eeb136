"""What is of a wrong kind or out of its range is named by each public function, with what is allowed."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import estimators
from estimators import ChangeAlarm, ChangeDetector, FrictionModel, InvalidSamples, Probing, ScatterPrior, WorkingPoint
from estimators.change_alarm import noticeable
from slipcore.samples import FrictionSamples
from tests.estimators.conftest import make_samples

WRONG = ["text", True, ["a", "b"], [[1.0], [1.0, 2.0]], object(), {}, 1j, np.ma.masked, np.array("x"), math.nan, -1]
"""Of these no number takes any, and no choice."""
NO_COUNTS = [*WRONG, None, 2.5]
NO_NUMBERS = [*WRONG, None]


@pytest.fixture(scope="module")
def grasps() -> list[FrictionSamples]:
    return [make_samples(60, seed=seed) for seed in range(4)]


@pytest.fixture(scope="module")
def model(grasps: list[FrictionSamples]) -> FrictionModel:
    return estimators.fit(grasps, method="hierarchical")


def refused(call: Callable[..., object], name: str, values: list[Any], **given: Any) -> None:
    """Asserts that a call with each of the values in the place of the argument of that name names it."""
    for value in values:
        with pytest.raises(InvalidSamples) as error:
            call(**{**given, name: value})
        assert name in error.value.name, (name, value)
        assert error.value.allowed, (name, value)


@pytest.mark.parametrize("method", ["ols", "robust"])
def test_options_of_a_fit(grasps: list[FrictionSamples], method: str) -> None:
    given = {"samples": grasps, "method": method}
    refused(estimators.fit, "method", NO_NUMBERS, **given)
    refused(estimators.fit, "seed", NO_COUNTS, **given)
    refused(estimators.fit, "loss", NO_NUMBERS, **given)
    refused(estimators.fit, "accuracy", WRONG, **given)
    refused(estimators.fit, "seconds", WRONG, **given)
    refused(estimators.fit, "likelihood", WRONG, **given)
    refused(estimators.fit, "scatter_prior", WRONG, **given)
    refused(estimators.needs_samples, "method", NO_NUMBERS, grasps=1)
    refused(estimators.needs_samples, "grasps", NO_COUNTS, method="ols")


def test_a_working_point() -> None:
    for name in ("normal_force", "tangential_velocity", "quantile"):
        refused(WorkingPoint, name, [*NO_NUMBERS, math.inf], normal_force=1.0)
    refused(WorkingPoint, "elements", [*NO_COUNTS, 0, math.inf], normal_force=1.0)
    refused(WorkingPoint, "quantile", [0.0, 0.5, 1.0], normal_force=1.0)


def test_what_a_robot_can_do() -> None:
    refused(Probing, "normal_force", [*WRONG, (1.0,), (2.0, 1.0), (0.0, 1.0), ("a", "b"), (1.0, math.inf)])
    for name in ("speed", "length"):
        refused(Probing, name, [*NO_NUMBERS, (), (0.0,), ("a",), (True,), 1e-3])
    for name in ("seconds", "frame_rate", "load", "drop_probability", "slipping", "force_spread", "velocity_spread"):
        refused(Probing, name, [*NO_NUMBERS, math.inf])


def test_what_a_next_grasp_is_asked_for(model: FrictionModel) -> None:
    given = {"model": model, "working_point": WorkingPoint(0.05)}
    for name in ("model", "working_point"):
        refused(estimators.next_grasp, name, NO_NUMBERS, **given)
    refused(estimators.next_grasp, "probing", WRONG, **given)
    refused(estimators.next_grasp, "grasps", NO_COUNTS, **given)


def test_what_materials_are_told_apart_by(model: FrictionModel, grasps: list[FrictionSamples]) -> None:
    given = {"samples": grasps[0], "materials": {"felt": model}}
    refused(estimators.recognise, "materials", NO_NUMBERS, **given)
    refused(estimators.recognise, "prior", [*WRONG, {"felt": 0.0}, {"felt": "1"}, {"felt": True}], **given)
    refused(estimators.recognise, "unknown", [*NO_NUMBERS, 1.0], **given)
    with pytest.raises(InvalidSamples, match="model of felt is 3; allowed: FrictionModel"):
        estimators.recognise(grasps[0], {"felt": 3})  # type: ignore[dict-item]


def test_priors_and_alarms(model: FrictionModel) -> None:
    refused(estimators.population_scatter, "models", [*(value for value in NO_NUMBERS if value != {}), model])
    refused(ScatterPrior, "scale", [*NO_NUMBERS, 0.0])
    refused(ScatterPrior, "degrees_of_freedom", NO_NUMBERS)
    refused(ScatterPrior, "materials", NO_COUNTS)
    refused(ChangeAlarm.init, "rate", [*NO_NUMBERS, 0.0, 1.0])
    refused(ChangeAlarm.init, "shift", NO_NUMBERS)
    refused(ChangeAlarm.init, "reference", NO_COUNTS)
    refused(ChangeAlarm.init().step, "level", [value for value in NO_NUMBERS if value != -1], variance=0.1)
    refused(ChangeAlarm.init().step, "variance", NO_NUMBERS, level=1.0)
    refused(noticeable, "grasps", NO_COUNTS, alarm=ChangeAlarm.init().step(1.0, 0.1))


def test_a_detector_of_changes(model: FrictionModel) -> None:
    refused(ChangeDetector, "model", NO_NUMBERS)
    refused(ChangeDetector, "alarm", [*NO_NUMBERS, 0.0, 1.0], model=model)
    refused(ChangeDetector, "spread", NO_NUMBERS, model=model)
    refused(ChangeDetector, "reset_after", NO_COUNTS, model=model)
    sample = {"tangential_velocity": 1e-3, "normal_force": 0.05, "friction_coefficient": 0.4}
    for name in sample:
        refused(ChangeDetector(model).step, name, [value for value in NO_NUMBERS if value != -1], **sample)


def test_a_point_at_which_friction_is_asked_for(model: FrictionModel) -> None:
    for name in ("tangential_velocity", "normal_force"):
        refused(model.predict, name, NO_NUMBERS, tangential_velocity=1e-3, normal_force=0.05)
    asked = {"tangential_velocity": 1e-3, "normal_force": 0.05, "of": "contact"}
    refused(model.predict, "elements", [*NO_NUMBERS, 0.0, 0.5, math.inf], **asked)
    refused(model.predict, "of", NO_NUMBERS, **asked)
    refused(model.predict, "quantile", [*WRONG, 0.0, 1.0], **(asked | {"elements": 3}))
