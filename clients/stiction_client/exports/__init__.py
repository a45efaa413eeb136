"""Friction as physics engines and grasp planners take it: conservative quantiles, never a bare mean."""

from stiction_client.exports.coulomb import QUANTILE, cone_half_angle, conservative_friction, friction_cone
from stiction_client.exports.drake import CoulombFriction, drake_friction
from stiction_client.exports.formats import (
    PhysxMaterial,
    contactile_answer,
    dexnet_friction,
    moveit_max_contact_force,
    physx_material,
    sdf_surface,
    urdf_gazebo,
)
from stiction_client.exports.graspit import GRASPIT_MATERIALS, GraspitFriction, graspit_friction
from stiction_client.exports.mujoco import HOLDING_OPTION, MujocoPair, mujoco_friction, mujoco_geom, mujoco_pair

__all__ = [
    "GRASPIT_MATERIALS",
    "HOLDING_OPTION",
    "QUANTILE",
    "CoulombFriction",
    "GraspitFriction",
    "MujocoPair",
    "PhysxMaterial",
    "cone_half_angle",
    "conservative_friction",
    "contactile_answer",
    "dexnet_friction",
    "drake_friction",
    "friction_cone",
    "graspit_friction",
    "moveit_max_contact_force",
    "mujoco_friction",
    "mujoco_geom",
    "mujoco_pair",
    "physx_material",
    "sdf_surface",
    "urdf_gazebo",
]
