"""The exact posterior for independent errors: normal-inverse-gamma with a Student-t prediction."""

import time

import numpy as np

from estimators.defaults import PRIOR
from estimators.friction_model import FrictionModel
from estimators.likelihoods.posterior import PosteriorSummary
from estimators.linear.fit_data import FitData
from estimators.linear.normal_inverse_gamma import NormalInverseGamma, exact_posterior
from estimators.linear.priors import conjugate_prior, prior_rows
from estimators.methods.reporting import Diagnostics, by_coefficient, report


def fit(data: FitData) -> FrictionModel:
    """Exact posterior; it takes the errors as independent and Gaussian, clusters or not."""
    begin = time.perf_counter()
    exact = exact_posterior(data)
    diagnostics: Diagnostics = {"assumes": "independent Gaussian errors", "prior": conjugate_prior()}
    degrees = exact.degrees_of_freedom
    found = PosteriorSummary(exact.mean, exact.covariance, exact.scale, degrees, degrees)
    return report(data, "conjugate", found, begin, diagnostics | sensitivity(data, exact))


def sensitivity(data: FitData, exact: NormalInverseGamma) -> Diagnostics:
    """How much the prior says: posterior width over prior width, and the shift of β under a prior twice as wide.

    The shift is in posterior standard deviations; a coefficient that moves by more than a few hundredths is the
    prior's as much as the data's.
    """
    wide = exact_posterior(data, width=2.0 * PRIOR.width)
    spread = np.sqrt(np.diag(exact.covariance))
    prior = exact.scale / np.diag(prior_rows(data.element_area)[:, :3])
    shift = np.abs(wide.mean - exact.mean) / spread
    return by_coefficient("posterior_to_prior", spread / prior) | by_coefficient("prior_sensitivity", shift)
