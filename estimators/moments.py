"""Moments of one grasp or of many, which stand for their samples wherever the Gaussian model is fitted."""

from dataclasses import dataclass
from typing import Any

from estimators.fitting import fit
from estimators.friction_model import FrictionModel
from estimators.linear.statistics import SufficientStatistics


@dataclass(frozen=True, slots=True, eq=False)
class Moments(SufficientStatistics):
    """Mergeable sufficient statistics that can be fitted; see ``SufficientStatistics`` for what they hold."""

    def fit(self, method: str = "ols", **options: Any) -> FrictionModel:
        """Friction model from these moments alone; without clusters, errors are taken to be independent."""
        return fit(self, method, **options)
