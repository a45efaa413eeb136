"""Friction samples to friction models (samples → friction_model → material)."""

from estimators.errors import EstimatorError, InvalidSamples, TooFewSamples
from estimators.fitting import fit, needs_samples
from estimators.friction_model import Cost, Domain, FrictionModel
from estimators.moments import Moments
from estimators.not_converged import NotConverged
from estimators.online import ChangeDetector
from estimators.recognition import recognise
from estimators.warm_up import warm_up

__all__ = [
    "ChangeDetector",
    "Cost",
    "Domain",
    "EstimatorError",
    "FrictionModel",
    "InvalidSamples",
    "Moments",
    "NotConverged",
    "TooFewSamples",
    "fit",
    "needs_samples",
    "recognise",
    "warm_up",
]
