"""The posterior of independent normal errors: whitened, summed up, and cut off where friction is not above 0."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy import stats

from estimators.defaults import PRIOR, REFERENCE, SAMPLING
from estimators.likelihoods.gaussian import NAMES, Gaussian, gaussian
from estimators.linear.fit_data import gather
from slipcore.samples import FrictionSamples

Make = Callable[..., FrictionSamples]


@pytest.fixture
def data(samples: Make) -> FrictionSamples:
    return samples(60)


@pytest.fixture
def posterior(data: FrictionSamples) -> Gaussian:
    return gaussian(gather(data))


def direct(data: FrictionSamples, beta: np.ndarray, sigma: float) -> float:
    """Log of prior and likelihood of (β, σ), sample by sample."""
    friction = beta @ [np.ones(len(data)), data.tangential_velocity, data.normal_force]
    log = stats.norm(friction, sigma).logpdf(data.friction_coefficient).sum()
    spans = np.array([1.0, *REFERENCE.spans(data.element_area)])
    width = sigma / REFERENCE.scatter * PRIOR.width / spans
    log += stats.norm([REFERENCE.friction, 0.0, 0.0], width).logpdf(beta).sum()
    shape = 0.5 * PRIOR.degrees_of_freedom
    of_variance = stats.invgamma(shape, scale=shape * REFERENCE.scatter**2).logpdf(sigma**2)
    return float(log + of_variance + np.log(2.0 * sigma))  # as a density of σ


def test_the_density_is_that_of_all_samples_and_the_prior(data: FrictionSamples, posterior: Gaussian) -> None:
    """Whitened by β = mean + σ root z and a line in log σ, whose Jacobian is σ³ · σ."""
    points = np.random.default_rng(1).standard_normal((6, 4))
    beta, sigma = posterior._natural(points)
    expected = np.array([direct(data, b, s) + 4.0 * np.log(s) for b, s in zip(beta, sigma, strict=True)])
    found = posterior.log_probability(points)
    np.testing.assert_allclose(found - found[0], expected - expected[0], rtol=0.0, atol=1e-6)  # of some 200


def test_whitened_draws_are_those_of_the_exact_posterior(posterior: Gaussian) -> None:
    exact = posterior.exact
    mean, spread = exact.log_scale()
    beta, sigma = posterior._natural(np.array([[0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 1.0], [0.0, 0.0, -2.0, -1.0]]))
    np.testing.assert_allclose(np.log(sigma), [mean, mean + spread, mean - spread], rtol=1e-12)
    np.testing.assert_allclose(beta[0], exact.mean, rtol=1e-12)
    np.testing.assert_allclose(beta[1], exact.mean + sigma[1] * exact.root[:, 0], rtol=1e-12)
    np.testing.assert_allclose(beta[2], exact.mean - 2.0 * sigma[2] * exact.root[:, 2], rtol=1e-12)


def test_draws_are_summed_up_in_whitened_coordinates(posterior: Gaussian) -> None:
    draws = np.random.default_rng(2).standard_normal((500, 4))
    found = posterior.summarise(draws, np.random.default_rng(0))
    _, sigma = posterior._natural(draws)
    scale = np.mean(sigma**-2.0) ** -0.5
    assert found.scale == pytest.approx(scale, rel=1e-12)
    root = scale * posterior.exact.root
    np.testing.assert_allclose(found.coefficients, posterior.exact.mean + root @ draws[:, :3].mean(axis=0), rtol=1e-12)
    np.testing.assert_allclose(found.covariance, root @ np.cov(draws[:, :3].T) @ root.T, rtol=1e-9)
    degrees = posterior.exact.degrees_of_freedom
    assert (found.degrees_of_freedom, found.scatter_degrees_of_freedom) == (degrees, degrees)
    assert degrees == pytest.approx(60.0 + PRIOR.degrees_of_freedom, rel=1e-12)


def test_of_many_draws_some_are_kept_evenly(posterior: Gaussian, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("estimators.likelihoods.gaussian.SAMPLING", _Kept(200))
    draws = np.random.default_rng(3).standard_normal((500, 4))
    kept = posterior.summarise(draws, np.random.default_rng(0)).draws
    assert kept is not None
    beta, sigma = posterior._natural(draws[::3])
    np.testing.assert_array_equal(kept, np.column_stack([beta, sigma]))
    assert SAMPLING.kept_draws > 200


class _Kept:
    def __init__(self, kept_draws: int) -> None:
        self.kept_draws = kept_draws


def test_where_friction_is_not_above_zero_there_is_no_density(samples: Make) -> None:
    posterior = gaussian(gather(samples(60)))
    least = float((posterior.corners @ posterior.exact.mean).min())
    _, sigma = posterior._natural(np.zeros((1, 4)))
    steps = np.linalg.solve(sigma[0] * posterior.exact.root, np.array([-least, 0.0, 0.0]))
    points = np.vstack([0.99 * steps, 1.01 * steps])
    found = posterior.log_probability(np.column_stack([points, np.zeros(2)]))
    assert np.isfinite(found[0])
    assert found[1] == -np.inf


def test_its_coordinates_are_named_and_its_prior_told(posterior: Gaussian) -> None:
    assert posterior.names == posterior.sampled == NAMES == ("beta0", "beta1", "beta2", "sigma")
    assert "mean friction above 0" in posterior.prior
    assert posterior.local == 0.0
