"""The fitted stochastic linear friction model (stage 6: friction_model)."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import IDENTIFIABILITY
from estimators.errors import InvalidSamples
from slipcore.references import ESTIMATION, LIKELIHOODS, cited
from stiction_client.linear_friction import (
    FORCES,
    VELOCITIES,
    LinearFriction,
    Scale,
    Scales,
    SensorFriction,
    SensorScale,
)
from stiction_client.model import Cost
from stiction_client.support import Domain

if TYPE_CHECKING:
    from estimators.inference_data import InferenceData

FloatArray = NDArray[np.float64]

__all__ = ["Cost", "Domain", "FrictionModel", "Scale", "Scales", "SensorFriction", "SensorScale"]


@dataclass(frozen=True, slots=True, eq=False)
class FrictionModel(LinearFriction):
    """Friction ``μ = β₀ + β₁ v + β₂ f_n + ε`` (paper, eq. 40) as fitted, with its uncertainty.

    ``coefficients`` [3]: β₀ [-], β₁ [s/m], β₂ [1/N]; ``covariance`` [3, 3] of them; ``scale``: standard deviation σ
    of ε [-]; ``n`` samples of elements of ``element_area`` m²; ``degrees_of_freedom`` of the Student-t distribution
    that the coefficients follow and ``scatter_degrees_of_freedom`` of that which ε/σ follows; ``identifiable`` [3]
    bool; ``draws`` [k, ≥ 4] of (β, σ, …) or None; ``scales`` of the scatter where the method separates them, when
    σ is all of it, as one element in a new grasp shows it.
    """

    refusal: ClassVar[type[ValueError]] = InvalidSamples
    velocities: ClassVar[tuple[float, float, str]] = (0.0, FORCES[1], VELOCITIES[2])  # as samples may have

    method: str
    coefficients: FloatArray
    covariance: FloatArray
    scale: float
    n: int
    degrees_of_freedom: float
    scatter_degrees_of_freedom: float
    domain: Domain
    identifiable: NDArray[np.bool_]
    element_area: float
    cost: Cost
    diagnostics: Mapping[str, float | str] = field(default_factory=dict)
    draws: FloatArray | None = None
    scales: Scales | None = None

    @property
    def references(self) -> tuple[str, ...]:
        """The papers behind the method and its likelihood."""
        likelihood = str(self.diagnostics.get("likelihood", ""))
        return cited(ESTIMATION.get(self.method, ()), LIKELIHOODS.get(likelihood, ()))

    def to_inference_data(self) -> "InferenceData":
        """The draws of the posterior as ArviZ takes them: one chain, each parameter by its name.

        Raises ``InvalidSamples`` for a model without draws, ``ModuleNotFoundError`` where ArviZ is not installed.
        """
        from estimators.inference_data import inference_data

        if self.draws is None:
            raise InvalidSamples("draws", f"none of a model by {self.method}", "a sampled posterior: fit by bayes")
        names = str(self.diagnostics["draws"]).split(", ")
        return inference_data(dict(zip(names, self.draws.T, strict=True)))

    def interval(self, level: float = IDENTIFIABILITY.interval) -> FloatArray:
        """Central interval of each coefficient at ``level``: [3, 2]; from the draws where there are any."""
        if self.draws is None:
            return LinearFriction.interval(self, level)
        self._check_probability("level", level)
        return np.asarray(np.quantile(self.draws[:, :3], [0.5 * (1.0 - level), 0.5 * (1.0 + level)], axis=0).T)
