"""The campaign's own figures: a wrong oracle would make any estimator look good."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import special

from benchmarks.estimators.scatter import (
    CONTACT,
    KINDS,
    TRUTH,
    WORKING_POINT,
    Kind,
    achieved,
    cell,
    factor,
    grasp,
    oracle_widths,
)


def test_a_grasp_without_scatter_follows_the_law() -> None:
    data = grasp(Kind(within=0.0), np.random.default_rng(0))
    law = TRUTH @ [np.ones(len(data)), data.tangential_velocity, data.normal_force]
    np.testing.assert_allclose(data.friction_coefficient, law, rtol=1e-12)
    assert len(data) > 300
    assert len(np.unique(data.element)) > 40


def test_the_oracle_is_least_squares_where_samples_are_independent() -> None:
    data = [grasp(KINDS["independent"], np.random.default_rng(seed)) for seed in range(2)]
    x = np.concatenate(
        [np.column_stack([np.ones(len(part)), part.tangential_velocity, part.normal_force]) for part in data]
    )
    error = 0.03 * np.sqrt(np.diag(np.linalg.inv(x.T @ x)))
    np.testing.assert_allclose(oracle_widths(KINDS["independent"], data), 2 * special.ndtri(0.975) * error, rtol=1e-9)


def test_slip_is_as_probable_as_was_asked_where_the_scales_are_known() -> None:
    mean = TRUTH @ [1.0, *WORKING_POINT]
    places = replace(KINDS["place"], between_grasps=0.0)
    deviation = np.sqrt((places.between_places**2 + places.within**2) / CONTACT)
    assert achieved(places, mean + special.ndtri(0.01) * deviation) == pytest.approx(0.01, rel=1e-6)
    alone = Kind(between_grasps=0.07, within=1e-6)
    assert achieved(alone, float(mean * factor(alone, special.ndtri(0.3)))) == pytest.approx(0.3, abs=0.1)


def test_a_cell_tells_every_method() -> None:
    rows = cell(KINDS["grasp and place"], 3, seeds=2)
    assert [row["method"] for row in rows] == ["ols", "hierarchical", "bayes", "auto"]
    for row in rows:
        assert np.isfinite([*row["covered"], *row["width"], *row["achieved_over_asked"]]).all()


def test_a_normal_factor_has_the_deviation_of_a_log_normal_one_and_is_not_below_0() -> None:
    score = np.random.default_rng(0).standard_normal(200_000)
    for normal in (False, True):
        found = factor(Kind(0.2, normal=normal), score)
        assert found.mean() == pytest.approx(1.0, abs=0.002), normal
        assert found.std() == pytest.approx(0.2, rel=0.01), normal
    assert factor(Kind(0.2, normal=True), -6.0) == 0.0
