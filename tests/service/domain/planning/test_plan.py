"""How hard to grip and which material it is, as a planner reads the answer."""

import math
from contextlib import nullcontext
from dataclasses import replace
from datetime import UTC, datetime
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import estimators
import stiction_client
from db.records import NewModel, StoredModel
from db.repositories import grasp_logs
from service.domain.errors import InvalidSamples, InvalidValue, NoFeasibleForce, ResultsNotReady
from service.domain.models.model_cache import KnownModel
from service.domain.models.stored_results import to_client_model, to_friction_model
from service.domain.planning import plan
from service.domain.planning.plan import GraspTask
from slipcore import FrictionSamples
from stiction_client import required_normal_force
from tests.service.cli.test_remote import GRIP

TASK = GraspTask(
    material="paper", method="auto", tangential_load=0.5, torque=0.0, contact_area=1e-4, round_at=None, fingers=1,
    object_radius=None, safety_factor=1.0, slip_probability=1e-2, tangential_velocity=0.0, normal_force_limit=None,
    of=None, elements=None,
)  # fmt: skip


def stored(model: NewModel, material: str = "paper", version: int = 3) -> StoredModel:
    return StoredModel(1, material, version, True, False, datetime(2026, 1, 2, tzinfo=UTC), model)


@pytest.fixture
def known(new_model: NewModel) -> KnownModel:
    certain = replace(new_model, covariance=((1e-6, 0.0, 0.0), *new_model.covariance[1:]), scale=0.01)
    each = stored(certain)
    return KnownModel(each, to_friction_model(certain), "tag", 0.0, 1.0, "it is the best")


def context(known: KnownModel, *, fresh: bool = True) -> Any:
    asked: list[tuple[str, str]] = []

    def find(material: str, method: str) -> KnownModel | None:
        asked.append((material, method))
        return known if fresh else None

    models = SimpleNamespace(fresh=find, read=lambda _, material, method: find(material, method) or known)
    return SimpleNamespace(models=models, database=None, asked=asked)


def test_the_force_is_the_planner_s_own_with_whose_model_it_is(known: KnownModel) -> None:
    of_here = context(known)
    told = plan.grasp_force(of_here, TASK)
    own = required_normal_force(to_client_model(known.stored), 0.5, 1e-2, contact_area=1e-4)
    assert (told.normal_force, told.friction_coefficient) == (own.normal_force, own.friction_coefficient)
    assert (told.material, told.method, told.version, told.chosen_because) == ("paper", "ols", 3, "it is the best")
    assert told.warning == own.warning
    assert of_here.asked == [("paper", "auto")]
    assert plan.grasp_force(context(known, fresh=False), TASK) == told


def test_what_has_no_bound_is_none(known: KnownModel, monkeypatch: pytest.MonkeyPatch) -> None:
    endless = replace(GRIP, feasible_interval=(3.0, math.inf), margin=math.inf, largest_load=math.inf)
    for found, told in ((endless, (3.0, None, None, None)), (GRIP, (3.7501, 20.0, 16.25, 5.0))):
        monkeypatch.setattr(stiction_client, "required_normal_force", lambda *_, found=found, **__: found)
        answer = plan.grasp_force(context(known), TASK)
        assert (*answer.feasible_interval, answer.margin, answer.largest_load) == told


def test_methods_that_disagree_are_told_of_beside_the_planner_s_own_warning(known: KnownModel) -> None:
    far = replace(TASK, tangential_load=5.0)
    own = plan.grasp_force(context(known), far).warning
    assert own
    told = plan.grasp_force(context(replace(known, disagreement="robust expects more")), far)
    assert told.warning == f"{own}; robust expects more"


def test_a_load_that_nothing_holds_is_refused_with_what_is(known: KnownModel) -> None:
    with pytest.raises(NoFeasibleForce) as refusal:
        plan.grasp_force(context(known), replace(TASK, tangential_load=50.0, normal_force_limit=10.0))
    facts = refusal.value.facts
    assert set(facts) == {"largest_load", "normal_force", "cause", "largest_observed", "least_slip_probability"}
    assert facts["normal_force"] == 10.0


@pytest.mark.parametrize("use", ["grasp_force", "force_curve"])
def test_a_question_that_cannot_be_is_told_by_its_name(known: KnownModel, use: str) -> None:
    more: Any = [] if use == "grasp_force" else [np.array([1e-2])]
    with pytest.raises(InvalidValue) as refusal:
        getattr(plan, use)(context(known), replace(TASK, safety_factor=-1.0), *more)
    assert (refusal.value.name, refusal.value.value) == ("safety_factor", "-1.0")


def test_a_curve_is_the_same_answer_at_each_probability(known: KnownModel) -> None:
    probabilities = np.array([0.5, 1e-2, 1e-4])
    curve = plan.force_curve(context(known), replace(TASK, normal_force_limit=30.0), probabilities)
    for k, probability in enumerate(probabilities):
        one = plan.grasp_force(
            context(known), replace(TASK, normal_force_limit=30.0, slip_probability=float(probability))
        )
        assert (curve.smallest[k], curve.largest[k]) == pytest.approx(one.feasible_interval, rel=1e-9)
    assert curve.slip_probability is probabilities
    none = plan.force_curve(context(known), replace(TASK, tangential_load=50.0, normal_force_limit=1.0), probabilities)
    assert np.isnan(none.smallest).all()
    assert np.isnan(none.largest).all()


def test_of_a_material_s_models_the_most_preferred_is_compared(new_model: NewModel) -> None:
    ols, robust = (stored(replace(new_model, method=method)) for method in ("ols", "robust"))
    assert plan._preferred([robust, ols], ("hierarchical", "ols", "robust")) is ols
    assert plan._preferred([robust, ols], ("robust",)) is robust
    assert plan._preferred([ols], ("bayes",)) is None


def test_the_likeliest_material_comes_first(new_model: NewModel, monkeypatch: pytest.MonkeyPatch) -> None:
    found = [stored(new_model, name, version) for version, name in enumerate(("paper", "felt", "wood"))]
    asked: list[Any] = []

    def recognise(evidence: Any, models: Any, unknown: float) -> dict[str, float]:
        asked.append((evidence, list(models), unknown))
        return {"0": 0.2, "1": 0.5, "2": 0.25, "unknown": 0.05}

    monkeypatch.setattr(estimators, "recognise", recognise)
    monkeypatch.setattr(plan, "_candidates", lambda *_: found)
    one = np.ones(1)
    samples = FrictionSamples(one, one, one, one, one, np.zeros(1, int), one, 1e-6)
    told = plan.recognise(SimpleNamespace(), samples, None, "auto", 0.1)  # type: ignore[arg-type]
    assert [(each.material, each.version, each.probability) for each in told.candidates] == [
        ("felt", 1, 0.5),
        ("wood", 2, 0.25),
        ("paper", 0, 0.2),
    ]
    assert told.unknown == 0.05
    assert asked == [(samples, ["0", "1", "2"], 0.1)]


@pytest.mark.parametrize("kind", ["none", "without", "moments"])
def test_a_stored_log_is_compared_by_what_was_found_in_it(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    samples = {
        "none": None,
        "without": SimpleNamespace(none_because="nothing slipped", moments=None),
        "moments": SimpleNamespace(none_because=None, moments=b"moments"),
    }[kind]
    log = SimpleNamespace(samples=samples, sensor="left", job=SimpleNamespace(id="j", status="running"))
    monkeypatch.setattr(grasp_logs, "get", lambda *_: log)
    monkeypatch.setattr(estimators.Moments, "from_bytes", lambda told: told)
    here: Any = SimpleNamespace(database=SimpleNamespace(read=lambda: nullcontext(None)))
    if kind == "none":
        with pytest.raises(ResultsNotReady, match="job j is running; its results are not there"):
            plan._evidence(here, "log")
    elif kind == "without":
        with pytest.raises(InvalidSamples, match="nothing slipped"):
            plan._evidence(here, "log")
    else:
        found: Any = plan._evidence(here, "log")
        assert found == (b"moments", "left")
