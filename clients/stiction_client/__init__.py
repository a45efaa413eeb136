"""Client of the Stiction friction service: what a grasp planner installs."""

from stiction_client.client import AsyncFrictionClient, FrictionClient
from stiction_client.errors import (
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
    StictionError,
    UnexpectedAnswer,
)
from stiction_client.exports import (
    CoulombFriction,
    conservative_friction,
    drake_friction,
    friction_cone,
    mujoco_friction,
    mujoco_geom,
)
from stiction_client.model import Cost, Domain, FrictionModel
from stiction_client.planner import RequiredForce, required_normal_force
from stiction_client.records import Detection, FrictionAnswer, GraspLogReceipt, Job, Material, Recognition

__all__ = [
    "AsyncFrictionClient",
    "ConnectionFailed",
    "Cost",
    "CoulombFriction",
    "Detection",
    "Domain",
    "FrictionAnswer",
    "FrictionClient",
    "FrictionModel",
    "GraspLogReceipt",
    "InvalidArgument",
    "Job",
    "JobCancelled",
    "JobError",
    "JobFailed",
    "JobRefused",
    "JobTimedOut",
    "Material",
    "NoFeasibleForce",
    "NoModel",
    "ProblemError",
    "Recognition",
    "RequiredForce",
    "StictionError",
    "UnexpectedAnswer",
    "conservative_friction",
    "drake_friction",
    "friction_cone",
    "mujoco_friction",
    "mujoco_geom",
    "required_normal_force",
]
