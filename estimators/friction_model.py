"""The fitted stochastic linear friction model (stage 6: friction_model)."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from estimators.defaults import IDENTIFIABILITY
from estimators.errors import InvalidSamples
from slipcore.references import ESTIMATION, LIKELIHOODS, cited
from stiction_client.model import Cost, Domain, Scale, Scales
from stiction_client.support import Kind, Support, extrapolation, support, widening

__all__ = ["Cost", "Domain", "FrictionModel", "Scale", "Scales"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class FrictionModel:
    """Friction ``μ = β₀ + β₁ v + β₂ f_n + ε`` (paper, eq. 40) as fitted, with its uncertainty.

    ``coefficients`` [3]: β₀ [-], β₁ [s/m], β₂ [1/N]; ``covariance`` [3, 3] of them; ``scale``: standard deviation σ
    of ε [-]; ``n`` samples of elements of ``element_area`` m²; ``degrees_of_freedom`` of the Student-t distribution
    that the coefficients follow and ``scatter_degrees_of_freedom`` of that which ε/σ follows; ``identifiable`` [3]
    bool; ``draws`` [k, ≥ 4] of (β, σ, …) or None; ``scales`` of the scatter where the method tells them apart, when
    σ is all of it, as one element in a new grasp shows it.
    """

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
    def standard_errors(self) -> FloatArray:
        """Standard errors of the coefficients, [3]."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def references(self) -> tuple[str, ...]:
        """The papers behind the method and its likelihood."""
        likelihood = str(self.diagnostics.get("likelihood", ""))
        return cited(ESTIMATION.get(self.method, ()), LIKELIHOODS.get(likelihood, ()))

    def interval(self, level: float = IDENTIFIABILITY.interval) -> FloatArray:
        """Central interval of each coefficient at ``level``: [3, 2]; from the draws where there are any."""
        _check_probability("level", level)
        if self.draws is not None:
            return np.asarray(np.quantile(self.draws[:, :3], [0.5 * (1.0 - level), 0.5 * (1.0 + level)], axis=0).T)
        half = special.stdtrit(self.degrees_of_freedom, 0.5 * (1.0 + level)) * self.standard_errors
        return np.stack([self.coefficients - half, self.coefficients + half], axis=1)

    def predict(
        self,
        tangential_velocity: ArrayLike,
        normal_force: ArrayLike,
        quantile: float | None = None,
        of: str = "element",
        elements: int | None = None,
    ) -> FloatArray:
        """Friction coefficient expected at v (m/s) and f_n (N an element), or a quantile of what a new grasp shows.

        ``of``: one "element", or a "contact", whose friction is the mean over its ``elements``: scatter between grasps
        stays, that between places and within them averages out. A model that cannot tell its ``scales`` apart takes
        all of its scatter as shared.

        The quantile includes the scatter and the uncertainty of the coefficients, whose distances from the mean add
        as root of squares (Graybill & Wang 1980): exact where all have the same degrees of freedom, and not too narrow
        in the tails where some have less. Outside the data the ``widening`` adds in the same way (``support.BEND``). No
        quantile is below 0. Shapes broadcast. Raises ``InvalidSamples`` for a quantile outside (0, 1) and for a contact
        of no elements.
        """
        count = _averaged(of, elements)
        v, f_n = np.broadcast_arrays(np.asarray(tangential_velocity, float), np.asarray(normal_force, float))
        x = np.stack([np.ones_like(v), v, f_n], axis=-1)
        mean = x @ self.coefficients
        if quantile is None:
            return mean
        _check_probability("quantile", quantile)
        error = np.sqrt(np.maximum(np.einsum("...i,ij,...j->...", x, self.covariance, x), 0.0))
        uncertain = special.stdtrit(self.degrees_of_freedom, quantile) * error
        outside = special.ndtri(quantile) * widening(self, v, f_n)
        distance = np.hypot(np.hypot(self._scattered(quantile, mean, count), uncertain), outside)
        return np.asarray(np.maximum(mean + np.sign(quantile - 0.5) * distance, 0.0))

    def _scattered(self, quantile: float, mean: FloatArray, count: int) -> FloatArray | float:
        """How far scatter alone takes the mean over so many elements of a new grasp from the ``mean`` [...]."""
        if self.scales is None:
            return float(special.stdtrit(self.scatter_degrees_of_freedom, quantile) * self.scale)
        grasp, place, within = (
            scale.quantile(quantile)
            for scale in (self.scales.between_grasps, self.scales.between_places, self.scales.within)
        )
        return np.asarray(np.sqrt((grasp * mean) ** 2 + (place**2 + within**2) / count))

    def extrapolation(self, tangential_velocity: float, normal_force: float) -> str | None:
        """Which of v (m/s) and f_n (N an element) lies outside the data behind the model; None where neither does.

        Slower than the data is not outside: slip is never observed at rest, and a grasp that holds is the limit v → 0.
        """
        return extrapolation(self.domain, tangential_velocity, normal_force)

    def support_at(self, tangential_velocity: float, normal_force: float, stale: str | None = None) -> Support:
        """What the answer at v (m/s) and f_n (N an element) rests on, and what to do about it.

        ``stale``: why the model is not its material's any more, if it is not.
        """
        return support(self, tangential_velocity, normal_force, stale)

    @property
    def support(self) -> Kind:
        """What answers rest on at rest and in the middle of the normal forces observed (``support_at``)."""
        return self.support_at(0.0, 0.5 * sum(self.domain.normal_force)).kind

    @property
    def advice(self) -> str:
        """What to do about it."""
        return self.support_at(0.0, 0.5 * sum(self.domain.normal_force)).advice


def _check_probability(name: str, value: float) -> None:
    if not 0.0 < value < 1.0:
        raise InvalidSamples(name, value, "above 0 and below 1")


def _averaged(of: str, elements: int | None) -> int:
    """Over how many elements the scatter of places averages out."""
    if of not in ("element", "contact"):
        raise InvalidSamples("of", of, '"element" or "contact"')
    if of == "element":
        return 1
    if elements is None or elements < 1:
        raise InvalidSamples("elements", elements, "the number of elements of the contact, at least 1")
    return elements
