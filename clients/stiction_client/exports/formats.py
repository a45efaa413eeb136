"""Friction in the words of other engines, descriptions of robots, and grasp planners."""

import math
from dataclasses import dataclass
from typing import Unpack
from xml.sax.saxutils import quoteattr

from stiction_client.arguments import of_kind
from stiction_client.exports.coulomb import QUANTILE, Terms, conservative_friction
from stiction_client.linear_friction import LinearFriction, check_model
from stiction_client.planner import RequiredForce

ONE_DEVIATION = 0.15865525393145707
"""Quantile of a normal distribution one standard deviation below its mean."""


@dataclass(frozen=True, slots=True)
class PhysxMaterial:
    """A material of PhysX, Isaac Sim and Isaac Lab; give it to *both* bodies of the pair.

    Of two combine modes the higher in average < min < multiply < max decides. Two equal materials give their own value
    by average, min and max alike; beside another material "min" never promises more than ours.
    """

    static_friction: float
    dynamic_friction: float
    friction_combine_mode: str = "min"

    def to_usd(self) -> str:
        """The attributes of a USD material with PhysicsMaterialAPI and PhysxMaterialAPI."""
        return (
            f"float physics:staticFriction = {self.static_friction:.9g}\n"
            f"float physics:dynamicFriction = {self.dynamic_friction:.9g}\n"
            f'uniform token physxMaterial:frictionCombineMode = "{self.friction_combine_mode}"'
        )


def physx_material(
    model: LinearFriction,
    normal_force: float,
    quantile: float = QUANTILE,
    *,
    sliding_velocity: float | None = None,
    **terms: Unpack[Terms],
) -> PhysxMaterial:
    """Static friction at rest, dynamic at ``sliding_velocity`` m/s (by default the fastest observed), never above it.

    ``normal_force`` N an element.
    """
    check_model(model)
    velocity = model.domain.tangential_velocity[1] if sliding_velocity is None else sliding_velocity
    static = conservative_friction(model, normal_force, quantile, **terms)
    moving = conservative_friction(model, normal_force, quantile, tangential_velocity=velocity, **terms)
    return PhysxMaterial(static, min(static, moving))


def sdf_surface(model: LinearFriction, normal_force: float, quantile: float = QUANTILE, **terms: Unpack[Terms]) -> str:
    """The ``<surface>`` of an SDFormat collision, as Gazebo takes it; of two surfaces it takes the smaller friction."""
    friction = conservative_friction(model, normal_force, quantile, **terms)
    return f"<surface><friction><ode><mu>{friction:.9g}</mu><mu2>{friction:.9g}</mu2></ode></friction></surface>"


def urdf_gazebo(
    model: LinearFriction, link: str, normal_force: float, quantile: float = QUANTILE, **terms: Unpack[Terms]
) -> str:
    """Gazebo's extension of a URDF ``link``; URDF itself has no friction of contacts."""
    of_kind("link", link, str)
    friction = conservative_friction(model, normal_force, quantile, **terms)
    return f"<gazebo reference={quoteattr(link)}><mu1>{friction:.9g}</mu1><mu2>{friction:.9g}</mu2></gazebo>"


def dexnet_friction(model: LinearFriction, normal_force: float, **terms: Unpack[Terms]) -> dict[str, float]:
    """Dex-Net's two parameters: the expected friction, and its *variance*, as which ``sigma_friction_coef`` is used.

    Its grasps are scored over random friction, so that the spread is the caution here: that of a new observation, from
    the quantile one standard deviation below the mean.
    """
    conservative_friction(model, normal_force, **terms)  # refuses what promises no friction
    expected = float(model.predict(0.0, normal_force))
    below = conservative_friction(model, normal_force, ONE_DEVIATION, **terms)
    return {"friction_coef": expected, "sigma_friction_coef": (expected - below) ** 2}


def moveit_max_contact_force(answer: RequiredForce) -> float:
    """``max_contact_force`` of MoveIt's Grasp message, N: the largest that holds; 0, its word for none, if any do."""
    of_kind("answer", answer, RequiredForce)
    largest = answer.feasible_interval[1]
    return largest if math.isfinite(largest) else 0.0


def contactile_answer(answer: RequiredForce | None) -> dict[str, float]:
    """What Contactile's PapillArray gives its users: ``friction_est`` [-], -1 for none, and ``target_grip_force`` N."""
    if answer is None:
        return {"friction_est": -1.0, "target_grip_force": -1.0}
    of_kind("answer", answer, RequiredForce)
    return {"friction_est": answer.friction_coefficient, "target_grip_force": answer.normal_force}
