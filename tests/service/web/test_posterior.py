"""Pictures of a model's posterior and of single grasps' effects."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest
from scipy import stats

import estimators
from db.records import NewModel, SampledLog, SamplesOfLog, StoredModel
from estimators import Moments
from service.domain.models.stored_results import to_friction_model, to_new_model
from service.web.grasp_effects import differing, draw_effects
from service.web.posterior import Density, densities, pairs
from tests.service.web.test_samples import grasp

MOMENT = datetime(2026, 1, 2, tzinfo=UTC)


def stored(model: NewModel) -> StoredModel:
    return StoredModel(1, "paper", 1, current=True, outdated=False, created_at=MOMENT, model=model)


@pytest.fixture(scope="module")
def model() -> NewModel:
    return to_new_model(estimators.fit([grasp(k) for k in range(4)], "hierarchical"))


def curve(chart: Density, text: str) -> np.ndarray:
    """The points [k, 2] of a line or polygon, as values on the axes."""
    drawn = np.array([[float(part) for part in point.split(",")] for point in text.split()])
    numbers = [(tick.place, float(tick.text.replace("−", "-"))) for tick in chart.x_ticks]
    (a, first), (b, last) = numbers[0], numbers[-1]
    x = first + (drawn[:, 0] - a) * (last - first) / (b - a)
    return np.stack([x, (chart.bottom - drawn[:, 1]) / (chart.bottom - chart.top)], axis=1)


def test_a_density_is_student_t_and_its_darker_part_the_interval(model: NewModel) -> None:
    fitted = to_friction_model(model)
    found = densities(stored(model))
    assert [chart.label for chart in found] == ["β₀", "β₁, s/m", "β₂, 1/N", "σ"]
    for k, chart in enumerate(found[:3]):
        law = stats.t(fitted.degrees_of_freedom, fitted.coefficients[k], fitted.standard_errors[k])
        x, height = curve(chart, chart.line).T
        np.testing.assert_allclose(height, law.pdf(x) / law.pdf(fitted.coefficients[k]), atol=0.02)
        inside = curve(chart, chart.inside)[:, 0]
        np.testing.assert_allclose([inside.min(), inside.max()], fitted.interval(0.95)[k], rtol=0.02, atol=2e-3)


def test_the_density_of_the_scatter_is_that_of_a_scaled_inverse_chi_square(model: NewModel) -> None:
    few = replace(model, scatter_degrees_of_freedom=9.0)
    chart = densities(stored(few))[3]
    x, height = curve(chart, chart.line).T
    square = stats.invgamma(4.5, scale=4.5 * few.scale**2)
    expected = square.pdf(x**2) * 2.0 * x
    np.testing.assert_allclose(height, expected / expected.max(), atol=0.02)


@pytest.mark.parametrize("freedom", [4.0, None])
def test_the_outer_ellipse_holds_95_per_cent_of_what_is_drawn(model: NewModel, freedom: float | None) -> None:
    chosen = replace(model, degrees_of_freedom=freedom)
    chart = pairs(stored(chosen))[0]
    rng = np.random.default_rng(3)
    draws = stats.multivariate_t(
        model.coefficients, np.array(model.covariance), np.inf if freedom is None else freedom, seed=rng
    ).rvs(20_000)[:, [0, 2]]
    edge = np.array([[float(part) for part in point.split(",")] for point in chart.ellipses[1].split()])
    spread = np.sqrt(np.diag(model.covariance))[[0, 2]]
    reach = np.ptp(edge, axis=0) / 2.0
    at = (draws - np.array(model.coefficients)[[0, 2]]) / spread
    r2 = (at[:, 0] ** 2 - 2.0 * chart.correlation * at[:, 0] * at[:, 1] + at[:, 1] ** 2) / (1.0 - chart.correlation**2)
    # the ellipse reaches `radius` standard deviations, and its axis 1.1 times that from the middle on either side
    assert reach[0] == pytest.approx((chart.right - chart.left) / 2.2, rel=0.01)
    degrees = np.inf if freedom is None else freedom
    radius = np.sqrt(-2.0 * np.log(0.05)) if freedom is None else np.sqrt(degrees * (0.05 ** (-2.0 / degrees) - 1.0))
    assert np.mean(r2 < radius**2) == pytest.approx(0.95, abs=0.006)


def test_what_is_known_without_doubt_has_no_density(model: NewModel) -> None:
    sure = replace(model, covariance=((0.0,) * 3,) * 3, scatter_degrees_of_freedom=None)
    assert densities(stored(sure)) == []
    assert pairs(stored(sure)) == []
    nearly = tuple(tuple(1e-40 * (row == column) for column in range(3)) for row in range(3))
    nearly_sure = replace(sure, covariance=nearly)
    assert densities(stored(nearly_sure)) == []
    assert pairs(stored(nearly_sure)) == [], "an axis without any length"


def log(number: int, moments: bytes | None) -> SampledLog:
    return SampledLog(SamplesOfLog(f"log{number}", "blob", moments), MOMENT, (3, 4))


def test_a_grasp_with_more_friction_stands_above_zero_and_is_marked(model: NewModel) -> None:
    usual = grasp(20)
    more = replace(usual, friction_coefficient=1.4 * usual.friction_coefficient)
    logs = [log(k, Moments.from_samples(each).to_bytes()) for k, each in enumerate((usual, more))]
    found = differing(stored(model), logs)
    assert [each.is_certain for each in found] == [False, True]
    chart = draw_effects(found)
    first, second = chart.whiskers
    assert second.y < chart.zero  # upwards on the page
    assert first.x < second.x
    assert chart.top <= second.high < second.y < second.low <= chart.bottom
    assert [whisker.is_certain for whisker in chart.whiskers] == [False, True]


def test_logs_whose_moments_are_unknown_are_left_out(model: NewModel) -> None:
    assert differing(stored(model), [log(0, None)]) == []


def test_a_model_without_scatter_between_grasps_tells_no_effects(model: NewModel) -> None:
    logs = [log(0, Moments.from_samples(grasp(0)).to_bytes())]
    assert differing(stored(replace(model, scales=None)), logs) == []
