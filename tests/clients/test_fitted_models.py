"""A model that was fitted here, without a service, is taken wherever one of a service is."""

from collections.abc import Callable
from dataclasses import fields
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
    known = {each.name: getattr(fitted, each.name) for each in fields(fitted) if each.name != "draws"}
    ask = QUESTIONS[question]
    assert ask(fitted) == ask(FrictionModel(material="felt", version=1, **known))


def test_a_fitted_model_that_shows_nothing_is_refused_by_name() -> None:
    alone = estimators.fit(make_samples(n=60), method="ols")
    with pytest.raises(InvalidArgument, match=r"^friction of the surface is not identified \("):
        conservative_friction(alone, 0.06)
