"""What gels that were tried come to: of a log probability that is quadratic in one over the thickness, by hand."""

import math
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from slipcore.forces.gel_calibration.calibrate import (
    GIVEN,
    HALF_SPACE,
    PRIORS,
    _found,
    _GelSearch,
    _interval,
    _of_the_prior,
    _poisson_ratio,
    _thickness,
    _young_modulus,
)
from slipcore.forces.gel_calibration.likelihood import Elasticity, EvaluatedGel, Modulus

SPREAD, SLOPE, OWN = 5.0, 0.01, 0.02
"""Standard deviation of one over the thickness, 1/m; of log E over that; and of log E given it."""


def search(
    middle: float = 200.0,
    spread: float = SPREAD,
    misfit: float = 1.0,
    axes: tuple[int, ...] = (0, 1, 2),
    young_modulus: float | None = None,
    ratio: float = 0.45,
) -> _GelSearch:
    """Seven gels about 1/5 mm⁻¹, at a pitch of 1 mm; the modulus is 1 MPa in the middle."""
    tried = []
    for k in np.linspace(-2.0, 2.0, 7):
        away = k * spread
        modulus = Modulus(math.log(1e6) + SLOPE * away, OWN, 0.0)
        elasticity = Elasticity(ratio, middle + away)
        tried.append(EvaluatedGel(elasticity, -0.5 * k**2 + 3.0, (), modulus, np.ones(1), misfit))
    nodes = SimpleNamespace(grid=SimpleNamespace(pitch=(1e-3, 1e-3)))
    presses: Any = SimpleNamespace(axes=axes, nodes=nodes, marker_depth=0.0, relative_thickness=None)
    return _GelSearch(presses, young_modulus, Elasticity(ratio, math.nan), tried)


@pytest.mark.parametrize("misfit", [0.3, 1.0, 4.0])
def test_the_modulus_is_that_in_the_middle_and_as_unsure_as_all_else(misfit: float) -> None:
    """A misfit above 1 widens variances by as much; the modulus goes with one over the thickness."""
    found, wider = _found(search(misfit=misfit)), max(1.0, misfit)
    np.testing.assert_allclose(found.values, [math.log(1e6), 0.45, 200.0], rtol=1e-6)
    variance = wider * SPREAD**2
    np.testing.assert_allclose(found.covariance[2, 2], variance, rtol=2e-3)
    np.testing.assert_allclose(found.covariance[0, 2], SLOPE * variance, rtol=2e-3)
    np.testing.assert_allclose(found.covariance[0, 0], wider * OWN**2 + SLOPE**2 * variance, rtol=2e-3)
    assert not found.covariance[1].any()


def test_a_thickness_has_the_ends_of_its_inverse_with_the_models_error() -> None:
    """1.2 % of 200/m beside 5/m; in the plane four times that."""
    for axes, own in (((0, 1, 2), 2.4), ((0, 1), 9.6)):
        made = search(axes=axes)
        estimate = _thickness(made, _found(made))
        away = 1.96 * math.hypot(SPREAD, own)
        assert estimate.value == pytest.approx(5e-3, rel=1e-6)
        assert (estimate.low, estimate.high) == pytest.approx((1.0 / (200.0 + away), 1.0 / (200.0 - away)), rel=2e-3)
        assert estimate.information == pytest.approx(1.0 - 12.0 * SPREAD**2 / 1000.0**2, rel=1e-4)
        assert estimate.note == ""


def test_a_gel_that_may_be_a_half_space_has_no_upper_end() -> None:
    """Zero lies 1.9 or 2.1 deviations from the middle: a density of 0.16 or 0.11 of the largest."""
    for middle, is_endless in ((1.9 * SPREAD, True), (2.1 * SPREAD, False)):
        made = search(middle)
        estimate = _thickness(made, _found(made))
        assert (estimate.note == HALF_SPACE) == is_endless
        assert (estimate.high == math.inf) == is_endless


def test_a_modulus_has_the_ends_of_its_logarithm_with_the_models_error() -> None:
    made = search()
    estimate = _young_modulus(made, _found(made))
    away = 1.96 * math.sqrt(OWN**2 + (SLOPE * SPREAD) ** 2 + 0.01**2)
    assert (estimate.low, estimate.high) == pytest.approx((1e6 * math.exp(-away), 1e6 * math.exp(away)), rel=1e-3)
    given = search(young_modulus=1e6)
    assert _young_modulus(given, _found(given)).note == GIVEN


def test_what_was_given_stays() -> None:
    made = search()
    estimate = _poisson_ratio(made, _found(made))
    assert (estimate.low, estimate.value, estimate.high, estimate.note) == (0.45, 0.45, 0.45, GIVEN)


def test_an_interval_never_goes_below_zero_and_says_how_much_the_presses_tell() -> None:
    made = search(middle=5.0)
    (low, high), information = _interval(made, _found(made), 0, own=10.0)
    assert low == 0.0
    assert high > 5.0
    assert information > 0.99
    assert (_of_the_prior(0.49), _of_the_prior(0.51)) == (PRIORS, "")


def test_a_step_is_as_far_as_the_probability_falls_by_two(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a normal with a deviation of 5/m that is twice that; each quantity's range is 1000/m."""
    made = search()
    monkeypatch.setattr(
        _GelSearch, "at", lambda _self, point, _seek: 3.0 - 0.5 * ((float(point[0]) - 200.0) / 5.0) ** 2
    )
    assert made._step(np.array([1000.0])) == pytest.approx(2.0 * SPREAD, rel=0.3)
    assert cast("Any", made).best.elasticity.closeness == 200.0
