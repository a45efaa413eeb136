"""The members that a grasp log is made of, by name: what every reader gathers and every writer writes."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.formats.json_text import parse
from slipcore.errors import InvalidInput
from slipcore.frames import UNNAMED, FrictionLaw, GraspLog, GroundTruth

Members = Mapping[str, NDArray[Any]]

TEXT, INTEGER, FLAG, FLOAT64, FLOAT = ("text",), ("int64",), ("bool",), ("float64",), ("float64", "float32")
REQUIRED = {"time": FLOAT64, "position": FLOAT64, "displacement": FLOAT, "element_area": FLOAT64}
OPTIONAL = {
    "force": FLOAT,
    "normal": FLOAT,
    "object_pose": FLOAT64,
    "contact": FLAG,
    "observed": FLAG,
    "gripper_force": FLOAT64,
    "gripper_force_deviation": FLOAT64,
    "sensor": TEXT,
    "metadata": TEXT,
}
TRUTH = {
    "truth_contact": FLAG,
    "truth_slip_kinematic": FLAG,
    "truth_slip_contact_factor": FLAG,
    "truth_stick_ratio": FLOAT64,
    "truth_friction": FLOAT64,
}
DTYPES = REQUIRED | OPTIONAL | TRUTH

ONCE = ("position", "element_area", "gripper_force_deviation", "sensor", "metadata", "truth_friction")
"""Members of the whole log; of all others there is one entry a frame."""


MARKS = ("mapping", "displacement", "position", "contact", "element_area", "rest", "start_time")
"""Entries of the metadata in which a reader says what it did itself; nothing else that is noted has their names."""


def of_all_frames(name: str, stated: NDArray[Any]) -> NDArray[Any]:
    """What all frames [t, ...] state alike of the whole log; raises ``InvalidInput`` where they differ."""
    alike = (stated == stated[:1]) | ((stated != stated) & (stated[:1] != stated[:1]))  # NaN is not equal to itself
    if not alike.all():
        frame = int(np.argwhere(~alike)[0][0])
        allowed = "one value of the whole log"
        if name == "position":
            allowed += "; where its fields are places of moving markers, map displacement to the same fields"
        raise InvalidInput(name, f"other in frame {frame} than in frame 0", allowed)
    return np.asarray(stated[0])


def grasp_log(members: Members) -> GraspLog:
    """The log of these members; raises ``InvalidInput`` naming the one that is wrong."""
    return GraspLog(
        time=members["time"],
        position=members["position"],
        displacement=members["displacement"],
        element_area=scalar(members, "element_area"),
        force=members.get("force"),
        normal=members.get("normal"),
        object_pose=members.get("object_pose"),
        sensor=_scalar_or(members, "sensor", UNNAMED),
        metadata=stated_metadata(members),
        truth=_truth(members),
        contact=members.get("contact"),
        observed=members.get("observed"),
        gripper_force=members.get("gripper_force"),
        gripper_force_deviation=_scalar_or(members, "gripper_force_deviation", None),
    )


def scalar(members: Members, name: str) -> Any:
    """The single value of a member."""
    array = members[name]
    if array.shape != ():
        raise InvalidInput(name, f"of shape {list(array.shape)}", "a single value (shape [])")
    try:
        value = array.item()
        str(value).encode()  # text must be storable: no lone surrogates
    except ValueError as error:
        raise InvalidInput(name, "not valid Unicode", "Unicode text") from error
    return value


def _scalar_or(members: Members, name: str, otherwise: Any) -> Any:
    """The single value of a member that need not be there."""
    return scalar(members, name) if name in members else otherwise


def stated_metadata(members: Members) -> dict[str, str]:
    """The entries of the metadata, none where there are no metadata."""
    text = _scalar_or(members, "metadata", "{}")
    allowed = "a JSON object of strings"
    entries = parse("metadata", text, allowed)
    if not isinstance(entries, dict) or not all(isinstance(value, str) for value in entries.values()):
        raise InvalidInput("metadata", text[:100], allowed)
    return entries


def _truth(members: Members) -> GroundTruth | None:
    missing = [name for name in TRUTH if name not in members]
    if len(missing) == len(TRUTH):
        return None
    if missing:
        raise InvalidInput("truth", f"without {', '.join(missing)}", "all of the truth's members, or none")
    friction = members["truth_friction"]
    if friction.shape != (4,):
        raise InvalidInput("truth_friction", f"of shape {list(friction.shape)}", "shape [4]: β₀, β₁, β₂, σ")
    intercept, velocity, force, scale = (float(value) for value in friction)
    masks = {name: members[f"truth_{name}"] for name in ("contact", "slip_kinematic", "slip_contact_factor")}
    stick_ratio = np.array(members["truth_stick_ratio"], dtype=np.float64)
    law = FrictionLaw((intercept, velocity, force), scale)
    return GroundTruth(**masks, stick_ratio=stick_ratio, friction=law)
