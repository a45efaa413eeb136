"""Friction for Drake (drake.mit.edu, CoulombFriction and "Hydroelastic/point contact"; version 1.51)."""

import sys
from dataclasses import dataclass
from typing import Unpack

from stiction_client.arguments import number
from stiction_client.errors import InvalidArgument
from stiction_client.exports.coulomb import QUANTILE, Terms, conservative_friction
from stiction_client.linear_friction import LinearFriction, check_model


@dataclass(frozen=True, slots=True)
class CoulombFriction:
    """Drake's pair of coefficients: ``static_friction`` ≥ ``dynamic_friction`` ≥ 0.

    Raises ``InvalidArgument`` for any other, and for what is not finite, which Drake itself takes.
    """

    static_friction: float
    dynamic_friction: float

    def __post_init__(self) -> None:
        for name in ("static_friction", "dynamic_friction"):
            number(name, getattr(self, name), 0.0, sys.float_info.max)
        if self.dynamic_friction > self.static_friction:
            raise InvalidArgument(
                "dynamic_friction", self.dynamic_friction, f"at most {self.static_friction:g}, static"
            )

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


def drake_friction(
    model: LinearFriction,
    normal_force: float,
    quantile: float = QUANTILE,
    *,
    sliding_velocity: float | None = None,
    other_friction: float | None = None,
    discrete: bool = False,
    **terms: Unpack[Terms],
) -> CoulombFriction:
    """Drake's Coulomb friction: static at rest, dynamic at ``sliding_velocity`` m/s (by default the fastest observed).

    Where friction grows with velocity, the static value stands for both, since Drake asks for static ≥ dynamic; and for
    a ``discrete`` plant, which ignores the static one. Drake takes 2ab/(a + b) of two surfaces: give both this element,
    or name the ``other_friction`` [-] of the other, and this is the one that makes the pair right. Raises
    ``InvalidArgument`` where none can: a pair never has twice the other's friction.
    """
    check_model(model)
    fastest = model.domain.tangential_velocity[1] if sliding_velocity is None else sliding_velocity
    velocity = number("sliding_velocity", fastest, 0.0, 1e3, "m/s")
    static = conservative_friction(model, normal_force, quantile, **terms)
    moving = conservative_friction(model, normal_force, quantile, tangential_velocity=velocity, **terms)
    dynamic = static if discrete else min(static, moving)
    if other_friction is None:
        return CoulombFriction(static, dynamic)
    other = number("other_friction", other_friction, 1e-9, 1e9)
    return CoulombFriction(_beside(other, static), _beside(other, dynamic))


def _beside(other: float, friction: float) -> float:
    """The coefficient of a surface that has ``friction`` together with another."""
    if friction >= 2.0 * other:
        raise InvalidArgument(
            "other_friction", f"{other:g}", f"above {0.5 * friction:.4g}, half of the pair's friction"
        )
    return friction * other / (2.0 * other - friction)
