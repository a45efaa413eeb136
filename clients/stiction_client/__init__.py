"""Client of the Stiction friction service: what a grasp planner installs."""

from importlib import import_module
from typing import TYPE_CHECKING

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

if TYPE_CHECKING:
    from stiction_client.client import AsyncFrictionClient, FrictionClient
    from stiction_client.contacts import Contact, Contacts, antipodal, n_fingers
    from stiction_client.exports import (
        CoulombFriction,
        conservative_friction,
        drake_friction,
        friction_cone,
        mujoco_friction,
        mujoco_geom,
    )
    from stiction_client.model import Cost, Domain, FrictionModel
    from stiction_client.planner import RequiredForce, RequiredForces, required_normal_force
    from stiction_client.records import Detection, FrictionAnswer, GraspLogReceipt, Job, Material, Recognition

_LAZY = {
    "AsyncFrictionClient": "stiction_client.client",
    "FrictionClient": "stiction_client.client",
    "Contact": "stiction_client.contacts",
    "Contacts": "stiction_client.contacts",
    "antipodal": "stiction_client.contacts",
    "n_fingers": "stiction_client.contacts",
    "CoulombFriction": "stiction_client.exports",
    "conservative_friction": "stiction_client.exports",
    "drake_friction": "stiction_client.exports",
    "friction_cone": "stiction_client.exports",
    "mujoco_friction": "stiction_client.exports",
    "mujoco_geom": "stiction_client.exports",
    "Cost": "stiction_client.model",
    "Domain": "stiction_client.model",
    "FrictionModel": "stiction_client.model",
    "RequiredForce": "stiction_client.planner",
    "RequiredForces": "stiction_client.planner",
    "required_normal_force": "stiction_client.planner",
    "Detection": "stiction_client.records",
    "FrictionAnswer": "stiction_client.records",
    "GraspLogReceipt": "stiction_client.records",
    "Job": "stiction_client.records",
    "Material": "stiction_client.records",
    "Recognition": "stiction_client.records",
}
"""Names whose modules load httpx or numpy: a program pays for what it uses."""

__all__ = [
    "AsyncFrictionClient",
    "ConnectionFailed",
    "Contact",
    "Contacts",
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
    "RequiredForces",
    "StictionError",
    "UnexpectedAnswer",
    "antipodal",
    "conservative_friction",
    "drake_friction",
    "friction_cone",
    "mujoco_friction",
    "mujoco_geom",
    "n_fingers",
    "required_normal_force",
]


def __getattr__(name: str) -> object:
    """A public name's module is loaded when the name is first asked for (PEP 562)."""
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(_LAZY[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
