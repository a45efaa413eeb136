"""Friction as one conservative number, and as a cone."""

import math

import numpy as np

from stiction_client.errors import InvalidArgument
from stiction_client.model import FloatArray, FrictionModel

QUANTILE = 0.05
"""Default: nineteen observations of twenty have more friction."""


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


def cone_half_angle(model: FrictionModel, normal_force: float, quantile: float = QUANTILE) -> float:
    """Angle between the contact normal and the edge of the friction cone, rad; ``normal_force`` N an element."""
    return math.atan(conservative_friction(model, normal_force, quantile))
