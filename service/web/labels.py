"""What fields are called on pages, by the names under which the API takes them."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from service.formatting import renamed

LABELS: Mapping[str, str] = MappingProxyType(
    {
        "material": "Material",
        "method": "Method",
        "fn": "Normal force on an element, N",
        "v": "Tangential velocity, m/s",
        # a grasp to plan
        "tangential_load": "Load of all fingers together, N",
        "contact_area": "Contact area of one finger, m²",
        "fingers": "Fingers",
        "torque": "Torque of all fingers together, N·m",
        "slip_probability": "Largest accepted probability of slip",
        "round_at": "Round fingertip: force under which it has that area, N",
        "object_radius": "Round object: radius about whose axis the torque acts, m",
        "safety_factor": "Safety factor of load and torque",
        "tangential_velocity": "Tangential velocity, m/s",
        "normal_force_limit": "Most that object and gripper bear, N",
        "of": "Whose scatter counts",
        "elements": "Elements of one contact",
        # an upload
        "file": "File",
        "sensor": "Sensor",
        "format": "Format",
        "detector": "Detector of slip",
        "scale": "Scale of tracked markers, m per pixel",
        "frame_rate": "Frame rate of tracked markers, 1/s",
        "rest": "Frame in which nothing touches",
        "mapping": "Mapping of topics, fields or columns, as JSON",
        # the gel of a sensor
        "young_modulus": "Young's modulus, Pa",
        "poisson_ratio": "Poisson's ratio",
        "thickness": "From the surface to the rigid base, m",
        "marker_depth": "Depth of the markers below the surface, m",
        # a new material
        "name": "Name of the material",
        "description": "Description",
        # entries of the audit trail
        "actor": "Only what this one did",
        "action": "Only this action",
        "subject": "Only what was done to",
    }
)


def label(name: str) -> str:
    """What a page calls a field; its name, where no form has it."""
    return LABELS.get(name, name)


def named(name: str) -> str:
    """The same within a sentence."""
    return f"“{LABELS[name]}”" if name in LABELS else name


def labelled_detail(problem: Mapping[str, Any]) -> str:
    """The detail of a problem, in which the value that is wrong is called as in the form that asks for it."""
    name = str(problem.get("name") or "")
    return renamed(str(problem["detail"]), name, named(name))
