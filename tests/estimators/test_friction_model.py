"""Predictions of a fitted model."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy import integrate, special, stats

from estimators import Cost, Domain, FrictionModel, InvalidSamples, Scale, Scales

LEVEL = 1000.0
"""Of friction: so far above 0 that no quantile gets there."""


def model(
    scale: float = 1.0, error: float = 0.3, freedom: float = 3.0, n: int = 5003, level: float = 0.4
) -> FrictionModel:
    """A model whose intercept alone is uncertain."""
    return FrictionModel(
        method="ols",
        coefficients=np.array([level, 2.0, -0.5]),
        covariance=np.diag([error**2, 0.0, 0.0]),
        scale=scale,
        n=n,
        degrees_of_freedom=freedom,
        scatter_degrees_of_freedom=n - 3.0,
        domain=Domain((0.0, 0.01), (0.0, 0.1)),
        identifiable=np.ones(3, dtype=bool),
        element_area=1e-6,
        cost=Cost(0.0),
    )


def sum_below(q: float, error: float, freedom: float) -> float:
    """P(N(0, 1) + s·t_ν ≤ q) by adaptive quadrature."""
    normaliser = math.sqrt(freedom) * special.beta(0.5 * freedom, 0.5)

    def integrand(t: float) -> float:
        density = math.exp(-0.5 * (freedom + 1.0) * math.log1p(t * t / freedom)) / normaliser
        return float(special.ndtr(q - error * t)) * density

    middle = q / error
    edges = [-np.inf, middle - 10.0 / error, middle, middle + 10.0 / error, np.inf]
    return sum(integrate.quad(integrand, a, b, epsabs=1e-13)[0] for a, b in pairwise(edges))


def test_mean_is_the_plane() -> None:
    np.testing.assert_allclose(model().predict([0.0, 0.01], 0.1), [0.35, 0.37], rtol=1e-14)  # rounding


@pytest.mark.parametrize("quantile", [0.001, 0.05, 0.5, 0.9])
def test_equal_degrees_of_freedom_give_students_t_exactly(quantile: float) -> None:
    exact = LEVEL + math.hypot(3.0, 4.0) * stats.t.ppf(quantile, 10)
    found = model(scale=3.0, error=4.0, freedom=10.0, n=13, level=LEVEL).predict(0.0, 0.0, quantile)
    np.testing.assert_allclose(found, exact, rtol=1e-12, atol=1e-12)  # rounding of the quantile function


@pytest.mark.parametrize("freedom", [2.0, 3.0, 9.0, 30.0])
@pytest.mark.parametrize("error", [0.02, 0.1, 0.3, 1.0, 4.0])
@pytest.mark.parametrize("quantile", [1e-4, 1e-3, 0.01, 0.025])
def test_lower_tail_is_never_too_narrow_nor_wasteful_for_few_clusters(
    freedom: float, error: float, quantile: float
) -> None:
    distance = float(LEVEL - model(error=error, freedom=freedom, n=10**7, level=LEVEL).predict(0.0, 0.0, quantile))
    assert sum_below(-distance, error, freedom) <= 1.05 * quantile  # too narrow by 5 % of the probability at most
    assert sum_below(-distance / 1.3, error, freedom) >= quantile  # at most 30 % further out than need be


def test_scatter_has_its_own_degrees_of_freedom() -> None:
    given = replace(model(error=0.0, level=LEVEL), scatter_degrees_of_freedom=5.0)
    np.testing.assert_allclose(given.predict(0.0, 0.0, 0.05), LEVEL + stats.t.ppf(0.05, 5.0), rtol=1e-12)  # rounding


def test_without_scatter_and_error_every_quantile_is_the_mean() -> None:
    assert float(model(scale=0.0, error=0.0).predict(0.0, 0.0, 0.01)) == 0.4


@pytest.mark.parametrize("quantile", [0.0, 1.0, -0.1, math.nan])
def test_a_quantile_that_is_no_probability_is_refused(quantile: float) -> None:
    with pytest.raises(InvalidSamples, match="quantile"):
        model().predict(0.0, 0.0, quantile)


def scattering(**changes: object) -> FrictionModel:
    scales = Scales(Scale(0.05, np.inf), Scale(0.02, np.inf), Scale(0.03, np.inf))
    return replace(model(), degrees_of_freedom=np.inf, scales=scales, **changes)


def test_a_contact_averages_what_differs_between_its_elements() -> None:
    asked, score = scattering(covariance=np.zeros((3, 3))), special.ndtri(0.01)
    mean = float(asked.predict(2e-3, 0.05))
    for of, elements, count in (("element", None, 1), ("contact", 1, 1), ("contact", 50, 50)):
        expected = mean + score * np.sqrt((0.05 * mean) ** 2 + (0.02**2 + 0.03**2) / count)
        np.testing.assert_allclose(asked.predict(2e-3, 0.05, 0.01, of=of, elements=elements), expected, rtol=1e-12)


def test_without_scales_a_contact_scatters_as_an_element_does() -> None:
    asked = replace(scattering(), scales=None)
    assert asked.predict(2e-3, 0.05, 0.01, of="contact", elements=50) == asked.predict(2e-3, 0.05, 0.01)


@pytest.mark.parametrize(
    ("of", "elements", "name"),
    [("grasp", 5, "of"), ("contact", None, "elements"), ("contact", 0, "elements")],
)
def test_what_is_predicted_must_be_known(of: str, elements: int | None, name: str) -> None:
    with pytest.raises(InvalidSamples, match=f"^{name} is"):
        scattering().predict(2e-3, 0.05, 0.01, of=of, elements=elements)
