"""Friction samples to friction models (samples → friction_model → material)."""

from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING

from estimators.errors import EstimatorError, InvalidSamples, TooFewSamples
from estimators.warm_up import warm_up

if TYPE_CHECKING:
    from estimators.change_alarm import ChangeAlarm
    from estimators.change_detector import ChangeDetector
    from estimators.fitting import fit, needs_samples
    from estimators.friction_model import Cost, Domain, FrictionModel, Scale, Scales, SensorFriction, SensorScale
    from estimators.grasp_design import NextGrasp, Probing, WorkingPoint, next_grasp
    from estimators.moments import Moments
    from estimators.not_converged import NotConverged
    from estimators.population import ScatterPrior, population_scatter
    from estimators.recognition import recognise
    from estimators.single_grasps import GraspEffect, grasp_effects

_LAZY = {
    "ChangeAlarm": "estimators.change_alarm",
    "fit": "estimators.fitting",
    "needs_samples": "estimators.fitting",
    "Cost": "estimators.friction_model",
    "Domain": "estimators.friction_model",
    "FrictionModel": "estimators.friction_model",
    "Scale": "estimators.friction_model",
    "Scales": "estimators.friction_model",
    "SensorFriction": "estimators.friction_model",
    "SensorScale": "estimators.friction_model",
    "GraspEffect": "estimators.single_grasps",
    "grasp_effects": "estimators.single_grasps",
    "Moments": "estimators.moments",
    "NextGrasp": "estimators.grasp_design",
    "Probing": "estimators.grasp_design",
    "WorkingPoint": "estimators.grasp_design",
    "next_grasp": "estimators.grasp_design",
    "NotConverged": "estimators.not_converged",
    "ChangeDetector": "estimators.change_detector",
    "ScatterPrior": "estimators.population",
    "population_scatter": "estimators.population",
    "recognise": "estimators.recognition",
}
"""Names whose modules load scipy: who only handles errors, or passes models on, goes without."""

__version__ = version("stiction")

__all__ = [
    "ChangeAlarm",
    "ChangeDetector",
    "Cost",
    "Domain",
    "EstimatorError",
    "FrictionModel",
    "GraspEffect",
    "InvalidSamples",
    "Moments",
    "NextGrasp",
    "NotConverged",
    "Probing",
    "Scale",
    "Scales",
    "ScatterPrior",
    "SensorFriction",
    "SensorScale",
    "TooFewSamples",
    "WorkingPoint",
    "fit",
    "grasp_effects",
    "needs_samples",
    "next_grasp",
    "population_scatter",
    "recognise",
    "warm_up",
]


def __getattr__(name: str) -> object:
    """A public name's module is loaded when the name is first asked for (PEP 562)."""
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(_LAZY[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
