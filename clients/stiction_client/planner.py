"""How hard to grip: the smallest normal force that keeps the probability of slip under a bound."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import special
from scipy.optimize import brentq

from stiction_client.errors import InvalidArgument, NoFeasibleForce
from stiction_client.model import FloatArray, FrictionModel

SLIP_PROBABILITY = 1e-3
"""Default bound: one slip in a thousand grasps that bear the full load."""

SLIP_PROBABILITIES = (1e-12, 0.5)
"""What may be asked for. Below, no data tell, and the quantile of Student's t is no longer computed reliably; above,
the quantile would be more optimistic than the mean, and the capacity no longer have a single peak."""

LARGEST_FORCE = 1e12
"""N an element; a capacity that still grows there has no maximum."""

_SMALLEST_BRACKET, _SMALLEST_FORCE = 1e-12, 1e-30
"""N an element; where the search for a bracket starts, and below what a force counts as 0."""


@dataclass(frozen=True, slots=True)
class RequiredForce:
    """The planner's answer, forces in N.

    ``normal_force``: the smallest that holds; ``feasible_interval``: smallest and largest that hold (infinite where
    there is no upper bound); ``margin``: the largest less the smallest, by how much a gripper may press too hard;
    ``largest_load``: the most that any force holds so (infinite where unbounded); ``element_force``: normal force of
    one element at the answer; ``friction_coefficient``: the conservative quantile there; ``within_domain``: whether
    velocity and element force lie where the model was observed; ``warning``: which of them does not, or None.
    """

    normal_force: float
    feasible_interval: tuple[float, float]
    margin: float
    largest_load: float
    element_force: float
    friction_coefficient: float
    slip_probability: float
    within_domain: bool
    warning: str | None


def required_normal_force(
    model: FrictionModel,
    tangential_load: float,
    slip_probability: float = SLIP_PROBABILITY,
    *,
    contact_area: float,
    tangential_velocity: float = 0.0,
    normal_force_limit: float | None = None,
) -> RequiredForce:
    """Smallest total normal force F_N (N) at which a contact slips with at most ``slip_probability``.

    ``tangential_load`` N on this contact (in a grasp by two fingers each bears its share); ``contact_area`` m², held
    fixed; ``tangential_velocity`` m/s; ``normal_force_limit`` N, the most that object or gripper bear. The load is
    spread evenly over N = contact_area / element_area elements, and F_N is the smallest with
    q(v, F_N/N)·F_N ≥ tangential_load, where q is the ``slip_probability``-quantile of the predictive distribution of
    μ: the scatter ε and the uncertainty of all coefficients are in it. ε is taken as common to all elements, which
    is conservative: were it independent, it would average out.

    Raises ``NoFeasibleForce`` where no force holds the load, ``InvalidArgument`` for an argument that cannot be.
    """
    _check_arguments(tangential_load, slip_probability, contact_area, tangential_velocity, normal_force_limit)
    elements = contact_area / model.element_area
    limit = math.inf if normal_force_limit is None else normal_force_limit / elements
    load = tangential_load / elements
    capacity = _Capacity.of(model, tangential_velocity, slip_probability)
    best = capacity.best_force(limit)
    if not capacity(best) >= load:
        limited = "" if normal_force_limit is None else f", normal force up to {normal_force_limit:g} N"
        reason = f"slip probability {slip_probability:g}{limited}"
        raise NoFeasibleForce(tangential_load, capacity(best) * elements, best * elements, reason)
    low, high = capacity.interval(load, best, limit)
    warning = model.extrapolation(tangential_velocity, low)
    return RequiredForce(
        normal_force=low * elements,
        feasible_interval=(low * elements, high * elements),
        margin=(high - low) * elements,
        largest_load=math.inf if best >= LARGEST_FORCE else capacity(best) * elements,
        element_force=low,
        friction_coefficient=capacity.friction(low),
        slip_probability=slip_probability,
        within_domain=warning is None,
        warning=warning,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Capacity:
    """Tangential force f·q(f) that one element holds under the normal force f, N.

    q(f) = a + c·f − √(s² + |p + f·r|²) is the conservative quantile of μ (``FrictionModel.predict``). It is concave, so
    that f·q(f) is log-concave where it is positive: it has one peak, and the forces that hold a load are one interval.
    With Σ = L·Lᵀ and Student's quantiles t: s = t·σ, p = t·Lᵀ(1, v, 0) and r = t·Lᵀ(0, 0, 1). A sum of squares can't
    turn negative by rounding, as xᵀΣx can.
    """

    a: float
    c: float
    s: float
    p: FloatArray
    r: FloatArray

    @classmethod
    def of(cls, model: FrictionModel, tangential_velocity: float, slip_probability: float) -> "_Capacity":
        scatter, error = special.stdtrit([model.scatter_degrees_of_freedom, model.degrees_of_freedom], slip_probability)
        if not np.isfinite([*model.coefficients, *model.covariance.flat, model.scale, scatter, error]).all():
            raise InvalidArgument("model", "not finite at this slip probability", "finite coefficients and quantile")
        variance, axes = np.linalg.eigh(model.covariance)
        factor = axes * np.sqrt(np.maximum(variance, 0.0))
        constant, slope = np.array([1.0, tangential_velocity, 0.0]), np.array([0.0, 0.0, 1.0])
        return cls(
            a=float(constant @ model.coefficients),
            c=float(slope @ model.coefficients),
            s=scatter * model.scale,
            p=error * constant @ factor,
            r=error * slope @ factor,
        )

    def __call__(self, force: float) -> float:
        return force * self.friction(force)

    def friction(self, force: float) -> float:
        """Conservative quantile of μ."""
        return self.a + self.c * force - self._spread(force)

    def best_force(self, limit: float) -> float:
        """Normal force that holds most, at most ``limit``; 0 where none holds anything."""
        most_friction = _last_positive(self._friction_slope, 0.0, limit)
        if self.friction(most_friction) <= 0.0:
            return 0.0
        return _last_positive(lambda f: self.friction(f) + f * self._friction_slope(f), most_friction, limit)

    def interval(self, load: float, best: float, limit: float) -> tuple[float, float]:
        """Smallest and largest normal force that hold ``load``, which ``best`` does."""
        if load == 0.0 and self.friction(0.0) <= 0.0:
            return 0.0, 0.0  # pressing helps nothing until it presses harder
        low = _last_positive(lambda f: load - self(f), 0.0, best) if load > 0.0 else 0.0
        high = _last_positive(lambda f: self(f) - load, best, limit)
        low, high = self._inside(low, load, best), self._inside(high, load, best)
        return low, math.inf if high >= LARGEST_FORCE else high

    def _inside(self, force: float, load: float, best: float) -> float:
        """Move a root by its rounding towards ``best``, so that the answer does hold the load."""
        step = math.copysign(np.finfo(float).eps * force, best - force)
        while self(force) < load and force != best:
            moved = force + step
            force, step = (moved if (best - moved) * step > 0.0 else best), 2.0 * step
        return force

    def _spread(self, force: float) -> float:
        return math.hypot(self.s, *(self.p + force * self.r))

    def _friction_slope(self, force: float) -> float:
        spread = self._spread(force)
        inclination = float((self.p + force * self.r) @ self.r) / spread if spread > 0.0 else 0.0
        return self.c - inclination


def _last_positive(function: Callable[[float], float], start: float, limit: float) -> float:
    """Where a function that is first positive, then negative, changes its sign in [start, limit].

    ``start`` where it isn't positive there, ``limit`` (or ``LARGEST_FORCE``) where it is positive all the way.
    """
    end = min(limit, LARGEST_FORCE)
    below, above = start, min(max(2.0 * start, _SMALLEST_BRACKET), end)
    if not function(below) > 0.0:
        return start
    while function(above) > 0.0:
        if above >= end:
            return end
        below, above = above, min(4.0 * above, end)
    return float(brentq(function, below, above, xtol=_SMALLEST_FORCE, rtol=4.0 * np.finfo(float).eps, maxiter=1000))


def _check_arguments(
    tangential_load: float,
    slip_probability: float,
    contact_area: float,
    tangential_velocity: float,
    normal_force_limit: float | None,
) -> None:
    if not 0.0 <= tangential_load < math.inf:
        raise InvalidArgument("tangential_load", tangential_load, "a magnitude in N, at least 0 and finite")
    rarest, most_frequent = SLIP_PROBABILITIES
    if not rarest <= slip_probability <= most_frequent:
        raise InvalidArgument("slip_probability", slip_probability, f"{rarest:g} to {most_frequent:g}")
    if not 0.0 < contact_area < math.inf:
        raise InvalidArgument("contact_area", contact_area, "m², above 0 and finite")
    if not 0.0 <= tangential_velocity < math.inf:
        raise InvalidArgument("tangential_velocity", tangential_velocity, "a magnitude in m/s, at least 0 and finite")
    if normal_force_limit is not None and not 0.0 < normal_force_limit < math.inf:
        raise InvalidArgument("normal_force_limit", normal_force_limit, "N, above 0 and finite, or None")
