"""Bayesian fit by emcee: the posterior of a likelihood, sampled until its Monte-Carlo error is small enough."""

import time

import numpy as np
from numpy.typing import NDArray

from estimators import ols
from estimators.defaults import PRIOR, REFERENCE, SAMPLING
from estimators.errors import NotConverged
from estimators.evidence import Evidence
from estimators.friction_model import Cost, FrictionModel
from estimators.identifiability import effects, identifiable
from estimators.least_squares import solve
from estimators.likelihoods.gaussian import gaussian
from estimators.likelihoods.posterior import Posterior
from estimators.sampling import Chain, sample

FloatArray = NDArray[np.float64]


def fit(
    evidence: Evidence, accuracy: float | None = None, seconds: float | None = None, seed: int = 0
) -> FrictionModel:
    """Posterior of (β, σ) by emcee, whitened by the exact posterior and started from it.

    Raises ``NotConverged``, which carries the model, where the chain is shorter than 50 autocorrelation times or its
    walkers disagree. A chain that is sound but was stopped by ``seconds`` before ``accuracy`` says so in
    ``diagnostics["stopped"]`` and in ``cost.monte_carlo_error``.
    """
    begin = time.perf_counter()
    posterior = gaussian(evidence.factor, evidence.domain, evidence.element_area)
    chain = sample(posterior.log_probability, len(posterior.names), accuracy, seconds, seed)
    summary = posterior.summarise(chain.flat())
    linear = solve(evidence.factor, REFERENCE.spans(evidence.element_area))
    effect = effects(summary.covariance, summary.degrees_of_freedom, evidence)
    diagnostics = ols.describe(evidence, linear) | ols.by_coefficient("effect", effect)
    model = FrictionModel(
        method="bayes",
        coefficients=summary.coefficients,
        covariance=summary.covariance,
        scale=summary.scale,
        n=evidence.n,
        degrees_of_freedom=summary.degrees_of_freedom,
        domain=evidence.domain,
        identifiable=identifiable(effect),
        element_area=evidence.element_area,
        cost=Cost(time.perf_counter() - begin, chain.monte_carlo_error),
        diagnostics=diagnostics | _convergence(chain, posterior) | _priors(),
        draws=_thinned(chain, posterior),
    )
    if chain.trouble:
        raise NotConverged(chain.trouble, model)
    return model


def _thinned(chain: Chain, posterior: Posterior) -> FloatArray:
    """Draws evenly over the chain, at most ``kept_draws`` of them, in natural parameters."""
    flat = chain.flat()
    return posterior.natural(flat[:: -(-len(flat) // SAMPLING.kept_draws)])


def _convergence(chain: Chain, posterior: Posterior) -> dict[str, float | str]:
    diagnostics: dict[str, float | str] = {
        "likelihood": "gaussian",
        "move": chain.move,
        "stopped": chain.stopped,
        "acceptance": chain.acceptance,
        "steps": float(chain.draws.shape[0]),
        "walkers": float(chain.draws.shape[1]),
    }
    if np.isfinite(chain.split_rhat):
        diagnostics["split_rhat"] = chain.split_rhat
    for name, tau, size in zip(posterior.names, chain.autocorrelation_time, chain.effective_sample_size, strict=True):
        diagnostics[f"autocorrelation_time_{name}"] = float(tau)
        diagnostics[f"effective_sample_size_{name}"] = float(size)
    return diagnostics


def _priors() -> dict[str, float | str]:
    span = REFERENCE.tangential_velocity
    return {
        "prior": (
            f"beta | sigma ~ N(({REFERENCE.friction:g}, 0, 0), sigma^2 V0), at sigma = {REFERENCE.scatter:g} of sd "
            f"{PRIOR.width:g} in beta0 and in each slope times its span ({span:g} m/s, {REFERENCE.pressure:g} Pa times "
            f"the element area); sigma^2 ~ IG({PRIOR.degrees_of_freedom / 2:g}, "
            f"{PRIOR.degrees_of_freedom / 2 * REFERENCE.scatter**2:g}); mean friction above 0 over the data's domain"
        )
    }
