"""A model that was fitted here, without a service, is taken wherever one of a service is."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import estimators
from stiction_client import (
    Contact,
    ControlSettings,
    FrictionModel,
    GraspController,
    InvalidArgument,
    Observation,
    conservative_friction,
    drake_friction,
    mujoco_pair,
    physx_material,
    required_normal_force,
)
from tests.estimators.conftest import make_samples

PAD = Contact.flat(6e-5)
SETTINGS = ControlSettings(contact=PAD, least_force=0.5, most_force=30.0)
QUESTIONS: dict[str, Callable[[Any], object]] = {
    "a plan": lambda model: required_normal_force(model, 1.0, 0.01, contacts=PAD),
    "plans": lambda model: required_normal_force(model, np.ones(2), 0.01, contacts=PAD).normal_force.tolist(),
    "a number": lambda model: conservative_friction(model, 0.06),
    "MuJoCo": lambda model: mujoco_pair(model, ("finger", "box"), 4.0, PAD),
    "Drake": lambda model: drake_friction(model, 0.06),
    "PhysX": lambda model: physx_material(model, 0.06),
    "a grip": lambda model: GraspController.step(GraspController.init(SETTINGS, model), Observation(0.1, 2.0, 0.8))[1],
    "a recognition": lambda model: GraspController.init(SETTINGS, materials={"felt": model}).recognition is not None,
}


@pytest.fixture(scope="module")
def fitted() -> estimators.FrictionModel:
    grasps = [make_samples(seed=seed, offset=offset) for seed, offset in enumerate((0.0, 0.02, -0.02, 0.01, -0.01))]
    return estimators.fit(grasps, method="hierarchical")


@pytest.mark.parametrize("question", QUESTIONS)
def test_a_fitted_model_is_answered_as_the_same_one_of_a_service(
    fitted: estimators.FrictionModel, question: str
) -> None:
    ask = QUESTIONS[question]
    assert ask(fitted) == ask(FrictionModel.of(fitted, "felt"))


def test_a_fitted_model_can_be_saved_by_a_name(fitted: estimators.FrictionModel, tmp_path: Path) -> None:
    odd = replace(fitted, diagnostics={**fitted.diagnostics, "condition_number": math.inf})
    FrictionModel.of(odd, "felt").save(tmp_path / "felt.json")
    again = FrictionModel.load(tmp_path / "felt.json")
    assert (again.material, again.version, again.diagnostics["condition_number"]) == ("felt", 1, None)
    assert QUESTIONS["a plan"](again) == QUESTIONS["a plan"](fitted)


@pytest.mark.parametrize(("wrong", "material", "name"), [("paper", "felt", "fitted"), (None, 3, "material")])
def test_what_is_no_fit_or_no_name_is_refused(
    fitted: estimators.FrictionModel, wrong: Any, material: Any, name: str
) -> None:
    with pytest.raises(InvalidArgument) as refusal:
        FrictionModel.of(wrong or fitted, material)
    assert refusal.value.name == name


def test_a_fitted_model_that_shows_nothing_is_refused_by_name() -> None:
    alone = estimators.fit(make_samples(n=60), method="ols")
    with pytest.raises(InvalidArgument, match=r"^friction of the surface is not identified \("):
        conservative_friction(alone, 0.06)
