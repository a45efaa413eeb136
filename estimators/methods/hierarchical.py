"""The exact posterior where grasps and places scatter: on a grid, no sampling."""

import time

from estimators.friction_model import FrictionModel
from estimators.likelihoods.posterior import PosteriorSummary
from estimators.linear.fit_data import FitData
from estimators.linear.mixture_summary import summarise
from estimators.linear.posterior_grid import posterior_grid
from estimators.linear.priors import WEAK, ScatterPrior
from estimators.methods.reporting import Diagnostics, by_coefficient, pooled_prior, report, sensor_gain, slope_assumed


def fit(data: FitData, scatter_prior: ScatterPrior = WEAK) -> FrictionModel:
    """Posterior of the model with scatter between grasps, between places and within them; see ``linear.hierarchical``.

    Deterministic. The intervals are those of the mixture of normals that the posterior of β is.
    """
    begin = time.perf_counter()
    grid = posterior_grid(data, scatter_prior)
    found = summarise(grid.nodes, data.mean_row())
    diagnostics: Diagnostics = {
        "prior": grid.prior,
        "nodes": float(len(grid.nodes.weight)),
    }
    diagnostics |= by_coefficient("prior_sensitivity", grid.prior_shift())
    diagnostics |= pooled_prior(grid.nodes, scatter_prior) | sensor_gain(grid.nodes) | slope_assumed(grid.slope)
    summary = PosteriorSummary(
        found.coefficients,
        found.covariance,
        found.scatter.scale,
        found.degrees_of_freedom,
        found.scatter.degrees_of_freedom,
        found.scales,
    )
    return report(data, "hierarchical", summary, begin, diagnostics)
