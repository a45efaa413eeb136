"""The campaign's own rules: a wrong one would make the model's look good or bad."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import gamma, lognorm

from benchmarks.estimators.population import scatters
from benchmarks.estimators.scatter import CONTACT, grasp
from benchmarks.planner.answers_kept import (
    GROWN,
    SHAPES,
    Followed,
    LogNormalScatter,
    PositiveFactor,
    kept,
    of_shapes,
    row,
    told,
)
from benchmarks.planner.planned_force import ASKED, model_of
from estimators import Moments, ScatterPrior
from stiction_client import FrictionModel
from stiction_client.linear_friction import Scale

NONE = np.inf


@pytest.fixture(scope="module")
def model() -> FrictionModel:
    """Of two grasps."""
    rng = np.random.default_rng(5)
    return model_of([Moments.from_samples(grasp(scatters(0.1), rng)) for _ in range(2)], ScatterPrior())


def test_who_knows_the_population_has_its_log_normal_for_a_prior() -> None:
    tau = np.array([0.01, 0.05, 0.3])
    found = LogNormalScatter(0.05, spread=0.4).log_density(tau)
    assert found - found[1] == pytest.approx(np.diff(lognorm(0.4, scale=0.05).logpdf([[0.05] * 3, tau]), axis=0)[0])


def test_an_answer_stays_while_the_lenient_rule_has_one_and_as_near_to_what_it_was_as_that_allows() -> None:
    forces = np.array([[3.0, NONE, 3.0, 9.0], [NONE, 4.0, NONE, NONE], [NONE, 2.0, 2.5, NONE]])
    low = np.array([[2.0, 5.0, 2.0, 1.0], [2.5, 3.0, NONE, 6.0], [3.5, 1.0, 2.0, 2.0]])
    high = np.where(np.isfinite(low), 8.0, NONE)
    expected = [[3.0, NONE, 3.0, 9.0], [3.0, 4.0, NONE, 8.0], [3.5, 2.0, 2.5, 8.0]]
    assert kept(forces, np.stack([low, high])).tolist() == expected


def test_a_load_that_nobody_can_hold_has_no_answer(model: FrictionModel) -> None:
    assert np.isinf(told([model], np.array([0.0, 0.5]), ASKED[0])).tolist() == [[[True, False]]] * 2


def test_of_a_known_scale_a_log_normal_factor_has_its_quantile(model: FrictionModel) -> None:
    assert model.scales is not None
    scales = replace(model.scales, between_grasps=Scale(0.1, 1e9))
    shared, _ = replace(PositiveFactor.of(model), common=0.0, scales=scales).scatter(0.01, CONTACT)
    spread = np.sqrt(np.log1p(0.1**2))
    assert 1.0 - shared == pytest.approx(lognorm(spread, scale=np.exp(-0.5 * spread**2)).ppf(0.01), abs=1e-3)


def test_of_a_known_scale_the_cube_of_a_normal_factor_is_nearly_gamma(model: FrictionModel) -> None:
    assert model.scales is not None
    scales = replace(model.scales, between_grasps=Scale(0.1, 1e9))
    shared, _ = replace(PositiveFactor.of(model, 3.0), common=0.0, scales=scales).scatter(0.01, CONTACT)
    assert 1.0 - shared == pytest.approx(gamma(100.0, scale=0.01).ppf(0.01), abs=2e-3)


def test_a_log_normal_factor_leaves_the_fit_as_it_was(model: FrictionModel) -> None:
    factor = PositiveFactor.of(model)
    law = factor.coefficients
    assert factor.covariance + factor.common**2 * np.outer(law, law) == pytest.approx(model.covariance)
    assert np.linalg.eigvalsh(factor.covariance).min() >= -1e-12 * np.trace(model.covariance)
    assert factor.predict(0.0, 0.1) == pytest.approx(model.predict(0.0, 0.1))


def test_a_log_normal_factor_is_positive_where_a_normal_one_is_not(model: FrictionModel) -> None:
    at = 0.0, 0.1, 1e-5, "contact", CONTACT
    assert model.predict(*at) == 0.0
    assert PositiveFactor.of(model).predict(*at) > 0.01


def test_a_line_counts_answers_and_those_that_vanish() -> None:
    loads = np.array([0.5, 1.0])
    forces = np.full((20, 2), 4.0)
    forces[1, 0] = forces[6, :] = NONE
    line = row(("normal", "default"), "0.05", [Followed(scatters(0.05), loads, forces)])
    assert line[:4] == ["normal", "default", "0.05", "100.0 50.0 100.0"]
    assert line[5:] == ["50.00 0.00 7.14", "8.57", "10.53"]


def test_in_a_normal_world_a_log_normal_factor_lets_more_slip() -> None:
    normal, between, log_normal = of_shapes(8000, 0.12, normal=True)
    assert normal[0].shape == log_normal[0].shape == (20, 20)
    assert normal[1].shape == log_normal[1].shape == (len(ASKED), len(GROWN))
    assert (log_normal[1][:, -1] > between[1][:, -1]).all()
    assert (between[1][:, -1] > normal[1][:, -1]).all()
    assert len(SHAPES) == 3
