"""Robust regression as a method of ``fit``: the M-estimate and what it says of itself."""

import time

from estimators.defaults import ROBUST
from estimators.friction_model import FrictionModel
from estimators.likelihoods.posterior import PosteriorSummary
from estimators.linear.coefficient_errors import of_any_grasp
from estimators.linear.fit_data import FitData
from estimators.linear.m_estimate import LOSSES, m_estimate
from estimators.linear.priors import WEAK
from estimators.methods.reporting import Diagnostics, by_coefficient, report
from estimators.not_converged import NotConverged


def fit(data: FitData, loss: str = "tukey", seed: int = 0) -> FrictionModel:
    """MM-estimate with the ``loss`` "tukey" or "huber" and cluster-robust errors; see ``m_estimate``.

    Raises ``NotConverged`` where the estimate does not settle.
    """
    begin = time.perf_counter()
    found = m_estimate(data, data.raw("robust"), LOSSES[loss], seed)
    degrees = data.effective_n - 1.0 - found.linear.rank
    coefficients, errors = found.linear.coefficients, found.errors
    diagnostics: Diagnostics = {
        "loss": loss,
        "downweighted": found.downweighted,
        **by_coefficient("standard_error_cluster", errors.standard),
        **by_coefficient("degrees_of_freedom", errors.degrees),
    }
    if data.of_one_grasp:
        errors = of_any_grasp(errors, coefficients)
        diagnostics |= {"prior": f"between grasps {WEAK}"}
    summary = PosteriorSummary(coefficients, errors.covariance, found.scale, errors.degrees_of_freedom, degrees)
    model = report(data, "robust", summary, begin, diagnostics)
    if not found.settled:
        raise NotConverged(f"the {loss} estimate still moves after {ROBUST.iterations} iterations", model)
    return model
