"""Bayesian fit by emcee: the posterior of a likelihood, sampled until its Monte-Carlo error is small enough."""

import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from estimators.defaults import SAMPLING
from estimators.errors import InvalidSamples
from estimators.friction_model import FrictionModel
from estimators.likelihoods.errors_in_variables import errors_in_variables
from estimators.likelihoods.gaussian import gaussian
from estimators.likelihoods.hierarchical import HierarchicalPosterior, hierarchical
from estimators.likelihoods.outlier import outlier
from estimators.likelihoods.posterior import Posterior
from estimators.likelihoods.student_t import student_t
from estimators.linear.fit_data import FitData
from estimators.linear.normal_inverse_gamma import exact_posterior
from estimators.linear.priors import WEAK, ScatterPrior
from estimators.linear.shared_errors import shared_by_elements
from estimators.methods.conjugate import sensitivity
from estimators.methods.reporting import Diagnostics, pooled_prior, report, sensor_gain, slope_assumed
from estimators.not_converged import NotConverged
from estimators.sampling.chain import Chain, sample


class Likelihood(NamedTuple):
    """How a posterior is made from data, and the accuracy that it is sampled to by default."""

    posterior: Callable[[FitData], Posterior]
    accuracy: float


LIKELIHOODS = {
    "gaussian": Likelihood(gaussian, SAMPLING.accuracy),
    "hierarchical": Likelihood(hierarchical, SAMPLING.accuracy_of_scales),
    "student_t": Likelihood(student_t, SAMPLING.accuracy_per_sample),
    "outlier": Likelihood(outlier, SAMPLING.accuracy_per_sample),
    "errors_in_variables": Likelihood(errors_in_variables, SAMPLING.accuracy_per_sample),
}


def default_likelihood(data: FitData) -> str:
    """Scatter between grasps and places wherever samples come in clusters, else independent errors."""
    places = any(block.grasps for block in data.blocks)
    return "hierarchical" if places or 1 < data.clusters < data.n else "gaussian"


def _present_name(likelihood: str) -> str:
    if likelihood == "grasp_effects":
        warnings.warn('likelihood "grasp_effects" is now part of "hierarchical"', DeprecationWarning, stacklevel=4)
        return "hierarchical"
    return likelihood


def fit(
    data: FitData,
    likelihood: str | None = None,
    accuracy: float | None = None,
    seconds: float | None = None,
    seed: int = 0,
    scatter_prior: ScatterPrior = WEAK,
) -> FrictionModel:
    """Posterior of (β, σ, …) by emcee, whitened by its exact or Laplace approximation and started from it.

    Raises ``NotConverged``, which carries the model, where the chain is shorter than 50 autocorrelation times or its
    walkers disagree. A chain that is sound but was stopped by ``seconds`` before ``accuracy`` says so in
    ``diagnostics["stopped"]`` and in ``cost.monte_carlo_error``. ``diagnostics["shared_by_elements"]`` is the part of
    the errors' variance that samples of an element share; where it is not 0 these intervals are too narrow. Moments
    know of no elements: the entry is then missing.
    """
    begin = time.perf_counter()
    name = default_likelihood(data) if likelihood is None else _present_name(likelihood)
    if name not in LIKELIHOODS:
        raise InvalidSamples("likelihood", name, ", ".join(LIKELIHOODS))
    goal = LIKELIHOODS[name].accuracy if accuracy is None else accuracy
    posterior = hierarchical(data, scatter_prior) if name == "hierarchical" else LIKELIHOODS[name].posterior(data)
    left = None if seconds is None else max(seconds - (time.perf_counter() - begin), 0.0)
    chain = sample(posterior.log_probability, posterior.proposal, goal, left, seed, posterior.local)
    found = posterior.summarise(chain.flat(), np.random.default_rng([seed, 1]))
    diagnostics: Diagnostics = {"likelihood": name, "prior": posterior.prior, "draws": ", ".join(posterior.names)}
    diagnostics |= _convergence(chain, posterior) | sensitivity(data, exact_posterior(data))
    if isinstance(posterior, HierarchicalPosterior):
        grid = posterior.grid
        diagnostics |= pooled_prior(grid.nodes, scatter_prior) | sensor_gain(grid.nodes) | slope_assumed(grid.slope)
    if name != "hierarchical":
        diagnostics["assumes"] = "independent errors"
    independent = name != "hierarchical" and data.cluster_kind != "element"
    if independent and data.observations is not None:  # moments cannot show it
        diagnostics["shared_by_elements"] = shared_by_elements(data)
    found = replace(found, monte_carlo_error=chain.monte_carlo_error)
    model = report(data, "bayes", found, begin, diagnostics)
    if chain.trouble:
        raise NotConverged(chain.trouble, model)
    return model


def _convergence(chain: Chain, posterior: Posterior) -> Diagnostics:
    diagnostics: Diagnostics = {
        "move": chain.move,
        "stopped": chain.stopped,
        "acceptance": chain.acceptance,
        "steps": float(chain.draws.shape[0]),
        "walkers": float(chain.draws.shape[1]),
    }
    if np.isfinite(chain.split_rhat):
        diagnostics["split_rhat"] = chain.split_rhat
    for name, tau, size in zip(posterior.sampled, chain.autocorrelation_time, chain.effective_sample_size, strict=True):
        diagnostics[f"autocorrelation_time_{name}"] = float(tau)
        diagnostics[f"effective_sample_size_{name}"] = float(size)
    return diagnostics
