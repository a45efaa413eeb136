"""Robust regression as a method of ``fit``: the M-estimate and what it says of itself."""

import time

from estimators.errors import InvalidSamples
from estimators.friction_model import FrictionModel
from estimators.linear.fit_data import FitData
from estimators.linear.m_estimate import ITERATIONS, LOSSES, m_estimate
from estimators.methods.reporting import by_coefficient, report
from estimators.not_converged import NotConverged


def fit(data: FitData, loss: str = "tukey", seed: int = 0) -> FrictionModel:
    """MM-estimate with the ``loss`` "tukey" or "huber" and cluster-robust errors; see ``m_estimate``.

    Raises ``NotConverged`` where the estimate does not settle.
    """
    if loss not in LOSSES:
        raise InvalidSamples("loss", loss, ", ".join(LOSSES))
    begin = time.perf_counter()
    found = m_estimate(data, data.raw("robust"), LOSSES[loss], seed)
    degrees = data.effective_n - 1.0 - found.linear.rank
    model = report(
        data,
        "robust",
        found.linear.coefficients,
        found.errors.covariance,
        found.scale,
        found.errors.degrees_of_freedom,
        begin,
        {
            "loss": loss,
            "downweighted": found.downweighted,
            **by_coefficient("standard_error_cluster", found.errors.standard),
            **by_coefficient("degrees_of_freedom", found.errors.degrees),
        },
        scatter_degrees_of_freedom=degrees,
    )
    if not found.settled:
        raise NotConverged(f"the {loss} estimate still moves after {ITERATIONS} iterations", model)
    return model
