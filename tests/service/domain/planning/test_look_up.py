from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import estimators
import slipcore
from db.database import Database
from db.repositories import friction_models, jobs, materials
from service.domain.models.model_cache import ModelCache
from service.domain.models.stored_results import to_new_model
from service.domain.planning.look_up import FrictionQuery, look_up
from slipcore import GraspLog


@pytest.fixture
def model(ramp: GraspLog) -> estimators.FrictionModel:
    """Of one grasp's samples as if four grasps had given them, which do not differ then."""
    samples = slipcore.collect_samples(ramp, slipcore.detect_slip(ramp))
    return estimators.fit([samples.take(np.arange(len(samples)) % 4 == grasp) for grasp in range(4)])


@pytest.fixture
def ask(database: Database) -> Callable[[estimators.FrictionModel, FrictionQuery], Any]:
    with database.write() as session:
        material = materials.create(session, "paper", "").id

    def answer(model: estimators.FrictionModel, question: FrictionQuery) -> Any:
        with database.write() as session:
            job = jobs.add(session, "fit", "ols", material_id=material)
            friction_models.add(session, material, job, to_new_model(model))
        return look_up(ModelCache().read(database, "paper", "ols"), question)

    return answer


def test_the_answer_is_the_models(ask: Callable[..., Any], model: estimators.FrictionModel) -> None:
    f_n = sum(model.domain.normal_force) / 2.0
    answer = ask(model, FrictionQuery(1e-5, f_n, 0.05))
    assert answer.mean == float(model.predict(1e-5, f_n))
    assert answer.friction_coefficient == float(model.predict(1e-5, f_n, quantile=0.05))
    assert (answer.within_domain, answer.warning, answer.version) == (True, None, 1)


def test_no_friction_is_below_0_and_where_the_law_is_the_answer_says_that_it_cannot_be(
    ask: Callable[..., Any], model: estimators.FrictionModel
) -> None:
    falling = replace(model, coefficients=np.array([0.5, 0.0, -2.0]))
    far = 10.0 * falling.domain.normal_force[1]
    for quantile in (None, 0.05):
        answer = ask(falling, FrictionQuery(0.0, far, quantile))
        assert answer.mean == float(falling.predict(0.0, far)) < 0.0 == answer.friction_coefficient
        assert (answer.within_domain, answer.support) == (False, "implausible")
        assert answer.warning == f"{falling.extrapolation(0.0, far)}; {answer.advice}"
        assert f"comes out at {answer.mean:.3g}" in answer.advice


def test_forces_may_be_those_of_an_element_of_another_area(
    ask: Callable[..., Any], model: estimators.FrictionModel
) -> None:
    f_n = sum(model.domain.normal_force) / 2.0
    usual = ask(model, FrictionQuery(1e-5, f_n, None))
    assert usual.element_area == model.element_area
    larger = ask(model, FrictionQuery(1e-5, 7.0 * f_n, None, element_area=7.0 * model.element_area))
    assert larger.mean == pytest.approx(usual.mean, rel=1e-12)
    assert (larger.normal_force, larger.element_area) == (7.0 * f_n, 7.0 * model.element_area)
    assert larger.within_domain
    assert not ask(model, FrictionQuery(1e-5, 7.0 * f_n, None)).within_domain


@pytest.mark.parametrize(("of", "elements"), [("element", 1), ("contact", 60)])
def test_a_quantile_is_of_what_was_asked_for(
    ask: Callable[..., Any], model: estimators.FrictionModel, of: str, elements: int
) -> None:
    scales = estimators.Scales(*(estimators.Scale(value, 9.0) for value in (0.07, 0.02, 0.03)))
    scattering = replace(model, scales=scales)
    f_n = sum(model.domain.normal_force) / 2.0
    answer = ask(scattering, FrictionQuery(1e-5, f_n, 0.05, of, elements))
    assert answer.friction_coefficient == float(scattering.predict(1e-5, f_n, 0.05, of=of, elements=elements))
    assert (answer.of, answer.elements) == (of, elements)


def test_friction_of_the_sensor_that_grasps_has_its_own_gain(
    ask: Callable[..., Any], model: estimators.FrictionModel
) -> None:
    one = estimators.Scale(0.05, 9.0)
    shown = estimators.SensorFriction(0.1, 0.01, (0.7, 0.0, 0.0), tuple(map(tuple, 1e-4 * np.eye(3))), 9.0, 0.05, 9.0)
    scales = estimators.Scales(one, one, one, estimators.SensorScale(one, {"left": shown}))
    several = replace(model, scales=scales)
    f_n = sum(model.domain.normal_force) / 2.0
    means = [ask(several, FrictionQuery(0.0, f_n, None, sensor=name)).mean for name in (None, "right", "left")]
    assert means == [float(several.predict(0.0, f_n))] * 2 + [0.7]
    own = {"left": replace(shown, element_area=4.0 * model.element_area)}
    coarse = replace(model, scales=replace(scales, between_sensors=estimators.SensorScale(one, own)))
    answer = ask(coarse, FrictionQuery(0.0, 4.0 * f_n, None, sensor="left"))
    assert (answer.element_area, answer.mean) == (4.0 * model.element_area, pytest.approx(0.7))
    asked = ask(coarse, FrictionQuery(0.0, f_n, None, sensor="left", element_area=model.element_area))
    assert (asked.element_area, asked.mean) == (model.element_area, pytest.approx(0.7))


def test_slower_than_the_samples_is_inside_and_faster_is_not(
    ask: Callable[..., Any], model: estimators.FrictionModel
) -> None:
    low, high = model.domain.tangential_velocity
    f_n = model.domain.normal_force[1]
    assert low > 0.0
    assert ask(model, FrictionQuery(0.0, f_n, None)).within_domain
    assert ask(model, FrictionQuery(high, f_n, None)).within_domain
    assert not ask(model, FrictionQuery(1.001 * high, f_n, None)).within_domain


def test_friction_at_rest_of_slip_at_one_speed_is_outside_and_says_what_is_assumed(
    ask: Callable[..., Any], ramp: GraspLog
) -> None:
    samples = slipcore.collect_samples(ramp, slipcore.detect_slip(ramp))
    steady = replace(samples, tangential_velocity=np.full(len(samples), 5e-3))
    parts = [steady.take(np.arange(len(steady)) % 4 == grasp) for grasp in range(4)]
    model = replace(estimators.fit(parts, method="hierarchical"), method="ols")  # the one that is asked for
    f_n = 0.5 * sum(model.domain.normal_force)
    answer, sliding = ask(model, FrictionQuery(0.0, f_n, 0.01)), ask(model, FrictionQuery(5e-3, f_n, 0.01))
    assert (answer.within_domain, answer.support) == (False, "extrapolated")
    assert (sliding.within_domain, sliding.support) == (True, "supported")
    assert answer.warning == "tangential velocity extrapolated to 0 m/s, observed 0.005 to 0.005"
    assert "between rest and the 0.005 m/s at which they slid" in "; ".join(answer.notes)
    assert 0.5 * answer.mean < answer.friction_coefficient < sliding.friction_coefficient - 0.15 * answer.mean


@pytest.mark.parametrize("edge", [0, 1])
def test_forces_beyond_the_samples_are_outside_on_both_sides(
    ask: Callable[..., Any], model: estimators.FrictionModel, edge: int
) -> None:
    bound = model.domain.normal_force[edge]
    answer = ask(model, FrictionQuery(0.0, bound * (0.999 if edge == 0 else 1.001), None))
    assert ask(model, FrictionQuery(0.0, bound, None)).within_domain
    assert not answer.within_domain
    assert "normal force" in answer.warning


def test_an_answer_that_is_no_friction_warns(ask: Callable[..., Any], model: estimators.FrictionModel) -> None:
    answer = ask(replace(model, scale=10.0), FrictionQuery(0.0, model.domain.normal_force[1], 0.05))
    assert answer.friction_coefficient == 0.0
    assert answer.within_domain
    assert "not above 0" in answer.warning


def test_an_answer_says_what_it_rests_on(ask: Callable[..., Any], model: estimators.FrictionModel) -> None:
    f_n = sum(model.domain.normal_force) / 2.0
    assert ask(model, FrictionQuery(1e-5, f_n, 0.05)).support == "supported"
    assert ask(model, FrictionQuery(1e-5, 3.0 * f_n, 0.05)).support == "extrapolated"
    unknown = ask(replace(model, identifiable=np.zeros(3, bool)), FrictionQuery(1e-5, f_n, 0.05))
    assert (unknown.support, unknown.within_domain) == ("not identified", True)
    assert unknown.warning == unknown.advice


def test_methods_that_disagree_are_told_of(
    ask: Callable[..., Any], model: estimators.FrictionModel, database: Database
) -> None:
    f_n = sum(model.domain.normal_force) / 2.0
    higher = replace(model, method="robust", coefficients=model.coefficients + np.array([0.2, 0.0, 0.0]))
    with database.write() as session:
        material = materials.find_id(session, "paper")
        job = jobs.add(session, "fit", "robust", material_id=material)
        friction_models.add(session, material, job, to_new_model(higher))
    answer = ask(model, FrictionQuery(1e-5, f_n, 0.05))
    assert "methods disagree by more than their intervals allow: robust expects 0.6" in answer.warning
    with database.write() as session:
        friction_models.mark_outdated(session, material, besides=("ols",))
    assert look_up(ModelCache().read(database, "paper", "ols"), FrictionQuery(1e-5, f_n, 0.05)).warning is None
