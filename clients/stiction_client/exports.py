"""Friction as physics engines and grasp optimisers take it: conservative quantiles, never a bare mean."""

import math
from dataclasses import dataclass

import numpy as np

from stiction_client.contacts import HERTZ_TORSION
from stiction_client.errors import InvalidArgument
from stiction_client.model import FloatArray, FrictionModel

QUANTILE = 0.05
"""Default: nineteen observations of twenty have more friction."""


@dataclass(frozen=True, slots=True)
class CoulombFriction:
    """Drake's pair of coefficients: ``static_friction`` ≥ ``dynamic_friction`` ≥ 0."""

    static_friction: float
    dynamic_friction: float

    def to_sdf(self) -> str:
        """The element for a collision in SDFormat.

        Drake combines the two surfaces as 2 μ₁ μ₂/(μ₁ + μ₂), so give both collisions of the pair this element.
        """
        return (
            "<drake:proximity_properties>\n"
            f"  <drake:mu_static>{self.static_friction:.9g}</drake:mu_static>\n"
            f"  <drake:mu_dynamic>{self.dynamic_friction:.9g}</drake:mu_dynamic>\n"
            "</drake:proximity_properties>"
        )


def conservative_friction(
    model: FrictionModel, normal_force: float, quantile: float = QUANTILE, *, tangential_velocity: float = 0.0
) -> float:
    """Quantile of μ at ``normal_force`` N an element and ``tangential_velocity`` m/s, for those who need one number.

    Raises ``InvalidArgument`` for a quantile above ½, and where the quantile of μ isn't positive: the model is then
    too uncertain there to promise any friction.
    """
    if not 0.0 < quantile <= 0.5:
        raise InvalidArgument("quantile", quantile, "above 0, at most 0.5: a bound from below")
    friction = float(model.predict(tangential_velocity, normal_force, quantile))
    if not 0.0 < friction < math.inf:
        raise InvalidArgument(f"friction coefficient at quantile {quantile:g}", f"{friction:.4g}", "above 0")
    return friction


def mujoco_friction(
    model: FrictionModel, normal_force: float, quantile: float = QUANTILE, *, contact_radius: float = 0.0
) -> tuple[float, float, float]:
    """MuJoCo's friction triple: sliding [-], torsional [m], rolling [m].

    Torsional friction is that of a Hertzian contact of ``contact_radius`` m (0: a point, none); rolling friction
    isn't in the model and is 0. Sliding friction is taken at rest.
    """
    if not 0.0 <= contact_radius < math.inf:
        raise InvalidArgument("contact_radius", contact_radius, "m, at least 0 and finite")
    sliding = conservative_friction(model, normal_force, quantile)
    return sliding, HERTZ_TORSION * contact_radius * sliding, 0.0


def mujoco_geom(
    model: FrictionModel, normal_force: float, quantile: float = QUANTILE, *, contact_radius: float = 0.0
) -> str:
    """Attributes for a MuJoCo ``<geom>`` of the fingertip, as ``mujoco_friction`` has them.

    Of two geoms MuJoCo takes the larger friction unless one has priority: without it the object's default of 1
    would undo the conservative value.
    """
    triple = mujoco_friction(model, normal_force, quantile, contact_radius=contact_radius)
    condim = 4 if contact_radius > 0.0 else 3
    return f'friction="{" ".join(f"{value:.9g}" for value in triple)}" condim="{condim}" priority="1"'


def drake_friction(
    model: FrictionModel, normal_force: float, quantile: float = QUANTILE, *, sliding_velocity: float | None = None
) -> CoulombFriction:
    """Drake's Coulomb friction: static at rest, dynamic at ``sliding_velocity`` m/s (by default the fastest observed).

    Where friction grows with velocity, the static value stands for both, since Drake asks for static ≥ dynamic.
    """
    velocity = model.domain.tangential_velocity[1] if sliding_velocity is None else sliding_velocity
    static = conservative_friction(model, normal_force, quantile)
    dynamic = conservative_friction(model, normal_force, quantile, tangential_velocity=velocity)
    return CoulombFriction(static, min(static, dynamic))


def friction_cone(
    model: FrictionModel, normal_force: float, quantile: float = QUANTILE, *, edges: int = 8
) -> FloatArray:
    """Edges of a linearised friction cone, [edges, 3]: (f_x, f_y, f_z) with f_z = 1 along the contact normal.

    Their non-negative combinations lie inside the cone |f_t| ≤ μ f_n (an inner approximation, hence conservative);
    between two edges it loses at most the part 1 − cos(π/edges) of μ.
    """
    if edges < 3:
        raise InvalidArgument("edges", edges, "at least 3")
    friction = conservative_friction(model, normal_force, quantile)
    angle = 2.0 * np.pi * np.arange(edges) / edges
    return np.stack([friction * np.cos(angle), friction * np.sin(angle), np.ones(edges)], axis=-1)
