"""Client of the Stiction friction service: what a grasp planner installs."""

from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING

from stiction_client import problems
from stiction_client.errors import (
    AnswerTimedOut,
    AnswerTooLarge,
    ConnectionFailed,
    InvalidArgument,
    JobCancelled,
    JobError,
    JobFailed,
    JobRefused,
    JobTimedOut,
    NoFeasibleForce,
    NoModel,
    ProblemError,
    StaleModel,
    StictionError,
    StreamEnded,
    UnexpectedAnswer,
)

if TYPE_CHECKING:
    from stiction_client.client import AsyncFrictionClient, FrictionClient
    from stiction_client.contacts import Contact, Contacts, antipodal, grasp, n_fingers
    from stiction_client.controller import (
        Command,
        ControllerState,
        ControlSettings,
        GraspController,
        Observation,
        SlipSamples,
    )
    from stiction_client.exports import (
        CoulombFriction,
        GraspitFriction,
        MujocoPair,
        PhysxMaterial,
        cone_half_angle,
        conservative_friction,
        contactile_answer,
        dexnet_friction,
        drake_friction,
        friction_cone,
        graspit_friction,
        moveit_max_contact_force,
        mujoco_friction,
        mujoco_geom,
        mujoco_pair,
        physx_material,
        sdf_surface,
        urdf_gazebo,
    )
    from stiction_client.linear_friction import Scale, Scales, SensorFriction, SensorScale
    from stiction_client.model import Cost, FrictionModel
    from stiction_client.planner import RequiredForce, RequiredForces, required_normal_force
    from stiction_client.records import (
        AuditEntry,
        ContactFriction,
        Detection,
        Finding,
        FrictionAnswer,
        GraspLogReceipt,
        Job,
        Material,
        NextGrasp,
        Recognition,
        Withdrawal,
    )

_LAZY = {
    "AsyncFrictionClient": "stiction_client.client",
    "FrictionClient": "stiction_client.client",
    "Contact": "stiction_client.contacts",
    "Contacts": "stiction_client.contacts",
    "antipodal": "stiction_client.contacts",
    "grasp": "stiction_client.contacts",
    "n_fingers": "stiction_client.contacts",
    "Command": "stiction_client.controller",
    "ControlSettings": "stiction_client.controller",
    "ControllerState": "stiction_client.controller",
    "GraspController": "stiction_client.controller",
    "Observation": "stiction_client.controller",
    "SlipSamples": "stiction_client.controller",
    "CoulombFriction": "stiction_client.exports",
    "conservative_friction": "stiction_client.exports",
    "drake_friction": "stiction_client.exports",
    "friction_cone": "stiction_client.exports",
    "mujoco_friction": "stiction_client.exports",
    "mujoco_geom": "stiction_client.exports",
    "MujocoPair": "stiction_client.exports",
    "PhysxMaterial": "stiction_client.exports",
    "cone_half_angle": "stiction_client.exports",
    "contactile_answer": "stiction_client.exports",
    "dexnet_friction": "stiction_client.exports",
    "GraspitFriction": "stiction_client.exports",
    "graspit_friction": "stiction_client.exports",
    "moveit_max_contact_force": "stiction_client.exports",
    "mujoco_pair": "stiction_client.exports",
    "physx_material": "stiction_client.exports",
    "sdf_surface": "stiction_client.exports",
    "urdf_gazebo": "stiction_client.exports",
    "Cost": "stiction_client.model",
    "Domain": "stiction_client.support",
    "FrictionModel": "stiction_client.model",
    "Scale": "stiction_client.linear_friction",
    "Scales": "stiction_client.linear_friction",
    "SensorFriction": "stiction_client.linear_friction",
    "SensorScale": "stiction_client.linear_friction",
    "RequiredForce": "stiction_client.planner",
    "RequiredForces": "stiction_client.planner",
    "required_normal_force": "stiction_client.planner",
    "AuditEntry": "stiction_client.records",
    "Detection": "stiction_client.records",
    "ContactFriction": "stiction_client.records",
    "Finding": "stiction_client.records",
    "FrictionAnswer": "stiction_client.records",
    "GraspLogReceipt": "stiction_client.records",
    "Job": "stiction_client.records",
    "Material": "stiction_client.records",
    "NextGrasp": "stiction_client.records",
    "Recognition": "stiction_client.records",
    "Withdrawal": "stiction_client.records",
}
"""Names whose modules load httpx or numpy: a program pays for what it uses."""

__version__ = version("stiction-client")

__all__ = [
    "AnswerTimedOut",
    "AnswerTooLarge",
    "AsyncFrictionClient",
    "AuditEntry",
    "Command",
    "ConnectionFailed",
    "Contact",
    "ContactFriction",
    "Contacts",
    "ControlSettings",
    "ControllerState",
    "Cost",
    "CoulombFriction",
    "Detection",
    "Domain",
    "Finding",
    "FrictionAnswer",
    "FrictionClient",
    "FrictionModel",
    "GraspController",
    "GraspLogReceipt",
    "GraspitFriction",
    "InvalidArgument",
    "Job",
    "JobCancelled",
    "JobError",
    "JobFailed",
    "JobRefused",
    "JobTimedOut",
    "Material",
    "MujocoPair",
    "NextGrasp",
    "NoFeasibleForce",
    "NoModel",
    "Observation",
    "PhysxMaterial",
    "ProblemError",
    "Recognition",
    "RequiredForce",
    "RequiredForces",
    "Scale",
    "Scales",
    "SensorFriction",
    "SensorScale",
    "SlipSamples",
    "StaleModel",
    "StictionError",
    "StreamEnded",
    "UnexpectedAnswer",
    "Withdrawal",
    "antipodal",
    "cone_half_angle",
    "conservative_friction",
    "contactile_answer",
    "dexnet_friction",
    "drake_friction",
    "friction_cone",
    "grasp",
    "graspit_friction",
    "moveit_max_contact_force",
    "mujoco_friction",
    "mujoco_geom",
    "mujoco_pair",
    "n_fingers",
    "physx_material",
    "problems",
    "required_normal_force",
    "sdf_surface",
    "urdf_gazebo",
]


def __getattr__(name: str) -> object:
    """A public name's module is loaded when the name is first asked for (PEP 562)."""
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(_LAZY[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
