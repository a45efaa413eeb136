"""Priors in words say what they are in numbers."""

import math
import re

import numpy as np
import pytest
from scipy import stats

from estimators import Domain, InvalidSamples, ScatterPrior
from estimators.defaults import PRIOR, REFERENCE
from estimators.linear.priors import (
    conjugate_prior,
    log_half_student,
    positive_friction,
    prior_rows,
    structured,
    weak_spans,
)


@pytest.mark.parametrize("told", [conjugate_prior(), positive_friction(), structured(), structured(sensors=2)])
def test_the_inverse_gamma_of_the_scatter_has_its_squared_reference_for_its_middle(told: str) -> None:
    found = re.search(r"sigma\^2 ~ IG\(([^,]+), ([^)]+)\)", told)
    assert found is not None
    shape, scale = map(float, found.groups())
    assert shape == PRIOR.degrees_of_freedom / 2.0
    assert scale / shape == pytest.approx(REFERENCE.scatter**2, rel=1e-5)


def test_between_sensors_something_is_assumed_only_where_there_are_several() -> None:
    assert "between sensors" in structured(sensors=2)
    assert "between sensors" not in structured(sensors=1)


def test_a_half_student_falls_by_its_degrees_of_freedom() -> None:
    """Against scipy's, both relative to their height at 0."""
    tau = np.array([0.0, 0.02, 0.1, 1.0])
    expected = stats.t.logpdf(tau / 0.07, 7.0) - stats.t.logpdf(0.0, 7.0)
    np.testing.assert_allclose(ScatterPrior(0.07, 7.0).log_density(tau), expected, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(log_half_student(tau, 0.05), stats.t.logpdf(tau / 0.05, 4.0) - stats.t.logpdf(0.0, 4.0))


@pytest.mark.parametrize(
    "settings", [(0.0, 7.0, 0), (math.inf, 7.0, 0), (0.1, 0.99, 0), (0.1, math.inf, 0), (0.1, 7.0, -1)]
)
def test_a_prior_of_scatter_that_cannot_be_is_refused(settings: tuple[float, float, int]) -> None:
    assert ScatterPrior(0.1, 1.0, 0).degrees_of_freedom == 1.0
    with pytest.raises(InvalidSamples, match="of the prior of scatter"):
        ScatterPrior(*settings)


def test_a_prior_of_scatter_tells_where_it_comes_from() -> None:
    assert str(ScatterPrior()).endswith("on 7 degrees of freedom with scale 0.07, the default")
    assert str(ScatterPrior(0.031, 12.0)).endswith("scale 0.031")
    assert str(ScatterPrior(0.031, 12.0, 1)).endswith("from 1 other material")
    assert str(ScatterPrior(0.031, 12.0, 2)).endswith("from 2 other materials")


def test_rows_of_the_prior_weigh_each_effect_over_its_span_as_little_as_a_400th_of_a_sample() -> None:
    """5 mm/s, and 5e4 Pa on an element of 2 mm²; at a scatter of 0.05 each is known to 1."""
    rows = prior_rows(2e-6)
    covariance = 0.05**2 * np.linalg.inv(rows[:, :3].T @ rows[:, :3])
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), [1.0, 1.0 / 5e-3, 1.0 / 0.1], rtol=1e-12)
    np.testing.assert_allclose(np.linalg.solve(rows[:, :3], rows[:, 3]), [0.5, 0.0, 0.0], rtol=1e-12)


@pytest.mark.parametrize(
    ("velocity", "force", "expected"),
    [
        ((0.0, 2e-3), (0.01, 0.03), (2e-3, 0.02)),  # what was seen
        ((0.0, 9e-3), (0.0, 0.9), (5e-3, 0.05)),  # no more than matters
        ((3e-3, 3e-3), (0.02, 0.02), (3e-6, 2e-5)),  # a thousandth of it where all are equal
        ((0.0, 0.0), (0.0, 0.0), (5e-3, 0.05)),  # where nothing was seen
    ],
)
def test_a_slope_is_weak_over_the_range_seen_or_over_what_matters(
    velocity: tuple[float, float], force: tuple[float, float], expected: tuple[float, float]
) -> None:
    np.testing.assert_allclose(weak_spans(Domain(velocity, force), 1e-6), expected, rtol=1e-9)
