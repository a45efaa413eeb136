"""A mixture over nodes as one Student-t a quantity: limits in which it is known."""

import numpy as np
import pytest
from scipy import stats

import estimators
from benchmarks.estimators import scatter
from estimators import Moments, ScatterPrior
from estimators.linear.fit_data import gather
from estimators.linear.mixture_summary import _half_width, scatter_alone, summarise
from estimators.linear.normal_mixture import matched_student, mixture_quantile
from estimators.linear.posterior_grid import ScaleNodes, posterior_grid

AT = np.array([1.0, 2e-3, 0.1])
TAU = np.array([0.02, 0.05, 0.1, 0.2])


def nodes(weight: np.ndarray, covariance: np.ndarray | None = None, mean: np.ndarray | None = None) -> ScaleNodes:
    """Of scales σ = 0.03, τ as above and ω = 0.04."""
    count = len(weight)
    scatter = np.stack([np.full(count, 0.03), TAU[:count], np.full(count, 0.04)], axis=1)
    means = np.tile([0.5, 10.0, -1.0], (count, 1)) if mean is None else mean
    spread = np.zeros((count, 3, 3)) if covariance is None else np.tile(covariance, (count, 1, 1))
    return ScaleNodes(weight, scatter, means, spread)


def test_of_one_node_all_is_normal() -> None:
    covariance = np.diag([1e-4, 4.0, 9e-4]) + 1e-5 * np.array([[0, 0, 1], [0, 0, 0], [1, 0, 0]])
    found = summarise(nodes(np.ones(1), covariance), AT)
    assert found.degrees_of_freedom > 1e3
    np.testing.assert_allclose(found.coefficients, [0.5, 10.0, -1.0])
    np.testing.assert_allclose(found.covariance, covariance, rtol=2e-3)
    told = [found.scales.between_grasps.value, found.scales.between_places.value, found.scales.within.value]
    np.testing.assert_allclose(told, [0.02, 0.04, 0.03], rtol=1e-3)
    friction = 0.5 + 0.02 - 0.1
    assert found.scatter.scale == pytest.approx(np.sqrt((0.02 * friction) ** 2 + 0.04**2 + 0.03**2), rel=1e-3)


def test_an_interval_of_a_coefficient_is_that_of_the_mixture() -> None:
    """Of two nodes apart by 0.2 with deviations of 0.05; the covariance is that of the scale of a Student-t."""
    mean = np.tile([0.5, 0.0, 0.0], (2, 1))
    mean[:, 0] += [-0.1, 0.1]
    found = summarise(nodes(np.array([0.5, 0.5]), np.diag([0.05**2, 0.0, 0.0]), mean), AT)
    half = stats.t(found.degrees_of_freedom).ppf(0.975) * np.sqrt(found.covariance[0, 0])
    above = 0.5 * sum(stats.norm(0.5 + side, 0.05).sf(0.5 + half) for side in (-0.1, 0.1))
    assert above == pytest.approx(0.025, rel=1e-6)
    assert found.covariance[1, 1] == 0.0


def test_half_of_an_interval_is_of_both_ends() -> None:
    assert _half_width(np.ones(1), np.array([3.0]), np.array([2.0])) == pytest.approx(2.0 * stats.norm.ppf(0.975))


def test_scatter_alone_has_the_other_materials_taken_out() -> None:
    """Weights by another prior times a likelihood become those by the default prior times the same."""
    other, likelihood = ScatterPrior(0.03, 20.0, 5), np.array([0.2, 0.9, 0.5, 0.1])

    def weights(prior: ScatterPrior) -> np.ndarray:
        weight = likelihood * stats.t(prior.degrees_of_freedom, 0.0, prior.scale).pdf(TAU)
        return weight / weight.sum()

    found = scatter_alone(nodes(weights(other)), other)
    expected = matched_student(weights(ScatterPrior()), np.zeros(4), TAU)
    assert (found.value, found.degrees_of_freedom) == pytest.approx(tuple(expected), rel=1e-9)


@pytest.mark.parametrize(("grasps", "near"), [(1, 0.015), (2, 0.012), (5, 0.003)])
def test_what_a_contact_slips_below_is_that_of_the_mixture(grasps: int, near: float) -> None:
    """In parts of friction, at a planner's 1e-2: Student's distributions of which it is made cost no answers."""
    for seed in range(5):
        rng = np.random.default_rng(seed)
        kind = scatter.KINDS["grasp and place"]
        logs = [Moments.from_samples(scatter.grasp(kind, rng)) for _ in range(grasps)]
        told = estimators.fit(logs, "hierarchical").predict(*scatter.WORKING_POINT, 1e-2, "contact", scatter.CONTACT)
        found, at = posterior_grid(gather(logs)).nodes, np.array([1.0, *scatter.WORKING_POINT])
        sigma, tau, omega = found.scatter.T
        mean, uncertain = found.mean @ at, np.einsum("kij,i,j->k", found.covariance, at, at)
        spread = np.sqrt(uncertain + (tau * mean) ** 2 + (omega**2 + sigma**2) / scatter.CONTACT)
        exact = mixture_quantile(found.weight, mean, spread, 1e-2)[0]
        assert told / (found.weight @ mean) == pytest.approx(exact / (found.weight @ mean), abs=near)
